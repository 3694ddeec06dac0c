"""Sequences to learn from: whether they can be, and gaps filled where a first guess needs every pose."""

from collections.abc import Sequence

import numpy as np

from dynamics.gaussian import Array


def check_sequences(ys: Sequence[Array], names: Sequence[str], least: int) -> None:
    """ValueError unless there are sequences (T, M) of `least` frames that measured every freedom named."""
    if not len(ys):
        raise ValueError("learning needs at least one sequence; got none")
    for n, y in enumerate(ys):
        if y.ndim != 2 or y.shape[1] != len(names) or len(y) < least:
            raise ValueError(f"sequence {n} must be (T, {len(names)}) with T >= {least}; got {y.shape}")
    never = np.isnan(np.concatenate(ys)).all(0)
    if never.any():
        raise ValueError(f"freedom {names[int(never.argmax())]!r} was never measured; leave it out")


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
