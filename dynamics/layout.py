"""The entries of a system's state and their meaning.

    x_t = [q_t, q_{t-1}, z_t]

q_t is the pose, q_{t-1} the pose before, which only a second-order state holds, and z_t are freedoms that
drift independently, which a state holds once. The dynamics must not depend on where the figure stands:
freedoms that travel enter them by their change (second order) or not at all (first order).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dynamics.gaussian import Array, Flags


def among(names: Iterable[str], chosen: Iterable[str]) -> Flags:
    """Whether each of the names is one of the chosen."""
    wanted = set(chosen)
    return np.array([name in wanted for name in names], dtype=bool)


@dataclass(frozen=True)
class Layout:
    """The layout of a state of N entries.

    names      : (d,) freedoms of the pose
    travelling : those of them that enter the dynamics by their change only
    order      : how many poses the state holds, 1 or 2
    drifts     : (n,) freedoms that drift independently of the pose
    """

    names: tuple[str, ...]
    travelling: tuple[str, ...] = ()
    order: int = 1
    drifts: tuple[str, ...] = ()

    @property
    def d(self) -> int:
        """How many freedoms a pose has."""
        return len(self.names)

    @property
    def N(self) -> int:  # noqa: N802
        """How many entries the state has."""
        return self.order * self.d + len(self.drifts)

    @cached_property
    def travels(self) -> Flags:
        """(d,) whether each freedom of the pose travels."""
        return among(self.names, self.travelling)

    @cached_property
    def pose(self) -> Array:
        """(d, N) matrix that takes a state to its pose."""
        return np.eye(self.d, self.N)

    @cached_property
    def before(self) -> Array:
        """(d, N) matrix that takes a second-order state to the pose before."""
        return np.eye(self.d, self.N, k=self.d)

    @cached_property
    def carry(self) -> Array:
        """(d, N) matrix that carries the places of the freedoms that travel over to the next pose."""
        return self.pose * self.travels[:, None]

    @cached_property
    def regard(self) -> Array:
        """(N', N) matrix from a state to the entries that the dynamics depend on: all but the place."""
        stays = ~self.travels
        if self.order == 1:
            return np.asarray(self.pose[stays])
        velocity = (self.pose - self.before)[self.travels]
        return np.vstack([self.pose[stays], self.before[stays], velocity])

    @cached_property
    def steady(self) -> Array:
        """(d, N' + 1) constant velocity: coefficients of the entries of `regard`, and the offset."""
        each, offset = np.eye(self.d), np.zeros((self.d, 1))
        stays, moves = each[:, ~self.travels], each[:, self.travels]
        return np.hstack([stays, offset] if self.order == 1 else [2.0 * stays, -stays, moves, offset])

    @cached_property
    def from_here(self) -> Array:
        """(N, N) matrix that subtracts the figure's present place from all poses of a state."""
        return np.asarray(np.eye(self.N) - self.shift[:, : self.d] @ self.carry)

    @cached_property
    def shift(self) -> Array:
        """(N, d + n) matrix from a common shift of all poses and of the drifts to the change of the state."""
        d, n = self.d, len(self.drifts)
        return np.vstack([*[np.eye(d, d + n)] * self.order, np.eye(n, d + n, k=d)])

    @cached_property
    def turned(self) -> Array:
        """(N, 2N) matrix that takes [x_t, x_{t+1}] to the state at t with time running back.

        In a second-order state the pose after then stands where the pose before was.
        """
        matrix = np.eye(self.N, 2 * self.N)
        if self.order == 2:
            matrix[self.d : 2 * self.d] = np.eye(self.d, 2 * self.N, k=self.N)
        return matrix
