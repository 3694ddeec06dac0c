"""Values of frames averaged over neighbouring frames, or interpolated between frames."""

import cv2
import numpy as np

from kinematics.figure import Array

REACH = 4.0  # standard deviations at which a Gaussian is cut off


def smooth(values: Array, spread: float) -> Array:
    """(T, ...) means weighted by a Gaussian of this spread, frames; values go on beyond the ends."""
    size = 2 * round(REACH * spread) + 1
    found = cv2.GaussianBlur(values, (1, size), 1.0, sigmaY=spread, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(found, dtype=np.float64).reshape(values.shape)


def finer(values: Array, every: int) -> Array:
    """(every (T - 1) + 1, ...) values at `every` times the frame rate, interpolated linearly."""
    rows, between = np.divmod(np.arange(every * (len(values) - 1) + 1), every)
    share = (between / every).reshape(-1, *[1] * (values.ndim - 1))
    following = values[np.minimum(rows + 1, len(values) - 1)]
    return np.asarray(values[rows] * (1.0 - share) + following * share)
