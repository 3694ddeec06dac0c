"""From pixels to metres in the plane in which the figure walks, with camera motion removed (`in_scene`).

x points the way the figure faces, from the first place of its hip; y points up from the floor, which is the
median height of the lower foot (of the lower ankle where neither toes nor a height are known). The length of
a pixel comes from two points with a known distance, or from the person's height (`tracker.run.stature`).
"""

from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array
from tracker.foreign.points import middle
from tracker.foreign.text_files import ForeignError
from tracker.run.read import Record
from tracker.run.stature import ANKLE_HEIGHT, stature


@dataclass(frozen=True)
class Scale:
    """metre = (facing (x - origin), floor - y) times `pixel`, the length of a pixel in metres."""

    pixel: float
    origin: float
    floor: float
    facing: int

    def to_metres(self, places: Array) -> Array:
        """(..., 2) pixels to metres, x ahead and y up."""
        ahead, up = self.facing * (places[..., 0] - self.origin), self.floor - places[..., 1]
        return np.stack([ahead, up], axis=-1) * self.pixel


def scale_by_height(record: Record, metres: float, facing: int) -> Scale:
    """The scale for a person of this height in metres; RunError if the figure was followed in no frame,
    ForeignError if it has no trunk and head."""
    tall = _height(record)
    if record.measured.any() and not np.isfinite(tall):
        raise ForeignError("the figure has no head and trunk to be measured by; give two points")
    return scale_by_pixels(record, tall / metres, facing)


def scale_by_pixels(record: Record, pixels: float, facing: int) -> Scale:
    """The scale from pixels a metre; RunError if the figure was followed in no frame."""
    feet, below = ("near_toe", "far_toe"), 0.0
    if not all(np.isfinite(record.place(name)).any() for name in feet):
        tall = _height(record)
        feet, below = ("near_ankle", "far_ankle"), ANKLE_HEIGHT * tall if np.isfinite(tall) else 0.0
    lower = np.maximum(*(record.place(name)[:, 1] for name in feet))
    floor = middle(lower, record) + below
    return Scale(1.0 / pixels, float(record.place("hip")[record.measured][0, 0]), floor, facing)


def scale_by_points(record: Record, points: tuple[float, float, float, float, float], facing: int) -> Scale:
    """The scale from x1, y1, x2, y2 in pixels and their distance in metres; ForeignError if they coincide."""
    x1, y1, x2, y2, metres = points
    pixels = float(np.hypot(x2 - x1, y2 - y1))
    if not (1.0 <= pixels < np.inf and 0.0 < metres < np.inf):
        raise ForeignError(
            f"two points apart and the metres between them give the scale; got {pixels:g} px and {metres:g} m"
        )
    return scale_by_pixels(record, pixels / metres, facing)


def _height(record: Record) -> float:
    return stature(record.places, record.names, record.measured)
