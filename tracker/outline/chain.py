"""A Gaussian chain for every freedom: each value of a path is near 0 and near the value before.

The precision of a path (T,) is tridiagonal, and so its upper Cholesky factor U has a diagonal and one
off-diagonal. With U d = z the prior of d is the unit Gaussian of z.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from kinematics.figure import Array
from tracker.compiled import compiled


@dataclass(frozen=True)
class Chain:
    """The factors U of all freedoms.

    diagonal : (T, D)
    above    : (T, D) the off-diagonal; row t is U[t - 1, t], the first is 0
    """

    diagonal: Array
    above: Array

    @classmethod
    def of(cls, T: int, spread: Array, change: Array) -> Self:
        """The chains of T frames; standard deviations (D,) of values about 0 and of their change a frame."""
        sides = np.full((T, 1), 2.0)
        sides[[0, -1]] -= 1.0
        diagonal = 1.0 / spread**2 + sides * (T > 1) / change**2
        above = np.zeros_like(diagonal)
        diagonal[0] = np.sqrt(diagonal[0])
        for t in range(1, T):
            above[t] = -1.0 / change**2 / diagonal[t - 1]
            diagonal[t] = np.sqrt(diagonal[t] - above[t] ** 2)
        return cls(diagonal, above)

    def paths(self, z: Array) -> Array:
        """(T, D): d with U d = z."""
        return np.asarray(_back(self.diagonal, self.above, z))

    def slopes(self, slope: Array) -> Array:
        """(T, D): a derivative by d converted to one by z."""
        return np.asarray(_ahead(self.diagonal, self.above, slope))


@compiled()
def _back(diagonal: Array, above: Array, z: Array) -> Array:
    T, D = z.shape
    d = np.empty((T, D))
    for k in range(D):
        d[T - 1, k] = z[T - 1, k] / diagonal[T - 1, k]
    for t in range(T - 2, -1, -1):
        for k in range(D):
            d[t, k] = (z[t, k] - above[t + 1, k] * d[t + 1, k]) / diagonal[t, k]
    return d


@compiled()
def _ahead(diagonal: Array, above: Array, slope: Array) -> Array:
    T, D = slope.shape
    found = np.empty((T, D))
    for k in range(D):
        found[0, k] = slope[0, k] / diagonal[0, k]
    for t in range(1, T):
        for k in range(D):
            found[t, k] = (slope[t, k] - above[t, k] * found[t - 1, k]) / diagonal[t, k]
    return found
