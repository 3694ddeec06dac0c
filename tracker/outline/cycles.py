"""Mean gait cycles: the angles of a stride, for a dozen kinds of gait and two rare ones.

Every cycle is symmetric: half a stride later it is the same with the legs exchanged.
`tests.benchmarks.gait.cycles` makes the shipped ones.
"""

from dataclasses import dataclass, replace
from importlib import resources
from typing import Self

import numpy as np

from kinematics.figure import Array, Figure, Flags

COLUMNS = ("torso", "neck", "hip_near", "knee_near", "hip_far", "knee_far", "ankle_near", "ankle_far")
TRUNK, NECK = COLUMNS.index("torso"), COLUMNS.index("neck")
COUNTED = [0, 2, 3, 4, 5]  # columns by which kinds of stride differ
PHASES = 40
UPRIGHT = np.zeros(1)  # leans, radians


@dataclass(frozen=True)
class Cycles:
    """Kinds of stride.

    pose : (C, PHASES, 8) angles, radians, of COLUMNS; at phase 0 the near thigh is farthest ahead
    runs : (C,) share of running strides in each kind
    rare : (C,) kinds of which captures show hardly any
    """

    pose: Array
    runs: Array
    rare: Flags

    @classmethod
    def load(cls) -> Self:
        """The shipped mean gait cycles."""
        source = resources.files("tracker.outline") / "cycles.npz"
        with resources.as_file(source) as file, np.load(file) as stored:
            return cls(stored["pose"].astype(np.float64), stored["runs"], stored["rare"])

    @property
    def usual(self) -> Self:
        """The kinds that are not rare."""
        own = ~self.rare
        return replace(self, pose=self.pose[own], runs=self.runs[own], rare=self.rare[own])

    def gait(self, cycle: int) -> str:
        """The gait of a kind of stride, "walk" or "run"."""
        return "run" if self.runs[cycle] > 0.5 else "walk"

    def halves(self, neck: float, every: int = 1, leans: Array = UPRIGHT) -> Array:
        """(n, C, P, 8) angles of the first half of every cycle, at each `every`-th phase.

        `neck` is the neck's angle, `leans` (n,) are added to the trunk's, radians.
        """
        angles = np.tile(self.pose[:, : PHASES // 2 : every], (len(leans), 1, 1, 1))
        angles[..., TRUNK] += leans[:, None, None]
        angles[..., NECK] = neck
        return angles


def at_phases(values: Array, phase: Array) -> Array:
    """(..., n) values (PHASES, n) interpolated at phases (...), which are cyclic."""
    low = np.floor(phase).astype(int)
    share = (phase - low)[..., None]
    return np.asarray((1.0 - share) * values[low % PHASES] + share * values[(low + 1) % PHASES])


def columns_of(figure: Figure) -> list[int]:
    """Positions in a pose of the angles in COLUMNS."""
    return [figure.index(name) for name in COLUMNS]


def poses(figure: Figure, angles: Array) -> Array:
    """(..., D) poses with angles (..., 8), the root at the origin and no stretch."""
    q = np.zeros((*angles.shape[:-1], len(figure.freedoms)))
    q[..., columns_of(figure)] = angles
    return q
