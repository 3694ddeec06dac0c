"""The harmonic stride: a periodic gait as harmonics of a phase, with coefficients that differ between people.

    y_t = B(phi_t) c + s t + r_t + w_t,              w_t ~ N(0, R)
    phi_t = phi_0 + omega t + bend u t^2 + d_t,      u ~ N(0, 1)

B(phi) = [1, cos phi, sin phi, cos 2 phi, ..]. Coefficients c, phase speed omega and travel s of one stretch
of gait are Gaussian over the population. The residual r is a sum of two Matern processes with a covariance
over the freedoms each; the drift d of the phase, less the parabola that fits it best, is another. Time is
in seconds, so that a model serves every frame rate.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynamics.chain import joined
from dynamics.gaussian import Array, Flags, Ints, frozen
from dynamics.layout import among

QUICK, SLOW = 0.1, 0.4  # time scales of the residual, seconds
DRIFTING = 4.0  # time scale of the drift of the phase, seconds


@dataclass(frozen=True)
class Stride:
    """K motions of M freedoms, Z = M (2 H + 1) + 1 + n numbers a stretch of gait: c, omega, travel.

    mean   : (K, Z) c freedom after freedom (body units), omega (radians a second), travel (units a second)
    root   : (K, Z, Z) lower Cholesky factor of their covariance
    quick  : (K, M, M) covariance of the residual that changes within QUICK seconds
    slow   : (K, M, M) of the one that changes within SLOW seconds
    R      : (K, M, M) covariance of the measurement noise
    bend   : (K,) deviation of the change of speed, radians a second a second
    drift  : (K,) deviation of the phase's drift, radians
    names  : the M freedoms; `travelling` the n of them whose place does not matter
    labels : (K,) the motions
    fps    : frames a second of the captures it was learned from
    """

    mean: Array
    root: Array
    quick: Array
    slow: Array
    R: Array
    bend: Array
    drift: Array
    names: tuple[str, ...]
    travelling: tuple[str, ...]
    labels: tuple[str, ...]
    fps: float

    def __post_init__(self) -> None:
        K, M, Z = len(self.labels), len(self.names), np.shape(self.mean)[-1]
        shapes = {"mean": (K, Z), "root": (K, Z, Z), "bend": (K,), "drift": (K,)}
        shapes |= dict.fromkeys(("quick", "slow", "R"), (K, M, M))
        for name, shape in shapes.items():
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape))
        if K < 1 or M * self.basis + 1 + len(self.travelling) != Z or self.basis < 3 or not self.basis % 2:
            raise ValueError(f"mean has {Z} numbers a motion, which {M} freedoms have not for any harmonics")
        if not set(self.travelling) <= set(self.names):
            raise ValueError(f"travelling must be among {', '.join(self.names)}; got {self.travelling}")
        if (self.root != np.tril(self.root)).any() or (np.diagonal(self.root, 0, 1, 2) <= 0).any():
            raise ValueError("root must be lower triangular with a positive diagonal")
        for name in ("bend", "drift"):
            if not (getattr(self, name) > 0).all():
                raise ValueError(f"{name} must be positive; got {getattr(self, name)}")
        if not self.fps > 0:
            raise ValueError(f"fps must be positive; got {self.fps}")

    @property
    def basis(self) -> int:
        """2 H + 1, the numbers that describe one freedom over a stride."""
        return int(self.mean.shape[-1] - 1 - len(self.travelling)) // len(self.names)

    @property
    def travels(self) -> Flags:
        """(M,) whether each freedom travels."""
        return among(self.names, self.travelling)


def combine_strides(strides: Sequence[Stride]) -> Stride:
    """One model of the motions of several models of the same freedoms, all equally probable."""
    return replace(strides[0], **joined(strides, ("mean", "root", "quick", "slow", "R", "bend", "drift")))


def harmonics(phase: Array, size: int) -> Array:
    """(..., size) B of phases (...,) in radians; size = 2 H + 1."""
    order = np.arange(1, size // 2 + 1)
    out = np.ones((*np.shape(phase), size))
    out[..., 1::2] = np.cos(phase[..., None] * order)
    out[..., 2::2] = np.sin(phase[..., None] * order)
    return out


def slopes(phase: Array, size: int) -> Array:
    """(..., size) derivative of the basis by the phase, dB/dphi."""
    order = np.arange(1, size // 2 + 1)
    out = np.zeros((*np.shape(phase), size))
    out[..., 1::2] = -order * np.sin(phase[..., None] * order)
    out[..., 2::2] = order * np.cos(phase[..., None] * order)
    return out


def orders(size: int) -> Ints:
    """(size,) which harmonic each entry of the basis is, 0 the constant."""
    return np.asarray((np.arange(size) + 1) // 2)
