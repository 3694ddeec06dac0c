"""When the feet of a rendered figure are on the ground: the truth that strides are measured by.

The sole of a foot is a line from its heel to its toe. An end of it rests while it is lower than LOW over the
floor and goes along it at less than SLOW of the mean pace of the film. A foot is on the ground from the first
moment at which an end rests to the last; gaps shorter than GAP, in which feet of captures jitter, are closed,
and contacts as short are none. Moments are told to 1 / RATE seconds.

A moment is clear if nearby definitions agree on it to CLEAR seconds. Those that do not are of feet that slip
over the floor or jitter while they are put down or lifted: between strike and flight they have no one moment.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kinematics.sides import SIDES, Side
from tests.benchmarks.rendered.captures import RATE
from tracker.gait.moments import OFF, STRIKE
from tracker.scene.steps import Build, Gait, joint_places
from tracker.tables.poses import stretches

LOW = 0.03  # leg lengths; 2.5 cm of a grown-up
SLOW = 0.5
NEARBY = tuple((low, slow) for low in (0.02, LOW, 0.05) for slow in (0.35, SLOW, 0.7))
CLEAR = 0.02
GAP = 0.08  # seconds


@dataclass(frozen=True)
class Contact:
    """A foot on the ground, seconds of the walk, and which of its moments are clear."""

    strike: float
    off: float
    clear: tuple[str, ...] = (STRIKE, OFF)


def contacts(gait: Gait, build: Build) -> dict[Side, list[Contact]]:
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
        speed = np.abs(np.gradient(along, axis=1)) / pace
        usual, *others = (
            _stretches(((height < low) & (speed < slow)).any(axis=0)) for low, slow in ((LOW, SLOW), *NEARBY)
        )
        found[side] = [replace(one, clear=_clear(one, others)) for one in usual]
    return found


def _clear(one: Contact, others: Sequence[Sequence[Contact]]) -> tuple[str, ...]:
    """The moments of a contact that every list of contacts has."""

    def agreed(kind: str) -> bool:
        apart = [[abs(getattr(each, kind) - getattr(one, kind)) for each in found] for found in others]
        return all(min(each, default=np.inf) <= CLEAR for each in apart)

    return tuple(kind for kind in (STRIKE, OFF) if agreed(kind))


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
