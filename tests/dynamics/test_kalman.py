"""The Kalman equations against conditioning of the joint Gaussian."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import multivariate_normal

from dynamics.gaussian import Gaussian
from dynamics.kalman import log_likelihood, predict, reverse, smooth, update, update_information
from dynamics.slds import constant_velocity
from tests.oracles import assert_gaussian, condition, given_path, random_covariance, random_slds, sample

N, M = 4, 3


def problem(rng):
    prior = Gaussian(rng.normal(size=N), random_covariance(N, rng))
    return prior, rng.normal(size=M), rng.normal(size=(M, N)), random_covariance(M, rng)


def filter_and_smooth(slds, y):
    """One switching state; means, covariances and lag covariances given all frames, and log p(y)."""
    A, b, Q = slds.A[0], slds.b[0], slds.Q[0]
    beliefs, total = [], 0.0
    for t in range(len(y)):
        prior = slds.start[0] if t == 0 else predict(beliefs[-1], A, b, Q)
        belief, log_lik = update(prior, y[t], slds.C, slds.R)
        beliefs.append(belief)
        total += float(log_lik)
    smoothed, lags = [beliefs[-1]], []
    for belief in reversed(beliefs[:-1]):
        one, lag = smooth(belief, smoothed[0], A, b, Q)
        smoothed.insert(0, one)
        lags.insert(0, lag)
    return np.stack([s.mean for s in smoothed]), np.stack([s.cov for s in smoothed]), np.array(lags), total


@pytest.mark.parametrize("missing", [[], [0], [1], [0, 2], [0, 1, 2]])
def test_update_is_conditioning_the_joint_gaussian_on_what_was_seen(missing, rng):
    prior, y, C, R = problem(rng)
    y[missing] = np.nan
    seen = ~np.isnan(y)
    mean, cov, log_p = condition(prior.mean, prior.cov, C[seen], R[np.ix_(seen, seen)], y[seen])
    posterior, log_lik = update(prior, y, C, R)
    # S has a condition number below 1e3: rounding 2e-16 * 1e3, and some room.
    assert_gaussian(posterior, Gaussian(mean, cov), atol=1e-11)
    assert float(log_lik) == pytest.approx(log_p, rel=1e-11, abs=1e-12)


def test_the_innovations_likelihood_is_its_density_and_reads_the_lower_triangle_only(rng):
    S, e = random_covariance(M, rng), rng.normal(size=M)
    spoiled = np.tril(S) + np.triu(rng.normal(size=(M, M)), 1)
    want = multivariate_normal(np.zeros(M), S).logpdf(e)
    assert float(log_likelihood(e, spoiled, np.array(M))) == pytest.approx(want, rel=1e-12)
    # What one of the two has more of is shared by the other.
    assert_allclose(log_likelihood(np.stack([e, e]), S, M), [want, want], rtol=1e-12)
    assert_allclose(log_likelihood(e, np.stack([[S], [S]]), M), [[want], [want]], rtol=1e-12)


def test_a_measurement_of_nothing_is_certain_and_tells_nothing(rng):
    prior = Gaussian(rng.normal(size=(2, 3)), np.stack([random_covariance(3, rng) for _ in range(2)]))
    after, log_p = update(prior, np.empty(0), np.empty((0, 3)), np.empty((2, 0, 0)))
    assert_gaussian(after, prior, atol=1e-12)
    assert_array_equal(log_p, np.zeros(2))


def test_an_innovation_of_any_size_has_a_likelihood(rng):
    S = random_covariance(M, rng)
    e = 1e50 * rng.normal(size=M)
    assert float(log_likelihood(e, S, M)) == pytest.approx(-0.5 * e @ np.linalg.solve(S, e), rel=1e-12)


def test_information_updates_like_its_inverse_covariance(rng):
    prior, y, C, R = problem(rng)
    information = np.linalg.inv(R)
    want, _ = update(prior, y, C, R)
    got = update_information(prior, C, information, information @ y)
    assert_gaussian(got, want, atol=1e-11)  # condition numbers below 1e3


def test_directions_without_information_keep_their_prior(rng):
    prior = Gaussian(rng.normal(size=M), 2.0 * np.eye(M))  # seen and unseen are independent before
    seen = np.array([0.6, 0.8, 0.0])
    unseen = np.array([[0.8, -0.6, 0.0], [0.0, 0.0, 1.0]])
    got = update_information(prior, np.eye(M), 50.0 * np.outer(seen, seen), 50.0 * 0.3 * seen)
    # Exact but for the rounding of an orthogonal basis.
    assert_allclose(unseen @ got.mean, unseen @ prior.mean, atol=1e-14)
    assert_allclose(unseen @ got.cov @ unseen.T, 2.0 * np.eye(2), atol=1e-14)
    # Precisions add: 1/2 + 50.
    assert seen @ got.cov @ seen == pytest.approx(1.0 / 50.5, rel=1e-12)
    assert seen @ got.mean == pytest.approx((50.0 * 0.3 + 0.5 * seen @ prior.mean) / 50.5, rel=1e-12)


def test_the_way_back_is_the_earlier_state_given_the_later(rng):
    filtered, later = problem(rng)[0], rng.normal(size=N)
    A, b, Q = rng.normal(size=(N, N)), rng.normal(size=N), random_covariance(N, rng)
    mean, cov, _ = condition(filtered.mean, filtered.cov, A, Q, later - b)
    back = reverse(filtered, A, b, Q)
    known = Gaussian(later, np.zeros((N, N)))
    # The predicted covariance is raised by 1e-12 of its size; its inverse may be 1e3 larger.
    assert_gaussian(back.step(known), Gaussian(mean, cov), atol=1e-9)
    assert_array_equal(back.lag(known.cov), np.zeros((N, N)))
    # The law of total covariance, with x_{t+1} = x_t' said to spread by P: cov + gain P gain', P gain'.
    P = random_covariance(N, rng)
    assert_allclose(back.step(Gaussian(later, P)).cov, cov + back.gain @ P @ back.gain.T, atol=1e-9)
    assert_allclose(back.lag(P), P @ back.gain.T, atol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("gaps", [False, True])
def test_filter_and_smoother_are_conditioning_the_joint_gaussian(order, gaps, rng):
    slds = random_slds(1, order=order, rng=rng)
    y = sample(slds, 7, rng)[2]
    if gaps:
        y[0], y[3:5], y[6, 1] = np.nan, np.nan, np.nan
    mean, cov, log_p = given_path(slds, y, [0] * 7)
    got_mean, got_cov, got_lag, got_log_p = filter_and_smooth(slds, y)
    # The smoother raises the predicted covariance by 1e-12 of its size; its inverse may be 1e3 larger.
    assert_allclose(got_mean, mean, atol=1e-9)
    assert_allclose(got_cov, [cov[t, :, t] for t in range(7)], atol=1e-9)
    assert_allclose(got_lag, [cov[t + 1, :, t] for t in range(6)], atol=1e-9)
    assert got_log_p == pytest.approx(log_p, rel=1e-11)


def test_many_beliefs_at_once_are_each_on_its_own(rng):
    B, K = 3, 2
    mean, cov = rng.normal(size=(B, K, N)), np.stack([[random_covariance(N, rng)] * K for _ in range(B)])
    A, b = rng.normal(size=(K, N, N)), rng.normal(size=(K, N))
    Q = np.stack([random_covariance(N, rng) for _ in range(K)])
    y, C, R = rng.normal(size=(B, 1, M)), rng.normal(size=(M, N)), random_covariance(M, rng)
    y[1, 0, 2] = np.nan
    y[2] = np.nan
    filtered = Gaussian(mean, cov)
    ahead = predict(filtered, A, b, Q)
    updated, log_lik = update(ahead, y, C, R)
    smoothed, lag = smooth(filtered, updated, A, b, Q)
    for n, k in np.ndindex(B, K):
        one = predict(filtered[n, k], A[k], b[k], Q[k])
        one_updated, one_log_lik = update(one, y[n, 0], C, R)
        one_smoothed, one_lag = smooth(filtered[n, k], one_updated, A[k], b[k], Q[k])
        # The same operations; the linear algebra library may sum in another order.
        for got, want in ((ahead, one), (updated, one_updated), (smoothed, one_smoothed)):
            assert_gaussian(got[n, k], want, atol=1e-12)
        assert float(log_lik[n, k]) == pytest.approx(float(one_log_lik), rel=1e-12, abs=1e-12)
        assert_allclose(lag[n, k], one_lag, atol=1e-12)


def test_the_same_where_prior_and_measurement_lie_askew(rng):
    P, R = 1e10 * random_covariance(3, rng), 1e-8 * random_covariance(3, rng)
    posterior, _ = update(Gaussian(np.zeros(3), P), np.ones(3), np.eye(3), R)
    # (P^-1 + R^-1)^-1, where P^-1 is 1e-18 of R^-1. P - gain S gain' would be wrong by 1e10 * 2e-16 > R.
    assert_allclose(posterior.cov, R, rtol=1e-6)


def test_smoothing_does_not_fail_when_the_velocity_is_known_exactly():
    slds = constant_velocity(("x", "hip"), noise=[1e-10, 0.0], spread=[0.0, 0.0], fps=30.0)
    mean, cov, _, _ = filter_and_smooth(slds, np.tile([0.5, 0.2], (30, 1)))
    # A pose that stands still, seen 30 times with variance 1e-4 and once by the prior with variance 1.
    assert_allclose(mean, np.tile([0.5, 0.2], (30, 2)) * 30.0 / 30.0001, atol=1e-6)
    assert_allclose(cov[:, 0, 0], 1e-4 / 30.0001, rtol=1e-3)


def test_update_refuses_a_measurement_that_cannot_be(rng):
    prior = Gaussian(np.zeros(2), np.zeros((2, 2)))
    with pytest.raises(np.linalg.LinAlgError):
        update(prior, np.zeros(2), np.eye(2), np.zeros((2, 2)))
