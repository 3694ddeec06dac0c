"""The estimates of a film stored in columns, which take half the memory of separate objects."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Gaussian
from tracker.loop.estimate import NOTHING, Estimate
from tracker.loop.outcome import Outcome

ROOM = 512  # initial capacity in frames, doubled whenever it is too small
MOST = 2**17  # largest capacity reserved in advance, as containers may announce any number of frames


class Trail:
    """Estimates frame by frame, without their hypotheses; covariances in single precision.

    If their number is known in advance, unused memory is never touched, and growing copies nothing.

    outcome : of every frame
    """

    def __init__(self, freedoms: int, foreseen: int = ROOM) -> None:
        numbers = [("mean", float, freedoms), ("s", np.intp), ("moved", float, 3), ("misfit", float)]
        row = np.dtype([*numbers, ("cov", np.float32, (freedoms, freedoms))])
        self._rows: NDArray[Any] = np.empty(min(max(foreseen, ROOM), MOST), row)
        self.outcome: list[Outcome] = []

    def __len__(self) -> int:
        return len(self.outcome)

    def column(self, name: str) -> NDArray[Any]:
        """A column over all frames: mean (T, D), cov (T, D, D), s (T,), moved (T, 3) or misfit (T,)."""
        return self._rows[name][: len(self)]

    def append(self, estimate: Estimate) -> None:
        """Append the estimate of one further frame."""
        t, pose = len(self), estimate.pose
        if t == len(self._rows):
            longer = np.empty(2 * t, self._rows.dtype)
            longer[:t] = self._rows
            self._rows = longer
        self._rows[t] = pose.mean, estimate.s, estimate.moved, estimate.misfit, pose.cov
        self.outcome.append(estimate.outcome)

    def pop(self, frames: int) -> list[Estimate]:
        """Remove and return the last frames."""
        first, found = len(self) - frames, []
        for (mean, s, moved, misfit, cov), outcome in zip(
            self._rows[first : len(self)].copy(), self.outcome[first:], strict=True
        ):
            pose = Gaussian(mean, cov.astype(np.float64))
            found.append(Estimate(pose, int(s), outcome, NOTHING, moved, float(misfit)))
        del self.outcome[first:]
        return found

    def extend(self, estimates: Iterable[Estimate]) -> None:
        """Append the estimates of several further frames."""
        for estimate in estimates:
            self.append(estimate)

    def reverse(self) -> None:
        """Reverse the order of the frames in place."""
        rows = self._rows[: len(self)]
        rows[:] = rows[::-1].copy()
        self.outcome.reverse()
