"""Copies of a motion as it is seldom captured: slower and smaller, and begun from a stand.

Who jogs slowly takes more time for a stride and bends less than who runs, and captures of slow jogs are few.
A slower copy is the sequence played slower, its angles drawn towards their mean. Which copies, was chosen by
leaving people out: by a model of the captures that may ship (runs at 2.6 to 3.5 m/s) on joggers that may not.

Captures of runs begin at speed. Without a stand of its own, each stand and first step before a run is called
a walk. In a started copy the size of the motion and its speed rise together from 0 to 1.
"""

from collections.abc import Collection, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from dynamics.gaussian import Array
from kinematics.figure import ROOT
from kinematics.mocap import POSE_COLUMNS

Labelled = tuple[str, str, Array]

COPIES = ((0.85, 1.0), (0.85, 0.8), (1.0, 0.8))  # speed, size
# Degrees, as captured.
STAND = {"torso": 0.0, "hip_near": 6.0, "hip_far": 6.0, "knee_near": 20.0, "knee_far": 20.0}
STILL, RISE = 0.4, 0.6  # seconds of a stand, and until the motion is its own


def with_copies(
    sequences: Sequence[Labelled], slower_too: Collection[str], started_too: Collection[str], fps: float
) -> list[Labelled]:
    """(subject, label, poses) each, those of the labels named followed by their copies, `slower` or
    `started`.

    Poses are (T, M), T >= 4, of POSE_COLUMNS and perhaps others behind them.
    """
    found = []
    for subject, label, y in sequences:
        copies = slower(y) if label in slower_too else []
        copies += [started(y, fps)] if label in started_too else []
        found += [(subject, label, copy) for copy in (y, *copies)]
    return found


def slower(y: Array) -> list[Array]:
    """The COPIES of poses (T, M), T >= 4, in body units."""
    return [_copy(y, speed, size) for speed, size in COPIES]


def started(y: Array, fps: float) -> Array:
    """Poses (T, M), T >= 4, in body units, played from a stand of STILL seconds; as many as y is long for."""
    T = len(y)
    seconds = np.arange(T + round((STILL + RISE) * fps)) / fps
    risen = np.clip((seconds - STILL) / RISE, 0.0, 1.0)
    size = risen**2 * (3.0 - 2.0 * risen)
    at = np.cumsum(size) - size
    at, size = at[at <= T - 1], size[at <= T - 1]
    stand = y.mean(0)
    for name, degrees in STAND.items():
        stand[POSE_COLUMNS.index(name)] = np.radians(degrees)
    out = np.asarray(CubicSpline(np.arange(T), y)(at))
    out[:, 1:] = stand[1:] + size[:, None] * (out[:, 1:] - stand[1:])
    return out


def _copy(y: Array, speed: float, size: float) -> Array:
    """Played at `speed`, the angles' distance from their mean and the root's travel times `size`."""
    t = np.arange(len(y))
    played: Array = CubicSpline(t, y)(np.arange(0.0, t[-1] + 1e-9, speed))
    centre: Array = played.mean(0)
    centre[: len(ROOT)] = 0.0, centre[1]
    return np.asarray(centre + size * (played - centre))
