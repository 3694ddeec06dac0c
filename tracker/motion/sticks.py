"""Poses as sticks: where the walker's links lie, on a ground that its feet touch."""

import numpy as np

from dynamics.gaussian import Array
from kinematics.figure_file import WALKER
from kinematics.mocap import POSE_COLUMNS
from kinematics.spm import skeleton
from videos.overlay import FAR, NEAR, TRUNK, as_hex

GROUND_SECONDS = 0.6  # a foot touches the ground at least once in twice this time
SHADES = {0: FAR, 1: TRUNK, 2: NEAR}  # of each layer


SIDES = {"near": as_hex(NEAR), "far": as_hex(FAR)}


def sticks(y: Array, fps: float) -> Array:
    """(T, L, 2, 2) start and end of each link of poses (T, 8) in body units, leg lengths, x forward and y
    over the ground.

    A pose's height is relative and a model lets it drift, so the ground is where the lower ankle was lowest
    within GROUND_SECONDS; where the root was not measured it stands still.
    """
    q = np.zeros((len(y), len(WALKER.freedoms)))  # which begin with the columns of a pose table
    q[:, : len(POSE_COLUMNS)] = y
    q[:, :2] = np.nan_to_num(y[:, :2])
    bones = skeleton(WALKER, q)
    ends = np.stack([bones.start, bones.tip], axis=2)
    ends[..., 1] -= _ground(ends[..., 1].min(axis=(1, 2)), max(1, round(GROUND_SECONDS * fps)))[:, None, None]
    return ends


def layers() -> list[int]:
    """(L,) 0 for a link of the far leg, 1 for the trunk, 2 for the near leg."""
    return [link.layer for link in WALKER.links]


def _ground(lowest: Array, reach: int) -> Array:
    """(T,) the running minimum of the lowest point, smoothed as much."""
    low = np.where(np.isfinite(lowest), lowest, np.inf)
    wide = np.pad(low, 2 * reach, mode="edge")
    least = np.lib.stride_tricks.sliding_window_view(wide, 2 * reach + 1).min(1)
    least = np.where(np.isfinite(least), least, 0.0)
    return np.asarray(np.convolve(least, np.full(2 * reach + 1, 1.0 / (2 * reach + 1)), "valid"))
