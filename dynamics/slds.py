"""The switching linear dynamic system: parameters, checks, and constant velocity with one state.

Pavlović et al. (1999), section 2, with an affine offset:

    Pr(s_t = j | s_{t-1} = i) = Pi[i, j]
    x_t = A[s_t] x_{t-1} + b[s_t] + v_t,   v_t ~ N(0, Q[s_t])
    y_t = C x_t + w_t,                     w_t ~ N(0, R)

`dynamics.layout` describes the state x; at second order only the pose's block of Q is not zero.
Poses are in body units: leg lengths and radians.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from dynamics.chain import CROSSING, blocks, check_chain, joined
from dynamics.gaussian import Array, Flags, Gaussian, frozen
from dynamics.layout import Layout, among


@dataclass(frozen=True)
class SLDS:
    """pi0 (K,), Pi (K,K), A (K,N,N), b (K,N), Q (K,N,N), C (M,N), R (M,M), mean0 (K,N), cov0 (K,N,N).

    names      : the M measured freedoms
    travelling : those of them that enter the dynamics by their change only
    labels     : (K,) which motion each switching state belongs to
    fps        : frames a second, one step each
    drifts     : freedoms, measured or not, that the state holds behind the poses
    """

    pi0: Array
    Pi: Array
    A: Array
    b: Array
    Q: Array
    C: Array
    R: Array
    mean0: Array
    cov0: Array
    names: tuple[str, ...]
    travelling: tuple[str, ...]
    labels: tuple[str, ...]
    fps: float
    drifts: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        K, N = np.shape(self.b)
        M = len(self.names)
        shapes = {"pi0": (K,), "Pi": (K, K), "A": (K, N, N), "b": (K, N), "Q": (K, N, N), "C": (M, N)}
        shapes |= {"R": (M, M), "mean0": (K, N), "cov0": (K, N, N)}
        for name, shape in shapes.items():
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape))
        check_chain(self.pi0, self.Pi, self.labels, self.fps)
        if not set(self.travelling) <= set(self.names):
            raise ValueError(f"travelling freedoms must be among {self.names}; got {self.travelling}")
        if self.layout.N != N or self.order not in (1, 2):
            raise ValueError(
                f"the state must hold 1 or 2 poses of {self.layout.d} freedoms and "
                f"{len(self.drifts)} that drift; it has {N} entries"
            )

    @property
    def K(self) -> int:  # noqa: N802
        """Number of switching states."""
        return len(self.labels)

    @cached_property
    def layout(self) -> Layout:
        pose = tuple(name for name in self.names if name not in self.drifts)
        order = (self.A.shape[-1] - len(self.drifts)) // len(pose)
        return Layout(pose, self.travelling, order, self.drifts)

    @property
    def shift(self) -> Array:
        """(N, M) matrix from a common shift of its poses and the measured drifts to the change of a state."""
        return self.layout.shift[:, among((*self.layout.names, *self.drifts), self.names)]

    @property
    def order(self) -> int:
        """How many poses the state holds, 1 or 2."""
        return self.layout.order

    @property
    def travels(self) -> Flags:
        """(M,) whether each measured freedom travels."""
        return among(self.names, self.travelling)

    @property
    def log_Pi(self) -> Array:  # noqa: N802
        """(K, K) log Pi, -inf for impossible transitions."""
        with np.errstate(divide="ignore"):
            return np.log(self.Pi, order="C")  # for another memory order numba compiles the filters again

    @property
    def log_pi0(self) -> Array:
        """(K,) log probability of each state in the first frame."""
        with np.errstate(divide="ignore"):
            return np.log(self.pi0)

    @property
    def start(self) -> Gaussian:
        """The first frame's belief, one Gaussian a switching state."""
        return Gaussian(self.mean0, self.cov0)

    def with_drifts(self, names: Sequence[str], persistence: Array, noise: Array, spread: Array) -> Self:
        """The same system with further, independently drifting freedoms appended to state and measurement.

        Each follows z_t = persistence z_{t-1} + N(0, noise^2) about zero and starts at N(0, spread^2),
        whatever the switching state.
        """
        n = len(names)
        K, N = self.b.shape

        def widened(each: Array, drift: Array) -> Array:
            wide = np.zeros((K, N + n, N + n))
            wide[:, :N, :N], wide[:, N:, N:] = each, np.diag(drift)
            return wide

        C = np.zeros((len(self.C) + n, N + n))
        C[: len(self.C), :N], C[len(self.C) :, N:] = self.C, np.eye(n)
        R = np.diag(np.full(len(C), self.R.diagonal().min()))
        R[: len(self.C), : len(self.C)] = self.R
        pad = (0, 0), (0, n)
        return replace(
            self,
            A=widened(self.A, persistence),
            b=np.pad(self.b, pad),
            Q=widened(self.Q, noise**2),
            C=C,
            R=R,
            mean0=np.pad(self.mean0, pad),
            cov0=widened(self.cov0, spread**2),
            names=(*self.names, *names),
            drifts=(*self.drifts, *names),
        )

    def with_constants(self, spreads: Mapping[str, float]) -> Self:
        """The same system with an unknown constant of this deviation added to each named measurement."""
        n, names = len(spreads), [f"constant_{name}" for name in spreads]
        wide = self.with_drifts(names, np.ones(n), np.zeros(n), np.array(list(spreads.values())))
        C = wide.C[: len(self.C)].copy()
        for i, name in enumerate(spreads):
            C[self.names.index(name), i - n] = 1.0
        return replace(wide, C=C, R=self.R, names=self.names)


def constant_velocity(names: Sequence[str], noise: Array, spread: Array, fps: float) -> SLDS:
    """A one-state second-order model that carries each freedom on as it moved: the papers' baseline.

    Standard deviations (M,): `noise` of the change of velocity a frame, `spread` of the first velocity.
    """
    M = len(names)
    eye, zero = np.eye(M), np.zeros((M, M))
    fast = np.diag(np.asarray(spread, dtype=float) ** 2)
    return SLDS(
        pi0=np.ones(1),
        Pi=np.ones((1, 1)),
        A=np.block([[2.0 * eye, -eye], [eye, zero]])[None],
        b=np.zeros((1, 2 * M)),
        Q=np.block([[np.diag(np.asarray(noise, dtype=float) ** 2), zero], [zero, zero]])[None],
        C=np.hstack([eye, zero]),
        R=1e-4 * eye,
        mean0=np.zeros((1, 2 * M)),
        cov0=np.block([[eye, eye], [eye, eye + fast]])[None],
        names=tuple(names),
        travelling=(),
        labels=("cv",),
        fps=fps,
    )


def combine(models: Sequence[SLDS], crossing: float = CROSSING, first: Sequence[float] | None = None) -> SLDS:
    """Models of several motions as one; ValueError if their freedoms, orders or rates differ.

    A state leaves its own motion with probability `crossing` a frame, with equal odds to any state of others.
    `first` are the motions' probabilities in the first frame, None for equal ones. R is the models' mean.
    """
    one = models[0]
    if len({(model.names, model.order, model.fps, model.travelling) for model in models}) > 1:
        raise ValueError("models to combine must share freedoms, order and frame rate; learn them alike")
    if len(models) == 1:
        return one
    shares = [1.0 / len(models)] * len(models) if first is None else first
    return replace(
        one,
        **joined(models, ("A", "b", "Q", "mean0", "cov0")),
        pi0=np.concatenate([share * model.pi0 for share, model in zip(shares, models, strict=True)]),
        Pi=blocks([model.Pi for model in models], crossing),
        R=np.mean([model.R for model in models], axis=0),
    )
