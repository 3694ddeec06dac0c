"""Whether a figure goes backwards, against its facing, or back where it came from: as its root shows.

One that stays in place, or drifts as slowly as on a treadmill, is taken to go forwards.
"""

import numpy as np
from numpy.typing import NDArray

BACKWARDS = -0.5  # travel below which a figure goes backwards, leg lengths,
DRIFT = -0.1  # if it is not as slow as a drift on a treadmill, leg lengths a second
THERE_AND_BACK = 1.0  # travel before and after a turn, leg lengths, if it is not as slow as that either


def gone_back(x: NDArray[np.float64], t: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(T,) whether the root has gone backwards since it was first measured, as known at each frame.

    At x (T,) leg lengths the way the figure faces, NaN where not measured, and t (T,) seconds.
    """
    rows = np.maximum.accumulate(np.where(np.isfinite(x), np.arange(len(x)), 0))
    first = np.isfinite(x).argmax()
    travel = x[rows] - x[first]
    return np.asarray(travel < np.minimum(BACKWARDS, DRIFT * (t - t[first])))


def turning(x: NDArray[np.float64], t: NDArray[np.float64]) -> int | None:
    """The row of the farthest turn, before and after which the root goes opposite ways; None without a turn.

    At x (T,) leg lengths, NaN where not measured, and t (T,) seconds.
    """
    rows = np.flatnonzero(np.isfinite(x))
    best, found = THERE_AND_BACK, None
    for way in (x[rows], -x[rows]) if len(rows) else ():
        before, after = (np.minimum.accumulate(way[::step])[::step] for step in (1, -1))
        k = int((way - np.maximum(before, after)).argmax())
        ends = way[: k + 1].argmin(), k + way[k:].argmin()
        far, slow = way[k] - way[[*ends]], -DRIFT * np.abs(t[rows[[*ends]]] - t[rows[k]])
        if far.min() > best and (far > slow).all():
            best, found = float(far.min()), int(rows[k])
    return found
