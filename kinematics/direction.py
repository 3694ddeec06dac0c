"""Whether a figure goes backwards: against its facing, as its root shows.

One that stays in place, or drifts as slowly as on a treadmill, is taken to go forwards.
"""

import numpy as np
from numpy.typing import NDArray

BACKWARDS = -0.5  # travel below which a figure goes backwards, leg lengths,
DRIFT = -0.1  # if it is not as slow as a drift on a treadmill, leg lengths a second


def gone_back(x: NDArray[np.float64], t: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(T,) whether the root has gone backwards since it was first measured, as known at each frame.

    At x (T,) leg lengths the way the figure faces, NaN where not measured, and t (T,) seconds.
    """
    rows = np.maximum.accumulate(np.where(np.isfinite(x), np.arange(len(x)), 0))
    first = np.isfinite(x).argmax()
    travel = x[rows] - x[first]
    return np.asarray(travel < np.minimum(BACKWARDS, DRIFT * (t - t[first])))
