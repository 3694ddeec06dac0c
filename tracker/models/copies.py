"""Copies of a motion in forms that are seldom captured: slower and smaller, and starting from a stand.

People who jog slowly take more time for a stride and bend less than runners, and captures of slow jogs are
few. A slower copy is the sequence played slower, with angles drawn towards their mean. The copies were chosen
by testing a model of captures with a free licence (runs at 2.6 to 3.5 m/s) on joggers from others.

Captures of runs begin at full speed. If no run starts from a stand, stands and first steps before a run are
labelled as walks. In a started copy the amplitude and speed of the motion rise together from 0 to 1.
"""

from collections.abc import Collection, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from dynamics.gaussian import Array
from kinematics.figure import ROOT
from kinematics.mocap import POSE_COLUMNS

Labelled = tuple[str, str, Array]

COPIES = ((0.85, 1.0), (0.85, 0.8), (1.0, 0.8))  # speed, size
# The pose of a stand, degrees, as captured.
STAND = {"torso": 0.0, "hip_near": 6.0, "hip_far": 6.0, "knee_near": 20.0, "knee_far": 20.0}
STILL, RISE = 0.4, 0.6  # seconds of standing, and of the rise to the full motion


def with_copies(
    sequences: Sequence[Labelled], slower_too: Collection[str], started_too: Collection[str], fps: float
) -> list[Labelled]:
    """The sequences (subject, label, poses); those with the given labels are followed by their copies,
    `slower` or `started`.

    Poses are (T, M), T >= 4, of POSE_COLUMNS and possibly further ones.
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
    """Poses (T, M), T >= 4, in body units, starting from a stand of STILL seconds, up to the end of y."""
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
    """The poses played at `speed`, deviations of angles from their mean and the travel times `size`."""
    t = np.arange(len(y))
    played: Array = CubicSpline(t, y)(np.arange(0.0, t[-1] + 1e-9, speed))
    centre: Array = played.mean(0)
    centre[: len(ROOT)] = 0.0, centre[1]
    return np.asarray(centre + size * (played - centre))
