"""Slower and smaller copies of a motion: people who are seldom captured move like that.

Who jogs slowly takes more time for a stride and bends less than who runs, and captures of slow jogs are few.
A copy is the sequence played slower, its angles drawn towards their mean. Which copies, was chosen by leaving
people out: by a model of the captures that may ship (runs at 2.6 to 3.5 m/s) on joggers that may not.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from dynamics.gaussian import Array
from kinematics.figure import ROOT

COPIES = ((0.85, 1.0), (0.85, 0.8), (1.0, 0.8))  # speed, size


def slower(y: Array) -> list[Array]:
    """The COPIES of poses (T, 8), T >= 4, in body units."""
    return [_copy(y, speed, size) for speed, size in COPIES]


def _copy(y: Array, speed: float, size: float) -> Array:
    """Played at `speed`, the angles' distance from their mean and the root's travel times `size`."""
    t = np.arange(len(y))
    played: Array = CubicSpline(t, y)(np.arange(0.0, t[-1] + 1e-9, speed))
    centre: Array = played.mean(0)
    centre[: len(ROOT)] = 0.0, centre[1]
    return np.asarray(centre + size * (played - centre))
