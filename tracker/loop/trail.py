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
        room = min(max(foreseen, ROOM), MOST)
        self._columns: dict[str, NDArray[Any]] = {
            "mean": np.empty((room, freedoms)),
            "cov": np.empty((room, freedoms, freedoms), np.float32),
            "s": np.empty(room, np.intp),
            "moved": np.empty((room, 3)),
            "misfit": np.empty(room),
        }
        self.outcome: list[Outcome] = []

    def __len__(self) -> int:
        return len(self.outcome)

    def column(self, name: str) -> NDArray[Any]:
        """A column over all frames: mean (T, D), cov (T, D, D), s (T,), moved (T, 3) or misfit (T,)."""
        return self._columns[name][: len(self)]

    def append(self, estimate: Estimate) -> None:
        """Append the estimate of one further frame."""
        t = len(self)
        if t == len(self._columns["s"]):
            self._make_room()
        pose = estimate.pose
        row = (pose.mean, pose.cov, estimate.s, estimate.moved, estimate.misfit)
        for column, value in zip(self._columns.values(), row, strict=True):
            column[t] = value
        self.outcome.append(estimate.outcome)

    def pop(self, frames: int) -> list[Estimate]:
        """Remove and return the last frames."""
        first = len(self) - frames
        found = [self._row(t) for t in range(first, len(self))]
        del self.outcome[first:]
        return found

    def extend(self, estimates: Iterable[Estimate]) -> None:
        """Append the estimates of several further frames."""
        for estimate in estimates:
            self.append(estimate)

    def reverse(self) -> None:
        """Reverse the order of the frames in place."""
        for column in self._columns.values():
            rows = column[: len(self)]
            rows[:] = rows[::-1]
        self.outcome.reverse()

    def _make_room(self) -> None:
        for name, column in self._columns.items():
            longer = np.empty((2 * len(column), *column.shape[1:]), column.dtype)
            longer[: len(column)] = column
            self._columns[name] = longer

    def _row(self, t: int) -> Estimate:
        mean, cov, s, moved, misfit = (column[t].copy() for column in self._columns.values())
        return Estimate(
            Gaussian(mean, cov.astype(np.float64)), int(s), self.outcome[t], NOTHING, moved, float(misfit)
        )
