"""Initial switching states for EM: k-means clusters of poses and velocities, taken as measured exactly."""

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dynamics.chain import split_as
from dynamics.gaussian import Array, Gaussian
from dynamics.layout import Layout
from dynamics.learning.fill import fill
from dynamics.posterior import Posterior


def first_guess(ys: Sequence[Array], K: int, layout: Layout, rng: np.random.Generator) -> list[Posterior]:
    """Posteriors that take every frame's k-means cluster of K as its switching state; sequences (T, M), T >=
    2, with gaps filled."""
    ys = fill(ys)
    labels = split_as(clustered(np.concatenate(_features(ys, layout)), K, rng), ys)
    return [_labelled(y, s, K, layout.order) for y, s in zip(ys, labels, strict=True)]


def scaled(values: Array, size: Array) -> Array:
    """The columns (T, n) divided by their spread, so that all count alike, whatever their units.

    What changes only by the rounding of numbers of `size` (n,) that a column was made of is left out.
    """
    spread = values.std(axis=0)
    moves = spread > 1e-9 * size
    return np.asarray(values[:, moves] / spread[moves])


def clustered(points: Array, K: int, rng: np.random.Generator, tries: int = 1) -> NDArray[np.intp]:
    """(T,) the cluster of each of the points (T, n), the tightest K of some tries; 0 where too few differ."""
    from scipy.cluster.vq import kmeans2  # as slow to import as all that following needs of scipy

    distinct = np.unique(points, axis=0)
    if K == 1 or points.shape[1] == 0 or len(distinct) < K:
        return np.zeros(len(points), dtype=np.intp)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a cluster that empties is a state not visited
        found = [kmeans2(distinct, K, minit="++", seed=rng)[0] for _ in range(tries)]
    squares = [((points[:, None] - centres) ** 2).sum(-1) for centres in found]
    nearest = min(squares, key=lambda square: float(square.min(1).sum()))
    return np.asarray(nearest.argmin(1))


def _features(ys: Sequence[Array], layout: Layout) -> list[Array]:
    """Poses and velocities, each divided by its spread."""
    stays = ~layout.travels
    raw = [np.hstack([y[:, stays], np.gradient(y, axis=0)]) for y in ys]
    size = np.abs(np.concatenate(ys)).max(axis=0)
    return split_as(scaled(np.concatenate(raw), np.hstack([size[stays], size])), ys)


def _labelled(y: Array, s: NDArray[np.intp], K: int, order: int) -> Posterior:
    """Posterior that holds these poses and switching states for certain."""
    mean = _states(y, order)
    T, N = mean.shape
    return Posterior.on_path(s, K, Gaussian(mean, np.zeros((T, N, N))), np.zeros((T - 1, N, N)), -np.inf)


def _states(y: Array, order: int) -> Array:
    before = np.vstack([2.0 * y[:1] - y[1:2], y[:-1]])
    return y if order == 1 else np.hstack([y, before])
