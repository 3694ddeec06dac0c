"""A rival without weights: points inside each link's outline, followed from frame to frame by optical flow.

Lucas and Kanade (1981) on pyramids (Bouguet, 2000); a point that the flow backwards does not bring home is
dropped (Kalal et al., 2010); RANSAC finds each link's similarity, which carries the joints at its ends.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from tests.benchmarks.rivals.body import Array, Body, Image, Mask

LEAST_POINTS = 20  # of a link, or it is seeded anew
MOST_POINTS = 3 * LEAST_POINTS  # seeded in a link
BLOCK = 5  # px over which a corner is judged
LEAST_MATCHES = 4  # of a link for a similarity


@dataclass(frozen=True)
class Options:
    """What was chosen by a grid on the open clips.

    window : side of the flow's window, leg lengths
    levels : of the pyramid above the picture itself
    home   : how far from home a point may come back, leg lengths
    inlier : how far from its link's similarity a point may lie, leg lengths
    joined : links share their joints in every frame; otherwise each goes its own way from its first place
    fresh  : points are seeded in every frame, not only when fewer than LEAST_POINTS are left
    """

    window: float = 0.2
    levels: int = 3
    home: float = 0.02
    inlier: float = 0.02
    joined: bool = True
    fresh: bool = True


def follow(images: Iterable[Image], body: Body, options: Options | None = None) -> Iterator[Array]:
    """The joints (J, 2) in every image, the first of which is the marked one; pixels."""
    options = options or Options()
    ends = body.joints[body.ends]
    motions = [np.eye(2, 3)] * len(ends)
    points = [np.empty((0, 2), np.float32)] * len(ends)
    before: Image | None = None
    for image in images:
        grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        if before is not None:
            starts, tips = _flow(before, grey, points, body.leg, options)
            for i in range(len(ends)):
                motions[i], points[i] = _similarity(starts[i], tips[i], motions[i], body.leg * options.inlier)
                ends[i] = cv2.transform(ends[i][None], motions[i])[0]
            if options.joined:
                ends = body.at_joints(ends)[body.ends]
        places = body.at_joints(ends)
        masks: list[Mask] = []
        for i in range(len(ends)):
            if options.fresh or len(points[i]) < LEAST_POINTS:
                masks = masks or body.masks(places, grey.shape)
                points[i] = _seeds(grey, masks[i])
        yield places
        before = grey


def _seeds(grey: Image, mask: Mask) -> Array:
    """(P, 2) corners inside a mask, filled up from a grid where there are fewer than LEAST_POINTS."""
    left, top, width, height = cv2.boundingRect(mask)
    box = np.s_[top : top + height, left : left + width]
    corners = None
    if min(width, height) >= BLOCK:
        corners = cv2.goodFeaturesToTrack(grey[box], MOST_POINTS, 0.01, 3, mask=mask[box], blockSize=BLOCK)
    found = np.empty((0, 2), np.float32) if corners is None else corners[:, 0] + np.float32([left, top])
    if len(found) < LEAST_POINTS:
        inside = np.argwhere(mask)[:, ::-1].astype(np.float32)
        spread = np.linspace(0, len(inside) - 1, min(len(inside), 2 * LEAST_POINTS)).astype(int)
        found = np.concatenate([found, inside[spread]])
    return found


def _flow(
    before: Image, after: Image, points: list[Array], leg: float, options: Options
) -> tuple[list[Array], list[Array]]:
    """Of every link the points that come home again, before and after."""
    everything = np.concatenate(points).astype(np.float32)
    links = np.repeat(np.arange(len(points)), [len(p) for p in points])
    if not len(everything):
        return points, points
    side = max(int(options.window * leg) // 2 * 2 + 1, 5)
    how = {"winSize": (side, side), "maxLevel": options.levels}
    ahead, found, _ = cv2.calcOpticalFlowPyrLK(before, after, everything, None, **how)
    home, back, _ = cv2.calcOpticalFlowPyrLK(after, before, ahead, None, **how)
    kept = (found[:, 0] > 0) & (back[:, 0] > 0)
    kept &= np.hypot(*(home - everything).T) < options.home * leg
    chosen = [kept & (links == i) for i in range(len(points))]
    return [everything[c] for c in chosen], [ahead[c] for c in chosen]


def _similarity(starts: Array, tips: Array, last: Array, inlier: float) -> tuple[Array, Array]:
    """The motion of a link (2, 3) and its points that follow it; its last motion where too few do."""
    if len(starts) >= LEAST_MATCHES:
        motion, kept = cv2.estimateAffinePartial2D(starts, tips, ransacReprojThreshold=inlier)
        if motion is not None and kept.sum() >= LEAST_MATCHES:
            return motion, tips[kept[:, 0] > 0]
    return last, np.empty((0, 2), np.float32)
