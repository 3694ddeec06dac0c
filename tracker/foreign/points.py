"""Named points of one figure as in other programs, and their conversion from a run.

Other programs name right and left, figtrack near and far: for a person who faces right, the right side is the
near one. Points that other programs need and the figure lacks are placed at its nearest joint: both hips at
the hip, both shoulders at the neck.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array
from tracker.run.read import Record, RunError
from tracker.run.stature import LEGS, along
from tracker.run.track import likelihood

SIDES = (("R", "right"), ("L", "left"))
# Names of each side's joints, equal in HALPE_26 and BODY_25.
LEG_POINTS = {
    f"{letter}{part}": f"{side}_{joint}"
    for letter, side in SIDES
    for part, joint in (("Knee", "knee"), ("Ankle", "ankle"), ("BigToe", "toe"))
}
JOINTS = {"Head": "head_top", "Neck": "neck", "Hip": "hip"} | LEG_POINTS
HALPE = JOINTS | {"RHip": "hip", "LHip": "hip", "RShoulder": "neck", "LShoulder": "neck"}
# Further names for a figure with arms.
ARMS = {f"{letter}{part}": f"{side}_{part.lower()}" for letter, side in SIDES for part in ("Elbow", "Wrist")}


@dataclass(frozen=True)
class Points:
    """Named points in T frames.

    names      : (J,)
    places     : (T, J, 2) pixels; NaN for missing points
    likelihood : (T, J) 0 to 1; 0 for missing points
    """

    names: tuple[str, ...]
    places: Array
    likelihood: Array

    def __len__(self) -> int:
        return len(self.places)

    @property
    def known(self) -> Array:
        """(T, J, 2) places; NaN where the likelihood is 0."""
        return np.where(self.likelihood[..., None] > 0, self.places, np.nan)


def side_seen(side: str, facing: int) -> str:
    """Whether the "right" or "left" side of a figure that faces right (+1) or left (-1) is near or far."""
    return "near" if (side == "right") == (facing > 0) else "far"


def near_far(joint: str, facing: int) -> str:
    """Our keypoint for one with a right or left side in its name; other names are unchanged."""
    side, _, part = joint.partition("_")
    return f"{side_seen(side, facing)}_{part}" if side in ("right", "left") else joint


def named_points(record: Record, names: Mapping[str, str], facing: int) -> Points:
    """A run's joints under other names, such as those of `HALPE`; joints that it lacks are left out.

    RunError: the figure was followed in no frame.
    """
    own = {name: joint if joint in record.names else near_far(joint, facing) for name, joint in names.items()}
    kept = {name: joint for name, joint in own.items() if np.isfinite(record.place(joint)).any()}
    columns = [record.names.index(joint) for joint in kept.values()]
    sure = likelihood(record.covs[:, columns], leg_pixels(record), record.measured)
    return Points(tuple(kept), record.places[:, columns], sure)


def of_people(record: Record) -> bool:
    """Whether a run's figure has hip, knees and ankles, by which people are measured."""
    return {joint for leg in LEGS for joint in leg} <= set(record.names)


def leg_pixels(record: Record) -> float:
    """Leg length, pixels: median over legs and frames, for other figures at the start; raises as `middle`."""
    if not of_people(record):
        return record.view.unit
    return middle(np.stack([along(record.places, record.names, leg) for leg in LEGS]), record)


def middle(numbers: Array, record: Record) -> float:
    """The median of (..., T) numbers over the measured frames; RunError if there are none."""
    seen = numbers[..., record.measured & np.isfinite(numbers).all(tuple(range(numbers.ndim - 1)))]
    if not seen.size:
        raise RunError("the figure was followed in no frame of this run; track the clip again")
    return float(np.median(seen))
