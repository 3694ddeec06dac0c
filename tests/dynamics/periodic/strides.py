"""A little stride of four freedoms: a place that travels, a trunk and two legs, two harmonics of each."""

import numpy as np

from dynamics.stride import Stride, combine_strides, harmonics, orders

NAMES = ("root_x", "torso", "hip_near", "hip_far")
TWINS = np.array([0, 1, 3, 2])
M, SIZE = 4, 5
Z = M * SIZE + 2
FPS = 30.0


def little(rng, *, speed=6.0, hurry=0.5, label="walk", drift=0.2):
    """One whose mirror image is as probable as itself."""
    c = np.zeros((M, SIZE))
    c[1] = [0.1, 0.0, 0.0, 0.03, 0.02]
    c[2] = [0.1, 0.4, 0.0, 0.05, 0.1]
    c[3] = c[2] * (-1.0) ** orders(SIZE)
    c[0, 3] = 0.02
    mean = np.concatenate([c.ravel(), [speed, 1.4]])
    half = np.kron(np.eye(M)[TWINS], np.diag((-1.0) ** orders(SIZE)))
    F = np.eye(Z)
    F[: M * SIZE, : M * SIZE] = half
    loose = 0.01 * rng.normal(size=(Z, Z)) + np.diag(np.append(np.full(M * SIZE, 0.03), [hurry, 0.1]))
    cov = 0.5 * (loose @ loose.T + F @ loose @ loose.T @ F.T)
    quick, slow, R = (_symmetric(rng, sd) for sd in (0.02, 0.04, 0.01))
    return Stride(
        mean=mean[None], root=np.linalg.cholesky(cov)[None], quick=quick, slow=slow, R=R,
        bend=np.array([0.3]), drift=np.array([drift]),
        names=NAMES, travelling=("root_x",), labels=(label,), fps=FPS,
    )  # fmt: skip


def two_strides(rng):
    """A walk and a run."""
    return combine_strides([little(rng), little(rng, speed=10.0, label="run")])


def drawn(stride, T, rng, *, k=0, fps=FPS):
    """A stretch of frames of a person of its own: seconds, poses without noise, and the phase."""
    t = (np.arange(T) - T / 2) / fps
    z = stride.mean[k] + stride.root[k] @ rng.normal(size=stride.mean.shape[1])
    c = z[: M * SIZE].reshape(M, SIZE)
    phase = 2.0 * np.pi * rng.random() + z[M * SIZE] * t + 0.3 * stride.bend[k] * t**2
    y = harmonics(phase, SIZE) @ c.T
    y[:, 0] += z[-1] * t
    lag = np.abs(t[:, None] - t)
    for scale, S in ((0.1, stride.quick[k]), (0.4, stride.slow[k])):
        r = np.sqrt(3.0) * lag / scale
        root = np.linalg.cholesky((1.0 + r) * np.exp(-r) + 1e-9 * np.eye(T))
        y = y + root @ rng.normal(size=(T, M)) @ np.linalg.cholesky(S).T
    return t, y, phase


def noisy(stride, y, rng, k=0):
    """As measured."""
    return y + rng.normal(size=y.shape) @ np.linalg.cholesky(stride.R[k]).T


def _symmetric(rng, sd):
    """(1, M, M) a covariance that exchanging the legs does not change."""
    loose = sd * (np.eye(M) + 0.2 * rng.normal(size=(M, M)))
    S = loose @ loose.T
    return 0.5 * (S + S[np.ix_(TWINS, TWINS)])[None]
