"""Joint angles over the stride: from a foot's strike, at 0 per cent, to its next, at 100.

Every stride is read at the same 101 shares of its own length, so strides of any length and frame rate lie
over each other and have a mean and a standard deviation share by share.
"""

from collections.abc import Iterable

import numpy as np

from dynamics.gaussian import Array
from tracker.gait.strides import Stride

SHARES = np.linspace(0.0, 1.0, 101)


def over_strides(angle: Array, strides: Iterable[Stride], first: int = 0) -> Array:
    """An angle over each of some strides, (S, 101), in the unit of the angle.

    Args:
        angle: (T,) by frame.
        strides: S of them, in frames of the clip, within those of the angle.
        first: frame of the clip that the angle begins with.
    """
    found = [_over(angle, stride.strike.at - first, stride.end.at - first) for stride in strides]
    return np.array(found).reshape(-1, len(SHARES))


def spread(curves: Array) -> Array | None:
    """Standard deviation (101,) of curves (S, 101); None of fewer than two."""
    return np.std(curves, axis=0, ddof=1) if len(curves) > 1 else None


def _over(angle: Array, start: float, end: float) -> Array:
    return np.interp(start + SHARES * (end - start), np.arange(len(angle)), angle)
