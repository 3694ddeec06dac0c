"""The start of EM: initial switching states.

The states are k-means clusters of poses and velocities, taken as exact measurements.
"""

import warnings
from collections.abc import Sequence

import numpy as np

from dynamics.chain import split_as
from dynamics.gaussian import Array, Gaussian, Ints
from dynamics.layout import Layout
from dynamics.posterior import Posterior


def first_guess(ys: Sequence[Array], K: int, layout: Layout, rng: np.random.Generator) -> list[Posterior]:
    """Posteriors that take each frame's k-means cluster of K as its state; sequences (T, M), T >= 2."""
    stays = ~layout.travels
    raw = [np.hstack([y[:, stays], np.gradient(y, axis=0)]) for y in ys]
    size = np.abs(np.concatenate(ys)).max(axis=0)
    features = scaled(np.concatenate(raw), np.hstack([size[stays], size]))
    labels = split_as(clustered(features, K, rng), ys)
    return [_labelled(y, s, K, layout.order) for y, s in zip(ys, labels, strict=True)]


def scaled(values: Array, size: Array) -> Array:
    """The columns (T, n) divided by their spread, so that all count alike, whatever their units.

    Columns that vary by no more than the rounding of numbers of `size` (n,) are left out.
    """
    spread = values.std(axis=0)
    moves = spread > 1e-9 * size
    return np.asarray(values[:, moves] / spread[moves])


def clustered(points: Array, K: int, rng: np.random.Generator, tries: int = 1) -> Ints:
    """(T,) the cluster of each of the points (T, n), the tightest K of some tries; 0 where too few differ."""
    from scipy.cluster.vq import kmeans2  # as slow to import as all of scipy that tracking needs

    distinct = np.unique(points, axis=0)
    if K == 1 or points.shape[1] == 0 or len(distinct) < K:
        return np.zeros(len(points), dtype=np.intp)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # an empty cluster is a state that is not visited
        found = [kmeans2(distinct, K, minit="++", seed=rng)[0] for _ in range(tries)]
    squares = [((points[:, None] - centres) ** 2).sum(-1) for centres in found]
    nearest = min(squares, key=lambda square: float(square.min(1).sum()))
    return np.asarray(nearest.argmin(1))


def _labelled(y: Array, s: Ints, K: int, order: int) -> Posterior:
    """Posterior in which these poses and switching states are certain."""
    before = np.vstack([2.0 * y[:1] - y[1:2], y[:-1]])
    mean = y if order == 1 else np.hstack([y, before])
    T, N = mean.shape
    return Posterior.on_path(s, K, Gaussian(mean, np.zeros((T, N, N))), np.zeros((T - 1, N, N)), -np.inf)
