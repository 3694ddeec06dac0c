"""Mean gait cycles: what a stride looks like from the side, a dozen kinds of it.

Every cycle is symmetric: half a stride later it is the same with the legs exchanged.
`tests.benchmarks.gait.cycles` makes those that ship.
"""

from dataclasses import dataclass
from importlib import resources
from typing import Self

import numpy as np

from kinematics.figure import Array, Figure

COLUMNS = ("torso", "neck", "hip_near", "knee_near", "hip_far", "knee_far", "ankle_near", "ankle_far")
TRUNK, NECK = COLUMNS.index("torso"), COLUMNS.index("neck")
COUNTED = [0, 2, 3, 4, 5]  # columns that tell kinds of stride apart
PHASES = 40
UPRIGHT = np.zeros(1)  # leans, radians


@dataclass(frozen=True)
class Cycles:
    """A few kinds of stride.

    pose : (C, PHASES, 8) angles, radians, of COLUMNS; at phase 0 the near thigh is farthest ahead
    runs : (C,) share of running strides in it
    """

    pose: Array
    runs: Array

    @classmethod
    def load(cls) -> Self:
        """The mean gait cycles that ship with the program."""
        source = resources.files("tracker.outline") / "cycles.npz"
        with resources.as_file(source) as file, np.load(file) as stored:
            return cls(stored["pose"].astype(np.float64), stored["runs"])

    def gait(self, cycle: int) -> str:
        """What a kind of stride is called."""
        return "run" if self.runs[cycle] > 0.5 else "walk"

    def halves(self, neck: float, every: int = 1, leans: Array = UPRIGHT) -> Array:
        """(n, C, P, 8) angles of the first half of every cycle, its trunk leaning further forward.

        Args:
            neck: an angle of its own, radians.
            every: so manieth phase.
            leans: (n,) radians added to the trunk's.
        """
        angles = np.tile(self.pose[:, : PHASES // 2 : every], (len(leans), 1, 1, 1))
        angles[..., TRUNK] += leans[:, None, None]
        angles[..., NECK] = neck
        return angles


def at_phases(values: Array, phase: Array) -> Array:
    """(..., n) of values (PHASES, n) those at phases (...), which may lie between two and go round."""
    low = np.floor(phase).astype(int)
    share = (phase - low)[..., None]
    return np.asarray((1.0 - share) * values[low % PHASES] + share * values[(low + 1) % PHASES])


def columns_of(figure: Figure) -> list[int]:
    """Where a pose holds the angles of COLUMNS."""
    return [figure.index(name) for name in COLUMNS]


def poses(figure: Figure, angles: Array) -> Array:
    """(..., D) poses with the root at the origin and nothing stretched, of angles (..., 8)."""
    q = np.zeros((*angles.shape[:-1], len(figure.freedoms)))
    q[..., columns_of(figure)] = angles
    return q
