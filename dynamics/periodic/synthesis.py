"""Gait of a person drawn from the population of a harmonic stride."""

import numpy as np

from dynamics.gaussian import Array
from dynamics.stride import DRIFTING, QUICK, SLOW, Stride, harmonics


def synthesise_stride(
    stride: Stride, k: int, T: int, fps: float, rng: np.random.Generator, noise: float = 1.0
) -> Array:
    """Poses (T, M) in body units, without measurement noise, of one person drawn for motion k.

    Coefficients, phase speed and travel of the person are constant (`dynamics.stride`); the phase begins at
    random and drifts. The bend of the phase is left out, as it would accelerate for ever. `noise` scales the
    standard deviation of drift and residual: 0 repeats one stride.
    """
    t, M, size = np.arange(T) / fps, len(stride.names), stride.basis
    z = stride.mean[k] + stride.root[k] @ rng.standard_normal(stride.mean.shape[1])
    speed, travel = z[M * size], z[M * size + 1 :]
    drift = noise * stride.drift[k] * matern_paths(T, 1.0 / fps, DRIFTING, 1, rng)[:, 0]
    phase = rng.uniform(0.0, 2.0 * np.pi) + speed * t + drift
    y = harmonics(phase, size) @ z[: M * size].reshape(M, size).T
    y[:, stride.travels] += t[:, None] * travel
    for scale, cov in ((QUICK, stride.quick[k]), (SLOW, stride.slow[k])):
        y += noise * matern_paths(T, 1.0 / fps, scale, M, rng) @ np.linalg.cholesky(cov).T
    return np.asarray(y)


def matern_paths(T: int, step: float, scale: float, n: int, rng: np.random.Generator) -> Array:
    """(T, n) independent paths, `step` seconds a row, of a Matern process (3/2) of variance 1 and this scale.

    The process and its slope are a Markov process with the transition F and the stationary covariance P =
    diag(1, r^2), r = sqrt(3) / scale; it is drawn step by step.
    """
    r = np.sqrt(3.0) / scale
    F = np.exp(-r * step) * np.array([[1.0 + r * step, step], [-(r**2) * step, 1.0 - r * step]])
    P = np.diag([1.0, r**2])
    root = np.linalg.cholesky(P - F @ P @ F.T)
    now = np.sqrt(P) @ rng.standard_normal((2, n))
    paths = np.empty((T, n))
    for row in paths:
        row[:] = now[0]
        now = F @ now + root @ rng.standard_normal((2, n))
    return paths
