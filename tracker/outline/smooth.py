"""Values of frames averaged over neighbouring frames, or interpolated between frames."""

from typing import Literal

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from kinematics.figure import Array

REACH = 4.0  # standard deviations at which a Gaussian is cut off


def smooth(values: Array, spread: float) -> Array:
    """(T, ...) means weighted by a Gaussian of this spread, frames; values go on beyond the ends."""
    reach = round(REACH * spread)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / spread) ** 2)
    return sums_around(values, weights / weights.sum(), "edge")


def sums_around(values: Array, weights: Array, beyond: Literal["edge", "constant"] = "constant") -> Array:
    """(T, ...) sums of each frame's value and its neighbours' with weights (2 R + 1,), R frames before first.

    Values beyond the ends are those there ("edge") or 0 ("constant").
    """
    reach = len(weights) // 2
    padded = np.pad(values, [(reach, reach)] + [(0, 0)] * (values.ndim - 1), mode=beyond)
    return np.asarray(sliding_window_view(padded, len(weights), axis=0) @ weights)


def finer(values: Array, every: int) -> Array:
    """(every (T - 1) + 1, ...) values at `every` times the frame rate, interpolated linearly."""
    rows, between = np.divmod(np.arange(every * (len(values) - 1) + 1), every)
    share = (between / every).reshape(-1, *[1] * (values.ndim - 1))
    following = values[np.minimum(rows + 1, len(values) - 1)]
    return np.asarray(values[rows] * (1.0 - share) + following * share)
