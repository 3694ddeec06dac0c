"""Poses as sticks: where the walker's links lie, on a ground that its feet touch."""

from functools import cache

import numpy as np

from dynamics.gaussian import Array
from kinematics.figure import Figure
from kinematics.figure_file import load_figure
from kinematics.mocap import POSE_COLUMNS
from kinematics.spm import skeleton

GROUND_SECONDS = 0.6  # a foot touches the ground at least once in twice this time


@cache
def walker() -> Figure:
    """The walking figure, whose freedoms begin with the columns of a pose table."""
    return load_figure()


def sticks(y: Array, fps: float) -> Array:
    """(T, L, 2, 2) start and end of each link, leg lengths, x forward and y over the ground.

    A pose's height is relative and a model lets it drift, so the ground is where the lower ankle was lowest
    within GROUND_SECONDS; where the root was not measured it stands still.

    Args:
        y: (T, 8) poses in body units.
        fps: frames a second.
    """
    figure = walker()
    rest = np.zeros(len(figure.freedoms) - len(POSE_COLUMNS))
    placed = y.copy()
    placed[:, :2] = np.nan_to_num(y[:, :2])
    bones = [skeleton(figure, np.concatenate([q, rest])) for q in placed]
    ends = np.stack([np.stack([b.start, b.tip], axis=1) for b in bones])
    ends[..., 1] -= _ground(ends[..., 1].min(axis=(1, 2)), max(1, round(GROUND_SECONDS * fps)))[:, None, None]
    return ends


def layers() -> list[int]:
    """(L,) 0 for a link of the far leg, 1 for the trunk, 2 for the near leg."""
    return [link.layer for link in walker().links]


def _ground(lowest: Array, reach: int) -> Array:
    """(T,) the running minimum of the lowest point, smoothed as much."""
    low = np.where(np.isfinite(lowest), lowest, np.inf)
    wide = np.pad(low, 2 * reach, mode="edge")
    least = np.lib.stride_tricks.sliding_window_view(wide, 2 * reach + 1).min(1)
    least = np.where(np.isfinite(least), least, 0.0)
    return np.asarray(np.convolve(least, np.full(2 * reach + 1, 1.0 / (2 * reach + 1)), "valid"))
