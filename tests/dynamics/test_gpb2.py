"""GPB2 against the sum over all paths, and against its own equations in plain loops."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.frames import in_batches
from dynamics.gaussian import Gaussian, collapse
from dynamics.gpb2 import gpb2_all, switching_all
from dynamics.gpb2_filter import gpb2_filter, run_filter
from tests.oracles import (
    SMOOTHED,
    assert_gaussian,
    assert_given_path,
    condition,
    drawn,
    enumerated,
    given_path,
    mixture,
    random_slds,
    single,
    sum_over_paths,
)

gpb2 = single(gpb2_all)


def plain(slds, y, hints):
    """The equations one pair at a time, with inverses and probabilities: filter, then smoother.

    Returns log evidence, filtered and smoothed probabilities, and pairs (T-1, K, K); given each s_t, the
    smoothed mean and cov of x_t, and of [x_t; x_{t-1}].
    """
    T, K, C = len(y), slds.K, slds.C
    mu, x, P, Ws, log_evidence = [], [], [], [], 0.0
    for t in range(T):
        log_p, means, covs = np.empty((K, K)), {}, {}
        for i in range(K):
            for j in range(K):
                m, V = slds.mean0[i], slds.cov0[i]
                before = slds.log_pi0[i] - np.log(K)
                if t > 0:
                    m = slds.A[i] @ x[t - 1][j] + slds.b[i]
                    V = slds.A[i] @ P[t - 1][j] @ slds.A[i].T + slds.Q[i]
                    before = np.log(slds.Pi[j, i]) + np.log(mu[t - 1][j])
                means[i, j], covs[i, j], log_lik = condition(m, V, C, slds.R, y[t])
                log_p[i, j] = log_lik + before + hints[t, i]
        p = np.exp(log_p)
        log_evidence += np.log(p.sum())
        mu.append(p.sum(1) / p.sum())
        W = p / p.sum(1, keepdims=True)
        Ws.append(W)
        mixed = [
            mixture(W[i], [means[i, j] for j in range(K)], [covs[i, j] for j in range(K)]) for i in range(K)
        ]
        x.append([one.mean for one in mixed])
        P.append([one.cov for one in mixed])
    prob, xs, Ps = [mu[-1]], x[-1], P[-1]
    states, pairs, steps = [(xs, Ps)], [], []
    for t in range(T - 2, -1, -1):
        U, means, covs, lags = Ws[t + 1], {}, {}, {}
        for k in range(K):
            for j in range(K):
                A, b, Q = slds.A[k], slds.b[k], slds.Q[k]
                ahead, V = A @ x[t][j] + b, A @ P[t][j] @ A.T + Q
                J = P[t][j] @ A.T @ np.linalg.inv(V)
                means[k, j] = x[t][j] + J @ (xs[k] - ahead)
                covs[k, j] = P[t][j] + J @ (Ps[k] - V) @ J.T
                lags[k, j] = Ps[k] @ J.T
        steps.append(
            [
                mixture(
                    U[k],
                    [np.append(xs[k], means[k, j]) for j in range(K)],
                    [np.block([[Ps[k], lags[k, j]], [lags[k, j].T, covs[k, j]]]) for j in range(K)],
                )
                for k in range(K)
            ]
        )
        pair = (prob[-1][:, None] * U).T
        pairs.append(pair)
        prob.append(pair.sum(1))
        w = pair / pair.sum(1, keepdims=True)
        mixed = [
            mixture(w[j], [means[k, j] for k in range(K)], [covs[k, j] for k in range(K)]) for j in range(K)
        ]
        xs, Ps = [one.mean for one in mixed], [one.cov for one in mixed]
        states.append((xs, Ps))
    return log_evidence, np.array(mu), np.array(prob[::-1]), pairs[::-1], states[::-1], steps[::-1]


def papers_smoother(slds, filtered):
    """Pr(s_t) (T, K) given all frames, from that given the frames so far: pairs are weighed by Pi alone."""
    prob = [filtered[-1]]
    for before in filtered[-2::-1]:
        U = slds.Pi * before[:, None]
        prob.append((U / U.sum(0)) @ prob[-1])
    return np.array(prob[::-1])


def apart(prob, exact):
    """Mean total variation of Pr(s_t)."""
    return 0.5 * np.abs(prob - exact.prob).sum(1).mean()


# The equations


def test_how_many_rows_are_worked_on_at_a_time_changes_nothing(rng, monkeypatch):
    slds = random_slds(3, order=2, rng=rng)
    ys = [drawn(slds, T, rng, gaps=True) for T in (23, 9)]

    def smoothed(rows):
        monkeypatch.setattr("dynamics.gpb2_filter.ROWS", rows)
        return gpb2_all(slds, ys)

    for whole, parts in zip(smoothed(1000), smoothed(5), strict=True):
        assert whole.log_evidence == parts.log_evidence
        assert_array_equal(whole.states.mean, parts.states.mean)
        assert_array_equal(whole.prob, parts.prob)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("gaps", [False, True])
def test_it_is_its_own_equations_one_pair_at_a_time(order, gaps, rng):
    slds = random_slds(3, order=order, rng=rng)
    slds = replace(slds, C=slds.C + 0.3 * rng.normal(size=slds.C.shape))  # measures no freedom by itself
    y, hints = drawn(slds, 9, rng, gaps=gaps), rng.normal(size=(9, 3))
    log_evidence, filtered, prob, pairs, states, steps = plain(slds, y, hints)
    got = gpb2(slds, y, hints)
    assert got.log_evidence == pytest.approx(log_evidence, rel=1e-11)
    [forward] = in_batches(slds, [y], [hints], lambda frames: [run_filter(slds, frames)])
    assert_allclose(np.exp(forward.log_prob), filtered, atol=1e-11)  # rounding over 9 frames
    assert_allclose(got.prob, prob, atol=SMOOTHED)
    assert_allclose(got.pair, pairs, atol=SMOOTHED)
    starts, moments = got.start_moments(), got.step_moments()
    for k in range(3):
        assert_gaussian(starts[k], Gaussian(states[0][0][k], states[0][1][k]), atol=SMOOTHED)
        for t in range(8):
            assert_gaussian(moments[t, k], steps[t][k], atol=SMOOTHED)
            assert_allclose(moments.mean[t, k, : 2 * order], states[t + 1][0][k], atol=SMOOTHED)
    for t in range(9):
        assert_gaussian(got.states[t], mixture(prob[t], *states[t]), atol=SMOOTHED)
    # The moments of steps average to those of neighbouring states.
    lag = collapse(got.prob[1:], moments).cov[:, : 2 * order, 2 * order :]
    assert_allclose(lag, got.lag, atol=1e-12)
    assert_array_equal(got.path, prob.argmax(1))


# Against the sum over all paths


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("gaps", ["none", "entries", "first", "last"])
def test_two_frames_are_exact(order, gaps, rng):  # nothing is collapsed before the second frame
    for _ in range(5):
        slds = random_slds(3, order=order, rng=rng)
        y = drawn(slds, 2, rng, gaps=gaps == "entries")
        if gaps in ("first", "last"):
            y[0 if gaps == "first" else 1] = np.nan
        got, want = gpb2(slds, y), enumerated(slds, y)
        assert got.log_evidence == pytest.approx(want.log_evidence, rel=1e-12, abs=1e-13)
        assert_allclose(got.prob, want.prob, atol=1e-12)
        assert_gaussian(got.states[1], want.states[1], atol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_over_many_problems_it_is_closer_to_the_exact_posterior_than_the_papers_smoother(order, rng):
    far, papers, gaps = [], [], []
    for _ in range(25):
        slds = random_slds(2, order=order, noise=0.05, rng=rng)
        y = drawn(slds, 6, rng)
        exact, got = enumerated(slds, y), gpb2(slds, y)
        far.append(apart(got.prob, exact))
        papers.append(apart(papers_smoother(slds, np.exp(gpb2_filter(slds, y).log_prob)), exact))
        gaps.append(abs(got.log_evidence - exact.log_evidence))
    # Measured over 320 problems, noise 0.05 to 1: means up to 0.021, and 0.036 for the papers'.
    assert np.mean(far) < np.mean(papers)
    assert np.mean(far) < 0.002
    assert np.median(gaps) < 1e-4
    assert max(gaps) < 0.02


# The switching states alone


@pytest.mark.parametrize("order", [1, 2])
def test_the_switching_states_alone_are_those_of_the_smoother(order, rng):
    slds = random_slds(4, order=order, rng=rng)
    ys = [drawn(slds, T, rng, gaps=T % 2 == 0) for T in (5, 1, 60, 2, 33)]
    hints = [rng.normal(size=(len(y), 4)) for y in ys]
    for got, want in zip(switching_all(slds, ys, hints), gpb2_all(slds, ys, hints), strict=True):
        assert_allclose(got.prob, want.prob, atol=1e-11)  # one sums probabilities, the other in logs
        assert_array_equal(got.path, want.path)


def test_a_freedom_that_nobody_measured_is_as_good_as_not_there(rng):
    slds = random_slds(3, order=2, rng=rng)
    y = drawn(slds, 20, rng)
    y[:, 0] = np.nan
    seen = np.vstack([y, [[0.0, 0.0]]])  # a last frame with both: every row's entries are looked at
    want = gpb2_filter(slds, seen)
    got = gpb2_filter(slds, y)
    assert_allclose(np.exp(got.log_prob), np.exp(want.log_prob[:-1]), atol=1e-12)
    assert_allclose(got.states.cov, want.states.cov[:-1], atol=1e-12)
    assert_allclose(got.log_evidence, want.log_evidence[:-1], atol=1e-11)


# What cannot be, and what can hardly be


def test_probabilities_that_underflow_leave_the_weights_right(rng):
    # 40 frames speak for state 0 with 100 nats each; then only state 1 is left, which none may enter.
    slds = random_slds(2, rng=rng)
    slds = replace(slds, Pi=[[1.0, 0.0], [0.0, 1.0]])
    y, hints = drawn(slds, 41, rng), np.zeros((41, 2))
    hints[:40, 1], hints[40, 0] = -100.0, -1e6
    got = gpb2(slds, y, hints)
    log_p = given_path(slds, y, [1] * 41)[2]
    assert got.log_evidence == pytest.approx(log_p - 4000.0, rel=1e-11)
    assert_allclose(got.prob[:, 1], 1.0, atol=1e-12)
    assert_given_path(replace(got, log_evidence=log_p), slds, y, [1] * 41)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("noise", [1e-8, 1e8])
def test_noise_far_from_the_size_of_the_prior_is_survived(order, noise, rng):
    slds = random_slds(3, order=order, noise=noise, rng=rng)
    y = drawn(slds, 60, rng)
    y[20:25] = np.nan
    got = gpb2(slds, y)
    assert np.isfinite(got.log_evidence)
    # At second order the pose at t stands in both x_{t+1} and x_t, equal but for 1e-12 of how far poses move:
    # where that is 1 and a deviation is 1e-8, a variance is off by (1e-12 / 1e-8)^2 of itself.
    for cov, rounding in ((got.states.cov, 1e-14), (got.steps.cov, 1e-7)):
        values = np.linalg.eigvalsh(cov)
        assert (values[..., 0] / values[..., -1]).min() > -rounding


@pytest.mark.parametrize("r", [1e-2, 1e-7, 1e-12, 1e-16])
def test_poses_measured_almost_exactly_are_known_as_exactly(r, rng):
    # At second order the pose before is far less sure than r, and no two states agree on how much.
    slds = replace(random_slds(3, order=2, rng=rng), R=r * np.eye(2))
    y = drawn(slds, 40, rng)
    y[15:25] = np.nan
    filtered, got = gpb2_filter(slds, y), gpb2(slds, y)
    seen = ~np.isnan(y[:, 0])
    variances = np.linalg.eigvalsh(filtered.states.cov[seen][:, :, :2, :2])
    # The prior's variance is 0.01 or more, so what it adds to a measurement's is below r / 0.01 of that.
    assert variances.min() > r * (1.0 - 100.0 * r) * 0.3
    # Where the states disagree on the pose, its spread adds a share of that.
    assert variances.max() < r * (1.0 + 10.0 * r + 1e-6)
    assert np.linalg.eigvalsh(got.states.cov).min() > -1e-12
    assert np.abs(got.states.mean[:, :2] - y)[seen].max() < 6.0 * np.sqrt(r)
    short = gpb2_filter(slds, y[:2])
    assert short.log_evidence.sum() == pytest.approx(sum_over_paths(slds, y[:2]), rel=1e-6)


def test_a_frame_at_which_no_state_can_be_is_named(rng):
    slds, hints = random_slds(2, rng=rng), np.zeros((5, 2))
    hints[3] = -np.inf
    with pytest.raises(ValueError, match="no switching state is possible at frame 3"):
        gpb2(slds, drawn(slds, 5, rng), hints)
