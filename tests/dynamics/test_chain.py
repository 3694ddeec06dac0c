"""The discrete chain against the sum over all its paths."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.chain import best_paths, blocks, forward_backward, side_by_side
from tests.dynamics.hmms import of_all_paths


def logs(array):
    with np.errstate(divide="ignore"):
        return np.log(array)


def random_chain(K, rng):
    return logs(rng.dirichlet(np.ones(K))), logs(rng.dirichlet(np.ones(K), size=K))


def ring():
    """Three states that may only stay or go round, started in the first."""
    Pi = np.array([[0.6, 0.4, 0.0], [0.0, 0.6, 0.4], [0.4, 0.0, 0.6]])
    return logs(np.array([1.0, 0.0, 0.0])), logs(Pi)


def answers(log_pi0, log_Pi, log_liks):
    """What is found of each sequence."""
    padded, lengths = side_by_side(log_liks, 0.0)
    prob, pair, log_evidence = forward_backward(log_pi0, log_Pi, padded, lengths)
    path = best_paths(log_pi0, log_Pi, padded, lengths)
    return [
        SimpleNamespace(
            prob=prob[:T, n], pair=pair[: T - 1, n], log_evidence=log_evidence[n], path=path[:T, n]
        )
        for n, T in enumerate(lengths)
    ]


def assert_that_of_all_paths(log_pi0, log_Pi, log_lik, *, atol=1e-12, rel=1e-13):
    """Probabilities, evidence and best path; rounding in sums of logs of at most a few hundred."""
    prob, pair, log_evidence, path = of_all_paths(log_pi0, log_Pi, log_lik)
    (got,) = answers(log_pi0, log_Pi, [log_lik])
    assert_allclose(got.prob, prob, atol=atol)
    assert_allclose(got.pair, pair, atol=atol)
    assert got.log_evidence == pytest.approx(log_evidence, rel=rel)
    assert_array_equal(got.path, path)
    return got


@pytest.mark.parametrize(("K", "T"), [(1, 4), (2, 1), (2, 8), (3, 2), (3, 6), (4, 5)])
@pytest.mark.parametrize("scale", [0.1, 3.0, 40.0])
def test_probabilities_evidence_and_best_path_are_those_of_all_paths(K, T, scale, rng):
    log_pi0, log_Pi = random_chain(K, rng)
    assert_that_of_all_paths(log_pi0, log_Pi, scale * rng.normal(size=(T, K)))


def test_transitions_and_starts_that_cannot_be_have_no_probability(rng):
    log_pi0, log_Pi = ring()
    for _ in range(5):
        got = assert_that_of_all_paths(log_pi0, log_Pi, 5.0 * rng.normal(size=(6, 3)))
        assert_array_equal(got.pair[:, np.isneginf(log_Pi)], 0.0)
        assert_array_equal(got.prob[0, 1:], 0.0)


def test_a_frame_may_exclude_a_state(rng):
    log_pi0, log_Pi = random_chain(3, rng)
    log_lik = rng.normal(size=(5, 3))
    log_lik[2, 1] = log_lik[4, 0] = -np.inf
    assert_that_of_all_paths(log_pi0, log_Pi, log_lik)


def test_what_stands_beyond_a_sequences_end_does_not_matter(rng):
    log_pi0, log_Pi = random_chain(2, rng)
    padded, lengths = side_by_side([rng.normal(size=(T, 2)) for T in (3, 6)], 0.0)
    other = padded.copy()
    other[3:, 0] = [[-5.0, 900.0]]
    (prob, pair, value), (prob2, pair2, value2) = (
        forward_backward(log_pi0, log_Pi, log_lik, lengths) for log_lik in (padded, other)
    )
    assert_array_equal(prob[:3], prob2[:3])
    assert_array_equal(pair[:2], pair2[:2])
    assert_array_equal(prob[:, 1], prob2[:, 1])
    assert_array_equal(value, value2)


def test_how_a_state_would_go_on_does_not_sway_a_path_that_has_ended():
    log_pi0, log_Pi = logs(np.array([0.5, 0.5])), logs(np.array([[0.6, 0.4], [0.0, 1.0]]))
    ended, longer = np.array([[0.0, -5.0], [0.1, 0.0]]), np.zeros((9, 2))
    assert_array_equal(answers(log_pi0, log_Pi, [ended, longer])[0].path, [0, 0])


def test_likelihoods_far_beyond_the_range_of_floats_lose_nothing():
    # Every second frame speaks against both states by thousands of nats, by 2 nats more against the second,
    # and from the second nobody returns: what matters underflows if it leaves the logs.
    log_pi0, log_Pi = logs(np.array([0.5, 0.5])), logs(np.array([[0.9, 0.1], [0.0, 1.0]]))
    log_lik = np.tile([[-3000.0, -3002.0], [-35000.0, -35000.0]], (3, 1))
    log_lik[-1] = [-9000.0, 0.0]
    assert_that_of_all_paths(log_pi0, log_Pi, log_lik, atol=1e-10, rel=1e-14)  # logs near 1e5 carry 1e-11


def test_a_state_told_apart_by_thousands_of_nats_too_late_is_still_found():
    # The first state is the likelier by 2000 nats until it turns out impossible: what is left of the second,
    # exp(-2000), must not have been lost.
    log_pi0, log_Pi = logs(np.array([0.5, 0.5])), logs(np.eye(2))
    log_lik = np.array([[0.0, -2000.0], [0.0, 0.0], [-np.inf, 0.0]])
    (got,) = answers(log_pi0, log_Pi, [log_lik])
    assert_allclose(got.prob, [[0.0, 1.0]] * 3, atol=1e-12)
    assert got.log_evidence == pytest.approx(np.log(0.5) - 2000.0, rel=1e-14)
    assert_array_equal(got.path, [1, 1, 1])


@pytest.mark.parametrize("answer", [forward_backward, best_paths])
def test_a_sequence_that_no_path_can_have_made_is_named(answer):
    log_pi0, log_Pi = ring()
    possible = np.zeros((3, 3))
    impossible = possible.copy()
    impossible[1, :2] = -np.inf  # the third state cannot be reached in a step
    with pytest.raises(ValueError, match=r"no path can have made sequence 1: .* -inf"):
        answer(log_pi0, log_Pi, *side_by_side([possible, impossible], 0.0))


def test_joined_blocks_leave_their_own_with_the_probability_of_crossing(rng):
    Pis = [rng.dirichlet(np.ones(K), size=K) for K in (2, 1, 3)]
    Pi = blocks(Pis, 0.06)
    assert_allclose(Pi.sum(1), 1.0, atol=1e-15)
    own = np.array([0, 0, 1, 2, 2, 2])
    inside = own[:, None] == own
    for n, block in enumerate(Pis):
        assert_allclose(Pi[np.ix_(own == n, own == n)], 0.94 * block, atol=1e-15)
    others = np.array([4, 4, 5, 3, 3, 3])[:, None]  # states of the other blocks
    assert_allclose(np.where(inside, 0.0, Pi), np.where(inside, 0.0, 0.06 / others), atol=1e-16)
    assert_array_equal(blocks(Pis[:1], 0.06), Pis[0])
