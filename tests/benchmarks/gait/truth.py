"""When the feet of a rendered figure are on the ground: the truth that strides are measured by.

The sole of a foot is a line from its heel to its toe. An end of it rests while it is lower than LOW over the
floor and goes along it at less than SLOW of the mean pace of the film. A foot is on the ground from the first
moment at which an end rests to the last; gaps shorter than GAP, in which feet of captures jitter, are closed,
and contacts as short are none. Moments are told to 1 / RATE seconds.

The definition hardly matters: with SLOW of 0.35 or 0.7, or LOW of 0.02 or 0.05, the moments of the captures
move by at most 11 ms in the median.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinematics.sides import SIDES, Side
from tests.benchmarks.rendered.captures import RATE
from tracker.scene.steps import Build, Gait, joint_places
from tracker.tables.poses import stretches

LOW = 0.03  # leg lengths; 2.5 cm of a grown-up
SLOW = 0.5
GAP = 0.08  # seconds


@dataclass(frozen=True)
class Contact:
    """A foot on the ground, seconds of the walk."""

    strike: float
    off: float


def contacts(gait: Gait, build: Build, low: float = LOW, slow: float = SLOW) -> dict[Side, list[Contact]]:
    """Of either foot, in order; those that begin or end outside the gait are left out.

    Args:
        gait: RATE moments a second.
    """
    places = joint_places(build, gait)
    pace = abs(gait.pose[-1, 0] - gait.pose[0, 0]) / (len(gait.pose) - 1)
    found = {}
    for side, pitch in zip(SIDES, gait.foot.T, strict=True):
        ends = np.array([-build.heel, build.toe])[:, None]
        ankle = places[f"{side}_ankle"]
        along = ankle[:, 0] + ends * np.cos(pitch) + build.ankle * np.sin(pitch)
        height = ankle[:, 1] + ends * np.sin(pitch) - build.ankle * np.cos(pitch)
        rests = (height < low) & (np.abs(np.gradient(along, axis=1)) < slow * pace)
        found[side] = _stretches(rests.any(axis=0))
    return found


def _stretches(rests: NDArray[np.bool_]) -> list[Contact]:
    on = _filled(_filled(rests, False), True)
    return [
        Contact(start / RATE, end / RATE)
        for start, end in stretches(on.tolist())
        if on[start] and start > 0 and end < len(on)
    ]


def _filled(on: NDArray[np.bool_], level: bool) -> NDArray[np.bool_]:
    """Without the short stretches of this level."""
    kept = on.copy()
    for start, end in stretches(on.tolist()):
        if on[start] == level and end - start < GAP * RATE and start > 0 and end < len(on):
            kept[start:end] = not level
    return kept
