"""myogait's JSON: landmarks under MediaPipe's names, x and y as shares of the frame's width and height."""

import json
from pathlib import Path

import numpy as np

from tracker.foreign.points import Points, named_points
from tracker.run.read import Record

VERSION = "0.9.2"  # of myogait whose layout is written
NAMES = {
    f"{side}_{landmark}": joint.replace("*", side.lower())
    for side in ("LEFT", "RIGHT")
    for landmark, joint in (
        ("SHOULDER", "neck"),
        ("HIP", "hip"),
        ("KNEE", "*_knee"),
        ("ANKLE", "*_ankle"),
        ("FOOT_INDEX", "*_toe"),
    )
}


def write_myogait(record: Record, size: tuple[int, int], facing: int, tall: float | None, path: Path) -> None:
    """Write every frame of the clip in the layout of myogait; landmarks of likelihood 0 are left out.

    `size` is (width, height) of a frame in pixels, `facing` +1 right, -1 left, `tall` the height in metres.
    """
    points, news = named_points(record, NAMES, facing), record.news
    width, height = size
    table = {
        "myogait_version": VERSION,
        "meta": {
            "source": "video",
            "video_path": news.video,
            "fps": news.fps,
            "width": width,
            "height": height,
            "n_frames": len(points),
            "duration_s": round(len(points) / news.fps, 3),
        },
        "subject": None if tall is None else {"height_m": tall},
        "extraction": {"model": "slds", "direction_detected": "right" if facing > 0 else "left"},
        "frames": [_frame(points, t, float(time), size) for t, time in enumerate(record.times)],
        "normalization": None,
        "angles": None,
        "events": None,
    }
    path.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


def _frame(points: Points, t: int, time: float, size: tuple[int, int]) -> dict[str, object]:
    shares = points.places[t] / size
    seen = np.flatnonzero(points.likelihood[t] > 0)
    landmarks = {
        points.names[j]: {
            "x": round(float(shares[j, 0]), 6),
            "y": round(float(shares[j, 1]), 6),
            "visibility": round(float(points.likelihood[t, j]), 4),
        }
        for j in seen
    }
    sure = round(float(points.likelihood[t].mean()), 4)
    return {"frame_idx": t, "time_s": round(time, 6), "landmarks": landmarks, "confidence": sure}
