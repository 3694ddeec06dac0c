"""The estimates of a film in columns, which take half the memory of as many objects."""

from array import array
from collections.abc import Iterable
from typing import cast

import numpy as np

from dynamics.gaussian import Array, Gaussian
from tracker.loop.estimate import NOTHING, Estimate
from tracker.loop.outcome import Outcome


class Trail:
    """Estimates frame by frame, without their hypotheses; covariances in single precision.

    s, outcome : of every row, as `Estimate` has them
    """

    def __init__(self, freedoms: int) -> None:
        self._D = freedoms
        self._mean, self._shift, self._misfit = array("d"), array("d"), array("d")
        self._cov = array("f")
        self.s: list[int] = []
        self.outcome: list[Outcome] = []

    def __len__(self) -> int:
        return len(self.s)

    @property
    def mean(self) -> Array:
        """(T, D) of the poses; while it is held the trail does not grow."""
        return np.frombuffer(self._mean).reshape(-1, self._D)

    @property
    def cov(self) -> Array:
        """(T, D, D) of the poses; while it is held the trail does not grow."""
        return cast("Array", np.frombuffer(self._cov, np.float32).reshape(-1, self._D, self._D))

    @property
    def shift(self) -> Array:
        """(T, 2) as `State.shift`; while it is held the trail does not grow."""
        return np.frombuffer(self._shift).reshape(-1, 2)

    def append(self, estimate: Estimate) -> None:
        """One frame more."""
        self._mean.extend(estimate.pose.mean)
        self._cov.frombytes(estimate.pose.cov.astype(np.float32).tobytes())
        self._shift.extend(estimate.shift)
        self._misfit.append(estimate.misfit)
        self.s.append(estimate.s)
        self.outcome.append(estimate.outcome)

    def pop(self, frames: int) -> list[Estimate]:
        """The last frames, which are taken off."""
        first = len(self) - frames
        found = [self._row(t) for t in range(first, len(self))]
        for column, width in self._columns:
            del column[first * width :]
        del self.s[first:], self.outcome[first:]
        return found

    def extend(self, estimates: Iterable[Estimate]) -> None:
        """Frames more."""
        for estimate in estimates:
            self.append(estimate)

    def reverse(self) -> None:
        """The other way in time."""
        for column, width in self._columns:
            rows = np.frombuffer(column, column.typecode).reshape(-1, width)
            rows[:] = rows[::-1]
        self.s.reverse()
        self.outcome.reverse()

    @property
    def _columns(self) -> "list[tuple[array[float], int]]":
        """Those of numbers, each with how many a row has."""
        D = self._D
        return [(self._mean, D), (self._cov, D * D), (self._shift, 2), (self._misfit, 1)]

    def _row(self, t: int) -> Estimate:
        pose = Gaussian(self.mean[t].copy(), self.cov[t].astype(np.float64))
        return Estimate(pose, self.s[t], self.outcome[t], NOTHING, self.shift[t].copy(), self._misfit[t])
