import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg.blas import dtbsv

from tracker.outline.climb import factor

SPREAD, CHANGE = np.array([0.2, 1.5]), np.array([0.1, 0.7])


def precision(T, k):
    """Of a path near 0 and near itself a frame before."""
    change = np.diff(np.eye(T), axis=0) / CHANGE[k]
    return np.eye(T) / SPREAD[k] ** 2 + change.T @ change


@pytest.mark.parametrize("T", [1, 2, 7])
def test_paths_and_slopes_go_through_the_factor_of_the_precision(T, rng):
    U, z, slope = factor(T, SPREAD, CHANGE), rng.normal(size=(T, 2)), rng.normal(size=(T, 2))
    paths, slopes = dtbsv(2, U, z.ravel()).reshape(T, 2), dtbsv(2, U, slope.ravel(), trans=1).reshape(T, 2)
    for k in range(2):
        upper = np.linalg.cholesky(precision(T, k)).T
        assert_allclose(upper @ paths[:, k], z[:, k], atol=1e-12)
        assert_allclose(upper.T @ slopes[:, k], slope[:, k], atol=1e-12)
