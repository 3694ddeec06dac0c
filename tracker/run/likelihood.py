"""How likely a joint lies near where it is said: the one number that other programs keep of a covariance."""

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array

WITHIN = 0.1  # leg lengths: what near is


def likelihood(covs: Array, leg: float, measured: NDArray[np.bool_]) -> Array:
    """(T, J) how likely joints lie within r = 0.1 leg lengths of where they are said: 1 - exp(-r^2 / tr S).

    For a round covariance S that is the probability. Where the picture did not say it is 0.

    Args:
        covs: (T, J, 2, 2) px^2; NaN where the figure was not followed.
        leg: pixels in a leg length.
        measured: (T,) whether the picture said where the figure is.
    """
    far = (WITHIN * leg) ** 2 / np.maximum(np.trace(covs, axis1=2, axis2=3), 1e-9)
    return np.where(measured[:, None] & np.isfinite(far), -np.expm1(-far), 0.0)
