"""The k-means start."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.initialise import kmeans
from dynamics.regression import form

NAMES = ("x", "hip")


def two_paces(rng):
    """A hip that rests near 0 or rises from 3, while x walks on; and which it is."""
    ys, labels = [], []
    for s in (0, 1, 0):
        hip = s * (3.0 + 0.05 * np.arange(40.0)) + 0.01 * rng.normal(size=40)
        ys.append(np.column_stack([0.1 * np.arange(40.0), hip]))
        labels.append(np.full(40, s))
    return ys, labels


def same_partition(one, other):
    return np.array_equal(one == one[0], other == other[0])


@pytest.mark.parametrize("order", [1, 2])
def test_clusters_of_poses_become_the_switching_states(order, rng):
    ys, labels = two_paces(rng)
    posteriors = kmeans(ys, 2, form(NAMES, ("x",), order), rng)
    got, want = np.concatenate([p.path for p in posteriors]), np.concatenate(labels)
    assert same_partition(got, want)


@pytest.mark.parametrize("order", [1, 2])
def test_poses_are_taken_as_measured_exactly(order, rng):
    ys, _ = two_paces(rng)
    for y, p in zip(ys, kmeans(ys, 3, form(NAMES, ("x",), order), rng), strict=True):
        assert_array_equal(p.states.mean[:, :2], y)
        if order == 2:
            assert_array_equal(p.states.mean[1:, 2:], y[:-1])
            # The pose before the first carries its velocity back; a rounding or two.
            assert_allclose(p.states.mean[0, 2:], 2.0 * y[0] - y[1], atol=1e-15)
        assert_array_equal(p.states.cov, 0.0)
        assert_array_equal(p.prob.argmax(1), p.path)
        assert_array_equal(p.pair.sum(2), p.prob[:-1])


def test_neither_place_nor_units_change_the_clusters(rng):
    ys, _ = two_paces(rng)
    shape = form(NAMES, ("x",), 2)

    def partition(change):
        posteriors = kmeans([change(y) for y in ys], 3, shape, np.random.default_rng(3))
        return np.concatenate([p.path for p in posteriors])

    want = partition(lambda y: y)
    assert_array_equal(partition(lambda y: y + np.array([7.0, 0.0])), want)
    assert_array_equal(partition(lambda y: y * [1.0, 57.3]), want)
    assert_array_equal(partition(lambda y: y * [100.0, 1.0]), want)


def test_the_same_seed_gives_the_same_start(rng):
    ys, _ = two_paces(rng)
    one, other = (kmeans(ys, 4, form(NAMES, (), 2), np.random.default_rng(5)) for _ in range(2))
    for p, q in zip(one, other, strict=True):
        assert_array_equal(p.path, q.path)


def test_one_switching_state_takes_every_frame(rng):
    ys, _ = two_paces(rng)
    for p in kmeans(ys, 1, form(NAMES, ("x",), 2), rng):
        assert_array_equal(p.path, 0)


def test_a_freedom_that_never_moves_is_no_obstacle(rng):
    ys = [np.column_stack([np.arange(20.0), np.full(20, 0.3)]) for _ in range(2)]
    for p in kmeans(ys, 1, form(NAMES, ("x",), 2), rng):
        assert np.isfinite(p.states.mean).all()
