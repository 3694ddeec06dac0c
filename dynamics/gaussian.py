"""Gaussians with any leading axes: density, collapse of a mixture; means and first values of columns."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Flags = NDArray[np.bool_]

LOG_2PI = float(np.log(2.0 * np.pi))


def frozen(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """A read-only float64 copy of `value`; ValueError unless it is finite and of this shape."""
    array = np.array(value, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}; got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite; {int((~np.isfinite(array)).sum())} entries are not")
    array.setflags(write=False)
    return array


@dataclass(frozen=True)
class Gaussian:
    """mean (..., N) and cov (..., N, N)."""

    mean: Array
    cov: Array

    def __getitem__(self, index: Any) -> "Gaussian":
        return Gaussian(self.mean[index], self.cov[index])

    def __setitem__(self, index: Any, part: "Gaussian") -> None:
        self.mean[index], self.cov[index] = part.mean, part.cov

    def through(self, C: Array, offset: Array | float = 0.0) -> "Gaussian":
        """The Gaussian of C x + offset, C (M, N)."""
        return Gaussian(apply(C, self.mean) + offset, symmetric(C @ self.cov @ transpose(C)))


def symmetric(cov: Array) -> Array:
    """The symmetric part of (..., N, N)."""
    half: Array = 0.5 * (cov + cov.swapaxes(-1, -2))
    return half


def transpose(matrix: NDArray[Any]) -> Array:
    """(..., M, N) to (..., N, M)."""
    return matrix.swapaxes(-1, -2)


def apply(matrix: Array, vector: Array) -> Array:
    """(..., M, N) times (..., N), broadcast over the leading axes."""
    product: Array = (matrix @ vector[..., None])[..., 0]
    return product


def measured_mean(values: Array) -> Array:
    """(n,) mean over the rows (T, n) without NaN entries; 0 for a column of NaN only."""
    seen = ~np.isnan(values)
    mean: Array = np.where(seen, values, 0.0).sum(0) / np.maximum(seen.sum(0), 1)
    return mean


def measured_first(values: Array) -> Array:
    """(n,) first entry of each column (T, n) that is not NaN; 0 for a column of NaN only."""
    seen = ~np.isnan(values)
    first: Array = values[seen.argmax(axis=0), np.arange(values.shape[1])]
    return np.where(seen.any(axis=0), first, 0.0)


def log_density(gaussian: Gaussian, x: Array) -> Array:
    """log N(x; mean, cov) in nats, broadcast over the leading axes."""
    white, log_det = inverse_root(gaussian.cov)
    density: Array = -0.5 * ((apply(white, x - gaussian.mean) ** 2).sum(-1) + log_det)
    return density


def inverse_root(cov: Array) -> tuple[Array, Array]:
    """L^-1 of cov = L L', (..., N, N), which makes noise white; and log |2 pi cov|."""
    root = np.linalg.cholesky(cov)
    diagonal = np.diagonal(root, axis1=-2, axis2=-1)
    log_det: Array = 2.0 * np.log(diagonal).sum(-1) + diagonal.shape[-1] * LOG_2PI
    return np.asarray(np.linalg.solve(root, np.broadcast_to(np.eye(cov.shape[-1]), root.shape))), log_det


def unknown(T: int, M: int) -> Gaussian:
    """A Gaussian of (T, M) unknown values: NaN throughout."""
    return Gaussian(np.full((T, M), np.nan), np.full((T, M, M), np.nan))


def joint(one: Gaussian, other: Gaussian, cross: Array) -> Gaussian:
    """The Gaussian of [x; y] from those of x and y, and Cov(x, y) (..., N, M)."""
    cov = np.block([[one.cov, cross], [transpose(cross), other.cov]])
    return Gaussian(np.concatenate([one.mean, other.mean], axis=-1), cov)


def collapse(weights: Array, gaussians: Gaussian) -> Gaussian:
    """The Gaussian with the moments of a mixture (..., H, N), whose weights (..., H) sum to 1 over H."""
    mean = (weights[..., None] * gaussians.mean).sum(-2)
    apart = gaussians.mean - mean[..., None, :]
    cov = (weights[..., None, None] * (gaussians.cov + apart[..., :, None] * apart[..., None, :])).sum(-3)
    return Gaussian(mean, symmetric(cov))
