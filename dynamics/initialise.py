"""A first guess of the switching states: k-means on poses and their velocities, as in the 1999 paper."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from dynamics.gaussian import Array, Gaussian
from dynamics.posterior import Posterior
from dynamics.regression import Form


def kmeans(ys: Sequence[Array], K: int, shape: Form, rng: np.random.Generator) -> list[Posterior]:
    """Posteriors that take every frame as measured exactly and its k-means cluster as its switching state.

    Every pose and every velocity counts alike, whatever its units: each is divided by its spread.

    Args:
        ys: sequences (T, M) without gaps.
        K: how many clusters.
        shape: form of the dynamics, for the order and for which freedoms travel.
    """
    features = [_features(y, shape) for y in ys]
    labels = _cluster(np.concatenate(features), K, rng)
    cuts = np.cumsum([len(y) for y in ys])[:-1]
    return [_certain(y, s, K, shape.order) for y, s in zip(ys, np.split(labels, cuts), strict=True)]


def _features(y: Array, shape: Form) -> Array:
    change = np.gradient(y, axis=0) if len(y) > 1 else np.zeros_like(y)
    places = shape.carry.any(axis=1)
    return np.hstack([y[:, ~places], change])


def _cluster(features: Array, K: int, rng: np.random.Generator) -> NDArray[np.intp]:
    if K == 1:
        return np.zeros(len(features), dtype=np.intp)
    spread = features.std(axis=0)
    scaled = features / np.where(spread > 0, spread, 1.0)
    _, labels = kmeans2(scaled, K, minit="++", seed=rng)
    return labels.astype(np.intp)


def _certain(y: Array, s: NDArray[np.intp], K: int, order: int) -> Posterior:
    before = np.vstack([2.0 * y[:1] - y[1:2] if len(y) > 1 else y[:1], y[:-1]])
    mean = y if order == 1 else np.hstack([y, before])
    T, N = mean.shape
    prob = np.eye(K)[s]
    return Posterior(
        prob=prob,
        pair=prob[:-1, :, None] * prob[1:, None, :],
        states=Gaussian(mean, np.zeros((T, N, N))),
        lag=np.zeros((T - 1, N, N)),
        log_evidence=-np.inf,
        path=s,
    )
