"""Follow boxes with OpenCV's CSRT tracker; run by the Python of an environment that has opencv-contrib.

    python csrt.py IMAGES.npy BOXES.npy FOUND.npy
    python csrt.py                                   prints which tracker this is

IMAGES (T, H, W, 3) uint8, BOXES (B, 4) left, top, width, height in the first image; writes FOUND (T, B, 4),
where a box that is not found keeps its last place. Lukežič et al. (2017); where OpenCV has no CSRT, MIL.
"""

import sys

import cv2
import numpy as np

KIND = "CSRT" if hasattr(cv2, "TrackerCSRT_create") else "MIL"


def main() -> None:
    """Read, follow, write."""
    if len(sys.argv) == 1:
        print(KIND)
        return
    images, boxes = np.load(sys.argv[1], mmap_mode="r"), np.load(sys.argv[2])
    cv2.setNumThreads(1)
    cv2.setRNGSeed(0)
    first = images[0, ..., ::-1].copy()
    trackers = []
    for box in boxes:
        tracker = getattr(cv2, f"Tracker{KIND}_create")()
        tracker.init(first, [round(edge) for edge in box])
        trackers.append(tracker)
    found = np.repeat(boxes[None], len(images), axis=0)
    for t in range(1, len(images)):
        image = images[t, ..., ::-1].copy()
        for b, tracker in enumerate(trackers):
            seen, box = tracker.update(image)
            found[t, b] = box if seen else found[t - 1, b]
    np.save(sys.argv[3], found)


if __name__ == "__main__":
    main()
