"""Approximate Viterbi against the sum over all paths."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian, log_density
from dynamics.viterbi import CHUNK, viterbi, viterbi_all
from tests.oracles import (
    SMOOTHED,
    all_paths,
    assert_gaussian,
    assert_given_path,
    assert_same,
    drawn,
    given_path,
    random_slds,
    sample,
)


@pytest.mark.parametrize("order", [1, 2])
def test_one_switching_state_agrees_with_pykalman_where_frames_are_missing(order, rng):
    pykalman = pytest.importorskip("pykalman")
    slds = random_slds(1, d=3, order=order, rng=rng)
    y = sample(slds, 12, rng)[2]
    y[[0, 4, 5, 11]] = np.nan
    other = pykalman.KalmanFilter(
        slds.A[0], slds.C, slds.Q[0], slds.R, slds.b[0], np.zeros(3), slds.mean0[0], slds.cov0[0]
    )
    masked = np.ma.masked_invalid(y)
    found = viterbi(slds, y)
    assert_gaussian(found.states, Gaussian(*other.smooth(masked)), atol=1e-9)
    assert_allclose(found.log_evidence, other.loglikelihood(masked), atol=1e-9)


@pytest.mark.parametrize(
    ("order", "gaps", "dense"), [(1, False, False), (1, True, True), (2, False, True), (2, True, False)]
)
def test_the_answer_is_exact_given_its_own_path(order, gaps, dense, rng):
    slds = random_slds(3, order=order, rng=rng)
    if dense:
        A, Q = slds.A + 0.1 * rng.normal(size=slds.A.shape), slds.Q + 0.1 * np.eye(slds.A.shape[-1])
        slds = replace(slds, A=A, Q=Q, C=rng.normal(size=slds.C.shape))
    y = drawn(slds, 9, rng, gaps=gaps)
    got = viterbi(slds, y)
    assert_given_path(got, slds, y, got.path)
    assert_array_equal(got.prob.argmax(1), got.path)
    assert_array_equal(got.pair.sum(2), got.prob[:-1])
    assert_array_equal(got.pair.sum(1), got.prob[1:])


def test_its_path_is_nearly_always_the_best_and_never_better(rng):
    gaps = []
    for i in range(30):
        slds = random_slds(2, order=1 + i % 2, rng=rng)
        y = drawn(slds, 6, rng, gaps=i % 3 == 0)
        best = all_paths(slds, y)[1].max()
        gaps.append(best - viterbi(slds, y).log_evidence)
    # No path beats the best of all by more than rounding in a log-likelihood near 20.
    assert min(gaps) > -1e-10
    # Measured over 400 such problems: 98.5 % exact, the worst 1.41 nats short.
    assert np.mean(np.array(gaps) < 1e-9) >= 0.9
    assert max(gaps) < 2.0


# Hints


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("gaps", [False, True])
def test_hints_are_a_further_measurement_that_only_the_switching_state_explains(order, gaps, rng):
    slds = random_slds(3, order=order, rng=rng)
    y = drawn(slds, 25, rng, gaps=gaps)
    # A third freedom, drawn afresh at every frame about the state's own level, and measured with noise.
    level, spread, noise = np.array([-2.0, 0.0, 2.0]), np.array([0.3, 0.5, 0.9]), 0.2
    N = 2 * order
    wide = slds.with_drifts(("z",), np.zeros(1), np.zeros(1), np.zeros(1))
    changed = {name: getattr(wide, name).copy() for name in ("b", "Q", "R", "mean0", "cov0")}
    changed["b"][:, N] = changed["mean0"][:, N] = level
    changed["Q"][:, N, N] = changed["cov0"][:, N, N] = spread
    changed["R"][2, 2] = noise
    wide = replace(wide, **changed)
    z = 2.0 * rng.normal(size=25)
    at_level = Gaussian(level[:, None], (spread + noise)[:, None, None])
    got = viterbi(slds, y, log_density(at_level, z[:, None, None]))
    want = viterbi(wide, np.column_stack([y, z]))
    assert not np.array_equal(want.path, viterbi(slds, y).path)  # the hints did tell something
    assert_array_equal(got.path, want.path)
    assert got.log_evidence == pytest.approx(want.log_evidence, rel=1e-11)
    assert_gaussian(got.states, Gaussian(want.states.mean[:, :N], want.states.cov[:, :N, :N]), atol=SMOOTHED)


def test_paths_that_cannot_be_are_refused(rng):
    slds, never = random_slds(3, rng=rng), np.zeros((5, 3))
    never[2] = -np.inf
    with pytest.raises(ValueError, match="no switching path is possible; see pi0, Pi and hints"):
        viterbi(slds, drawn(slds, 5, rng), never)


# The lean filter's own limits


def test_smoothing_is_exact_over_more_frames_than_are_taken_at_a_time(rng):
    slds = random_slds(1, d=1, order=2, rng=rng)
    y = drawn(slds, 2 * CHUNK + 3, rng, gaps=True)
    assert_given_path(viterbi(slds, y), slds, y, [0] * len(y))


def test_long_sequences_that_end_at_different_frames_are_each_on_its_own(rng):
    slds = random_slds(3, order=2, d=1, rng=rng)
    ys = [drawn(slds, T, rng, gaps=T % 2 == 0) for T in (CHUNK + 70, CHUNK + 60, 60, CHUNK // 2, 3)]
    for got, y in zip(viterbi_all(slds, ys), ys, strict=True):
        alone = viterbi(slds, y)
        assert_same(got, alone, atol=1e-11, rel=1e-11)  # the same operations, batched otherwise
        assert_array_equal(got.prob, alone.prob)
        assert_array_equal(got.pair, alone.pair)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("r", "q"), [(1e-8, 1.0), (1e8, 1.0), (1.0, 1e-8), (1.0, 1e8), (1e-8, 1e-8)])
def test_noise_may_be_all_but_nothing_or_overwhelming(order, r, q, rng):
    slds = random_slds(3, order=order, noise=1.0, rng=rng)
    slds = replace(slds, R=r**2 * slds.R, Q=q**2 * slds.Q)
    y = drawn(slds, 40, rng)
    y[15:20] = np.nan
    got = viterbi(slds, y)
    assert np.isfinite(got.states.mean).all()
    assert_array_equal(got.states.cov, np.swapaxes(got.states.cov, -1, -2))
    size = np.diagonal(got.states.cov, axis1=-2, axis2=-1).max(-1)
    assert (np.linalg.eigvalsh(got.states.cov)[:, 0] > -1e-9 * size).all()  # smoothed to rounding
    if r >= 1.0 >= q:  # else the twin's one big covariance is singular to rounding
        assert got.log_evidence == pytest.approx(given_path(slds, y, got.path)[2], rel=1e-6)
