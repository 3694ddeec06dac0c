"""Gaps filled by straight lines, where a first guess needs every pose."""

from collections.abc import Sequence

import numpy as np

from dynamics.gaussian import Array


def fill(ys: Sequence[Array]) -> list[Array]:
    """The sequences with NaN entries interpolated linearly and ends held.

    A freedom that a sequence never measured takes its mean over the others, or 0.
    """
    y = np.concatenate(ys)
    seen = ~np.isnan(y)
    mean = np.where(seen, y, 0.0).sum(0) / np.maximum(seen.sum(0), 1)
    return [_filled(y, mean) for y in ys]


def _filled(y: Array, mean: Array) -> Array:
    seen, filled = ~np.isnan(y), y.copy()
    t = np.arange(len(y))
    for i in np.flatnonzero(~seen.all(0)):
        at = seen[:, i]
        filled[:, i] = np.interp(t, t[at], y[at, i]) if at.any() else mean[i]
    return filled
