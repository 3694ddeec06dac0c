"""Densities, collapse, and the checks of what travels."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import multivariate_normal

from dynamics.gaussian import Gaussian, apply, collapse, frozen, joint, log_density
from tests.oracles import assert_gaussian, mixture, random_covariance


def mixtures(H, N, rng, leading=()):
    weights = rng.dirichlet(np.ones(H), size=leading)
    mean = rng.normal(size=(*leading, H, N))
    cov = np.array([random_covariance(N, rng) for _ in range(int(np.prod(leading, dtype=int)) * H)])
    return weights, Gaussian(mean, cov.reshape(*leading, H, N, N))


def test_log_density_is_scipys_over_leading_axes(rng):
    _, gaussians = mixtures(3, 4, rng, leading=(2,))
    x = rng.normal(size=4)
    want = [
        [multivariate_normal(gaussians.mean[i, h], gaussians.cov[i, h]).logpdf(x) for h in range(3)]
        for i in range(2)
    ]
    # Two factorisations of matrices with condition numbers below 1e3.
    assert_allclose(log_density(gaussians, x), want, rtol=1e-11)


def test_collapse_keeps_mean_and_second_moment_of_each_of_many_mixtures(rng):
    weights, gaussians = mixtures(4, 3, rng, leading=(2, 3))
    many = collapse(weights, gaussians)
    for i in np.ndindex(2, 3):
        want = mixture(weights[i], gaussians.mean[i], gaussians.cov[i])
        assert_gaussian(many[i], want, atol=1e-13)  # sums of a few numbers near 1


def test_apply_is_the_product_with_each_vector(rng):
    matrix, vector = rng.normal(size=(2, 1, 3, 4)), rng.normal(size=(5, 4))
    # Products of four numbers near 1.
    assert_allclose(apply(matrix, vector), np.einsum("aij,bj->abi", matrix[:, 0], vector), atol=1e-13)


def test_indexing_takes_and_sets_mean_and_covariance_together(rng):
    _, gaussians = mixtures(4, 3, rng)
    some = gaussians[np.array([2, 0])]
    assert_array_equal(some.mean, gaussians.mean[[2, 0]])
    assert_array_equal(some.cov, gaussians.cov[[2, 0]])
    gaussians[1:3] = some
    assert_array_equal(gaussians.mean[1], some.mean[0])
    assert_array_equal(gaussians.cov[2], some.cov[1])


def test_of_a_joint_gaussian_a_linear_map_shows_what_it_picks(rng):
    cov, C = random_covariance(5, rng), rng.normal(size=(2, 5))
    both = Gaussian(rng.normal(size=5), cov)
    parts = (Gaussian(both.mean[own], cov[own, own]) for own in (slice(0, 3), slice(3, 5)))
    again = joint(*parts, cov[:3, 3:])
    assert_array_equal(again.cov, cov)
    # Sums of five numbers near 1.
    assert_gaussian(again.through(C, 2.0), Gaussian(C @ both.mean + 2.0, C @ cov @ C.T), atol=1e-13)


def test_frozen_arrays_are_read_only_copies():
    source = np.zeros(3)
    array = frozen("q", source, (3,))
    source[0] = 1.0
    assert array[0] == pytest.approx(0.0)
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 1.0
