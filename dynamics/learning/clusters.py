"""Clusters of frames by k-means, to start learning from."""

import warnings

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array


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
