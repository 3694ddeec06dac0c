"""People who move on one spot of the picture: on a treadmill, or with a camera that follows past a bare wall.

The trunk of such a person is at the same place in every frame, and so becomes part of the scene. The legs
stand out again and again at the same places, unlike those of people who walk through the picture.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from kinematics.figure import Array, Figure
from kinematics.spm import joints
from tracker.outline.bodies import LARGEST, SMALLEST
from tracker.outline.cycles import Cycles, poses
from tracker.outline.stage import Stage
from tracker.survey.evidence import NOTHING

OFTEN = 0.2  # share of frames in which places that legs swing through stand out
OPENED, CLOSED = 3, 9  # sizes of specks that are removed, gaps that are closed, pixels of a small picture
SHARE = 0.1  # least size of a region above or below the largest one, as a share of it
WIDTH = 1.1  # approximate width of the regions, leg lengths
PART = 0.5  # share of the person's size below which a body within the regions is a part of the person


@dataclass(frozen=True)
class Spot:
    """The place of a person who moves without travelling through the picture.

    frame : in which the legs are farthest apart
    hip   : (2,) pixels
    unit  : approximate leg length in pixels
    """

    frame: int
    hip: Array
    unit: float

    def joints(self, figure: Figure, cycles: Cycles, facing: int) -> Array:
        """(J, 2) pixels of a figure there in the middle of a step."""
        (q,) = poses(figure, cycles.pose[:1, 0])
        return np.asarray(self.hip + self.unit * joints(figure, q) * [facing, -1.0])

    def holds(self, hips: Array) -> bool:
        """Whether a body with hips (n, 2), pixels of each frame, is at this place."""
        return bool(np.median(np.abs(hips - self.hip), axis=0).max() < self.unit)

    def larger(self, units: Array) -> bool:
        """Whether bodies of sizes (n,), pixels of each frame, can only be parts of this person."""
        return bool(np.median(units) < PART * self.unit)


def spot(stage: Stage) -> Spot | None:
    """The largest region that often stands out, with those above and below; None if these are no legs."""
    out = stage.odds > NOTHING
    often = (out.mean(0) > OFTEN).astype(np.uint8)
    often = cv2.morphologyEx(often, cv2.MORPH_OPEN, np.ones((OPENED, OPENED)))
    often = cv2.morphologyEx(often, cv2.MORPH_CLOSE, np.ones((CLOSED, CLOSED)))
    left, top, width, height, area = cv2.connectedComponentsWithStats(often)[2][1:].T
    if not len(area):
        return None
    most, right = area.argmax(), left + width
    own = (left < right[most]) & (right > left[most]) & (area > SHARE * area[most])
    x0, x1, y0, y1 = left[own].min(), right[own].max(), top[own].min(), (top + height)[own].max()
    unit = (x1 - x0) / WIDTH
    if y1 - y0 < SMALLEST * len(often) or unit > LARGEST * len(often):
        return None
    columns = np.asarray(out[:, (y0 + y1) // 2 : y1, x0:x1].any(1), bool)
    apart = np.where(columns.any(1), x1 - x0 - columns[:, ::-1].argmax(1) - columns.argmax(1), 0)
    hip = stage.up[:2] @ [0.5 * (x0 + x1 - 1), y1 - unit, 1.0]
    return Spot(int(apart.argmax()), np.asarray(hip), float(unit * stage.up[0, 0]))
