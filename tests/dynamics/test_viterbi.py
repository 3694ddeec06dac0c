"""Approximate Viterbi against the sum over all paths."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.viterbi import viterbi, viterbi_all
from tests.oracles import all_paths, enumerated, given_path, random_slds

# The smoother raises the predicted covariance by 1e-12 of its size, and its inverse may be 1e3 larger.
SMOOTHED = 1e-9


def drawn(slds, T, rng, *, gaps=False):
    y = slds.sample(T, rng)[2]
    if gaps:
        y[rng.random(y.shape) < 0.3] = np.nan
    return y


def assert_same(one, other, *, atol):
    assert_array_equal(one.path, other.path)
    assert one.log_evidence == pytest.approx(other.log_evidence, rel=1e-11)
    assert_allclose(one.states.mean, other.states.mean, atol=atol)
    assert_allclose(one.states.cov, other.states.cov, atol=atol)
    assert_allclose(one.lag, other.lag, atol=atol)
    assert_array_equal(one.prob, other.prob)
    assert_array_equal(one.pair, other.pair)


def permuted(slds, order):
    fields = {name: getattr(slds, name)[order] for name in ("pi0", "A", "b", "Q", "mean0", "cov0")}
    return replace(slds, Pi=slds.Pi[np.ix_(order, order)], **fields)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("T", [1, 2, 7])
@pytest.mark.parametrize("gaps", [False, True])
def test_with_one_switching_state_inference_is_the_kalman_smoother(order, T, gaps, rng):
    slds = random_slds(1, order=order, rng=rng)
    y = drawn(slds, T, rng, gaps=gaps)
    mean, cov, log_p = given_path(slds, y, [0] * T)
    got = viterbi(slds, y)
    assert got.log_evidence == pytest.approx(log_p, rel=1e-11, abs=1e-12)
    assert_allclose(got.states.mean, mean, atol=SMOOTHED)
    assert_allclose(got.states.cov, [cov[t, :, t] for t in range(T)], atol=SMOOTHED)
    assert got.lag.shape == (T - 1, order * 2, order * 2)
    for t in range(T - 1):
        assert_allclose(got.lag[t], cov[t + 1, :, t], atol=SMOOTHED)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("gaps", [False, True])
def test_the_answer_is_exact_given_its_own_path(order, gaps, rng):
    slds = random_slds(3, order=order, rng=rng)
    y = drawn(slds, 9, rng, gaps=gaps)
    got = viterbi(slds, y)
    mean, cov, log_p = given_path(slds, y, got.path)
    assert got.log_evidence == pytest.approx(log_p, rel=1e-11)
    assert_allclose(got.states.mean, mean, atol=SMOOTHED)
    assert_allclose(got.states.cov, [cov[t, :, t] for t in range(9)], atol=SMOOTHED)
    assert_allclose(got.lag, [cov[t + 1, :, t] for t in range(8)], atol=SMOOTHED)
    assert_array_equal(got.prob.argmax(1), got.path)
    assert_array_equal(got.pair.sum(2), got.prob[:-1])
    assert_array_equal(got.pair.sum(1), got.prob[1:])


def test_its_path_is_nearly_always_the_best_and_never_better(rng):
    gaps = []
    for i in range(60):
        slds = random_slds(2, order=1 + i % 2, rng=rng)
        y = drawn(slds, 6, rng, gaps=i % 3 == 0)
        best = max(log_p for _, log_p in all_paths(slds, y))
        gaps.append(best - viterbi(slds, y).log_evidence)
    # No path beats the best of all by more than rounding in a log-likelihood near 20.
    assert min(gaps) > -1e-10
    # Measured over 400 such problems: 98.5 % exact, the worst 1.41 nats short.
    assert np.mean(np.array(gaps) < 1e-9) >= 0.9
    assert max(gaps) < 2.0


def test_two_frames_are_exact(rng):  # nothing is dropped before the second frame's choice
    for _ in range(10):
        slds = random_slds(3, rng=rng)
        y = drawn(slds, 2, rng)
        path, log_p = max(all_paths(slds, y), key=lambda pair: pair[1])
        got = viterbi(slds, y)
        assert tuple(got.path) == path
        assert got.log_evidence == pytest.approx(log_p, rel=1e-11)


def test_identical_switching_states_give_the_one_state_answer(rng):
    one = random_slds(1, order=2, rng=rng)
    fields = {name: np.repeat(getattr(one, name), 3, axis=0) for name in ("A", "b", "Q", "mean0", "cov0")}
    three = replace(one, pi0=np.full(3, 1 / 3), Pi=np.full((3, 3), 1 / 3), labels=("random",) * 3, **fields)
    y = drawn(one, 12, rng, gaps=True)
    got, want = viterbi(three, y), viterbi(one, y)
    assert_allclose(got.states.mean, want.states.mean, atol=1e-11)  # the same operations, batched otherwise
    assert_allclose(got.states.cov, want.states.cov, atol=1e-11)
    # Any path costs log 3 a frame more.
    assert got.log_evidence == pytest.approx(want.log_evidence - 12 * np.log(3.0), rel=1e-11)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("restless", [False, True])
def test_sequences_of_unequal_lengths_are_each_on_its_own(order, restless, rng):
    slds = random_slds(3, order=order, rng=rng)
    if restless:  # no state may follow itself, not even where a shorter sequence has ended
        slds = replace(slds, Pi=0.5 * (1.0 - np.eye(3)))
    ys = [drawn(slds, T, rng, gaps=T % 2 == 0) for T in (5, 1, 17, 2, 17, 9, 1)]
    for got, y in zip(viterbi_all(slds, ys), ys, strict=True):
        assert got.states.mean.shape == (len(y), 2 * order)
        assert_same(got, viterbi(slds, y), atol=1e-11)  # the same operations, batched otherwise


def test_more_sequences_than_a_batch_come_back_in_order(rng):
    slds = random_slds(2, d=1, rng=rng)
    ys = [drawn(slds, 1 + n % 5, rng) for n in range(150)]
    for got, y in zip(viterbi_all(slds, ys), ys, strict=True):
        assert got.log_evidence == pytest.approx(viterbi(slds, y).log_evidence, rel=1e-11)


def test_no_sequences_give_no_posteriors(rng):
    assert viterbi_all(random_slds(2, rng=rng), []) == []


def test_a_transition_that_cannot_be_is_never_taken(rng):
    Pi = np.array([[0.6, 0.4, 0.0], [0.0, 0.6, 0.4], [0.4, 0.0, 0.6]])  # a ring
    slds = replace(random_slds(3, rng=rng), Pi=Pi, pi0=[1.0, 0.0, 0.0])
    other = random_slds(3, rng=rng)
    taken = np.zeros((3, 3))
    for y in [drawn(other, 40, rng), *(drawn(slds, 40, rng) for _ in range(3))]:
        got = viterbi(slds, y)
        assert got.path[0] == 0
        assert np.isfinite(got.log_evidence)
        taken += got.pair.sum(0)
    assert taken[Pi == 0.0].sum() == 0.0
    assert (taken[Pi > 0.0] > 0).all()  # the data did call for switches


def test_permuting_the_states_permutes_the_answer(rng):
    slds = random_slds(3, order=2, noise=0.05, rng=rng)
    y, order = drawn(slds, 60, rng), np.array([2, 0, 1])
    one, other = viterbi(slds, y), viterbi(permuted(slds, order), y)
    assert len(set(one.path)) > 1
    assert_array_equal(order[other.path], one.path)
    assert_allclose(other.states.mean, one.states.mean, atol=1e-11)  # the same sums in another order
    assert other.log_evidence == pytest.approx(one.log_evidence, rel=1e-11)


def test_a_state_that_can_never_be_entered_changes_nothing(rng):
    slds = random_slds(3, rng=rng)
    Pi = np.array([[0.7, 0.3, 0.0], [0.3, 0.7, 0.0], [0.0, 0.0, 1.0]])
    three = replace(slds, Pi=Pi, pi0=[0.5, 0.5, 0.0])
    fields = {name: getattr(slds, name)[:2] for name in ("A", "b", "Q", "mean0", "cov0", "labels")}
    two = replace(slds, Pi=Pi[:2, :2], pi0=[0.5, 0.5], **fields)
    y = drawn(two, 25, rng, gaps=True)
    got, want = viterbi(three, y), viterbi(two, y)
    assert_array_equal(got.path, want.path)
    assert got.log_evidence == pytest.approx(want.log_evidence, rel=1e-11)
    assert np.isfinite(got.states.mean).all()
    assert np.isfinite(got.states.cov).all()


def test_an_outlier_of_fifty_deviations_leaves_everything_finite(rng):
    slds = random_slds(4, order=2, rng=rng)
    y = drawn(slds, 30, rng)
    y[10] += 50.0 * np.sqrt(np.diag(slds.R))
    got = viterbi(slds, y)
    assert np.isfinite(got.log_evidence)
    assert got.log_evidence == pytest.approx(given_path(slds, y, got.path)[2], rel=1e-9)


def test_a_sequence_with_no_measurement_at_all_is_the_prior(rng):
    slds = random_slds(2, rng=rng)
    got = viterbi(slds, np.full((6, 2), np.nan))
    k = got.path[0]
    assert got.log_evidence == pytest.approx(max(p for _, p in all_paths(slds, np.full((6, 2), np.nan))))
    assert_allclose(got.states.mean[0], slds.mean0[k], atol=SMOOTHED)
    assert_allclose(got.states.cov[0], slds.cov0[k], atol=SMOOTHED)


def test_where_states_are_told_apart_the_path_is_the_exact_posterior(rng):
    apart = np.array([[5.0, 5.0], [-5.0, -5.0]])
    slds = replace(random_slds(2, rng=rng), b=apart, mean0=apart)
    s, _, y = slds.sample(7, rng)
    exact, got = enumerated(slds, y), viterbi(slds, y)
    assert_array_equal(got.path, s)
    # The exact posterior puts this much on the path; the moments differ by the rest.
    rest = 1.0 - np.exp(got.log_evidence - exact.log_evidence)
    assert -1e-12 < rest < 0.01
    assert_allclose(got.prob, exact.prob, atol=abs(rest) + 1e-12)
    assert_allclose(got.states.mean, exact.states.mean, atol=10.0 * abs(rest) + SMOOTHED)
