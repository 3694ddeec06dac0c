"""The step moments that every inference hands to the M-step."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.viterbi import viterbi
from tests.oracles import enumerated, given_path, random_slds, sample


@pytest.mark.parametrize("order", [1, 2])
def test_step_moments_are_those_of_neighbouring_states(order, rng):
    slds = random_slds(2, order=order, rng=rng)
    y = sample(slds, 6, rng)[2]
    got = viterbi(slds, y)
    mean, cov, _ = given_path(slds, y, got.path)
    steps, n = got.step_moments(), 2 * slds.A.shape[-1]
    assert steps.mean.shape == (5, 1, n)
    for t in range(5):
        both = [t + 1, t]
        # The smoother's 1e-12 of the covariance, times a condition number below 1e3.
        assert_allclose(steps.mean[t, 0], mean[both].ravel(), atol=1e-9)
        assert_allclose(steps.cov[t, 0], cov[both][:, :, both].reshape(n, n), atol=1e-9)


def test_moments_given_the_switching_state_average_to_those_of_all(rng):
    slds = random_slds(2, rng=rng)
    exact = enumerated(slds, sample(slds, 4, rng)[2])
    steps, starts = exact.step_moments(), exact.start_moments()
    N = slds.A.shape[-1]
    # Averages of numbers near 1.
    assert_allclose(exact.prob[0] @ starts.mean, exact.states.mean[0], atol=1e-12)
    later = np.einsum("tk,tkn->tn", exact.prob[1:], steps.mean[..., :N])
    assert_allclose(later, exact.states.mean[1:], atol=1e-12)


def test_without_its_own_starts_a_posterior_gives_the_first_frame(rng):
    slds = random_slds(2, rng=rng)
    got = viterbi(slds, sample(slds, 3, rng)[2])
    assert_array_equal(got.start_moments().mean, got.states.mean[:1])
    assert_array_equal(got.start_moments().cov, got.states.cov[:1])


def test_one_frame_has_no_steps(rng):
    slds = random_slds(2, rng=rng)
    assert viterbi(slds, sample(slds, 1, rng)[2]).step_moments().mean.shape == (0, 1, 4)
