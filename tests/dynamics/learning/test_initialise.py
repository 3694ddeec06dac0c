"""The first guesses of the switching states."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.layout import Layout
from dynamics.learning.initialise import first_guess

NAMES = ("x", "hip")


def two_paces(rng):
    """A hip that rests near 0 or rises from 3, while x walks on; and which it is."""
    ys, labels = [], []
    for s in (0, 1, 0):
        hip = s * (3.0 + 0.05 * np.arange(40.0)) + 0.01 * rng.normal(size=40)
        ys.append(np.column_stack([0.1 * np.arange(40.0), hip]))
        labels.append(np.full(40, s))
    return ys, labels


def two_turns(rng, *, T=60, n=8):
    """An oscillator about 0 that turns slowly or fast, the same poses all along; and which it does."""
    ys, labels = [], []
    for _ in range(n):
        s = (np.arange(T) + rng.integers(T)) % T < T // 2
        phase = np.cumsum(np.where(s, 0.25, 0.9)) + rng.uniform(0.0, 6.0)
        ys.append(np.stack([np.cos(phase), np.sin(phase)], axis=1) + 0.01 * rng.normal(size=(T, 2)))
        labels.append(s.astype(int))
    return ys, labels


def guess(ys, K, layout, seed=3):
    posteriors = first_guess(ys, K, layout, np.random.default_rng(seed))
    return np.concatenate([p.path for p in posteriors]), posteriors


@pytest.mark.parametrize("order", [1, 2])
def test_clusters_of_poses_become_the_switching_states(order, rng):
    ys, labels = two_paces(rng)
    (got, _), labels = guess(ys, 2, Layout(NAMES, ("x",), order)), np.concatenate(labels)
    assert_array_equal(got == got[0], labels == labels[0])


@pytest.mark.parametrize("order", [1, 2])
def test_poses_are_taken_as_measured_exactly(order, rng):
    ys, _ = two_paces(rng)
    _, posteriors = guess(ys, 3, Layout(NAMES, ("x",), order))
    for y, p in zip(ys, posteriors, strict=True):
        assert_array_equal(p.states.mean[:, :2], y)
        if order == 2:
            assert_array_equal(p.states.mean[1:, 2:], y[:-1])
            # The pose before the first carries its velocity back; a rounding or two.
            assert_allclose(p.states.mean[0, 2:], 2.0 * y[0] - y[1], atol=1e-15)
        assert_array_equal(p.states.cov, 0.0)
        assert_array_equal(p.prob.argmax(1), p.path)
        assert_array_equal(p.pair.sum(2), p.prob[:-1])
        assert_array_equal(p.pair.sum(1), p.prob[1:])


def test_neither_place_nor_units_change_the_guess(rng):
    turns, _ = two_turns(rng)
    ys = [np.column_stack([0.1 * np.arange(60.0) + 0.02 * y[:, 1], y[:, 0]]) for y in turns]
    layout = Layout(NAMES, ("x",), 2)

    def partition(change):
        return guess([change(y) for y in ys], 3, layout)[0]

    want = partition(lambda y: y)
    assert len(set(want)) > 1
    assert_array_equal(partition(lambda y: y + np.array([7.0, 0.0])), want)
    assert_array_equal(partition(lambda y: y * [1.0, 57.3]), want)
    assert_array_equal(partition(lambda y: y * [100.0, 1.0]), want)


def test_the_same_seed_gives_the_same_start_and_another_seed_another(rng):
    ys = [rng.normal(size=(40, 2)).cumsum(axis=0) for _ in range(4)]
    layout = Layout(NAMES, (), 2)
    one, other = (guess(ys, 4, layout, seed=5)[0] for _ in range(2))
    assert_array_equal(one, other)
    assert any((guess(ys, 4, layout, seed=seed)[0] != one).any() for seed in range(4))


def test_one_switching_state_takes_every_frame(rng):
    ys, _ = two_paces(rng)
    assert_array_equal(guess(ys, 1, Layout(NAMES, ("x",), 2))[0], 0)
