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
        ys: sequences (T, M) without gaps, T >= 2.
        K: how many clusters.
        shape: form of the dynamics, for the order and for which freedoms travel.
    """
    places = shape.carry.any(axis=1)
    features = np.concatenate([np.hstack([y[:, ~places], np.gradient(y, axis=0)]) for y in ys])
    size = np.abs(np.concatenate(ys)).max(axis=0)
    labels = _cluster(features, np.hstack([size[~places], size]), K, rng)
    cuts = np.cumsum([len(y) for y in ys])[:-1]
    return [_certain(y, s, K, shape.order) for y, s in zip(ys, np.split(labels, cuts), strict=True)]


def _cluster(features: Array, size: Array, K: int, rng: np.random.Generator) -> NDArray[np.intp]:
    spread: Array = features.std(axis=0)
    # What does not change but for rounding must not be blown up to unit spread.
    moves = spread > 1e-9 * size
    if K == 1 or not moves.any():
        return np.zeros(len(features), dtype=np.intp)
    scaled = features[:, moves] / spread[moves]
    _, labels = kmeans2(scaled, K, minit="++", seed=rng)
    return labels.astype(np.intp)


def _certain(y: Array, s: NDArray[np.intp], K: int, order: int) -> Posterior:
    before = np.vstack([2.0 * y[:1] - y[1:2], y[:-1]])
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
