"""Forecasts against the joint Gaussian, sums over all paths and a filter pair by pair; what they may know."""

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian
from dynamics.motion import tasks
from dynamics.motion.noise import at_noise, at_process_noise, wider
from dynamics.motion.tasks import TOWARDS, forecasts, predict
from dynamics.region import POSE, drawn, regions
from tests.oracles import assert_gaussian, condition, enumerated, log_density, mixture, random_slds, sample


def ahead(slds, y, t, horizon):
    """The pose at t from the frames up to t - horizon exactly, by a sum over all paths."""
    known = np.vstack([y[: t - horizon + 1], np.full((horizon, y.shape[1]), np.nan)])
    states = enumerated(slds, known).states
    return Gaussian(slds.C @ states.mean[-1], slds.C @ states.cov[-1] @ slds.C.T)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("horizon", [1, 2, 5])
def test_a_forecast_of_one_state_is_that_of_the_joint_gaussian(order, horizon, rng):
    slds = random_slds(1, d=3, order=order, travelling=("b",), rng=rng)
    ys = [sample(slds, T, rng)[2] for T in (4, 9, 1)]
    ys[1][2, 0] = ys[1][0] = ys[1][5:7] = np.nan
    for y, got in zip(ys, forecasts(slds, ys, horizon), strict=True):
        assert got.mean.shape == (len(y) + horizon, 3)
        assert got.cov.shape == (len(y) + horizon, 3, 3)
        assert np.isnan(got.mean[:horizon]).all()
        assert np.isnan(got.cov[:horizon]).all()
        for t in range(horizon, len(y) + horizon):
            # Rounding in a dozen products.
            assert_gaussian(got[t], ahead(slds, y, t, horizon), atol=1e-10)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("horizon", [1, 3])
def test_forecasts_from_two_frames_are_exact(order, horizon, rng):  # nothing is collapsed before the third
    slds = random_slds(3, d=2, order=order, rng=rng)
    ys = [sample(slds, 2, rng)[2] for _ in range(4)]
    ys[1][0] = ys[2][1, 0] = ys[3][:] = np.nan
    for y, got in zip(ys, forecasts(slds, ys, horizon), strict=True):
        for t in (horizon, horizon + 1):
            assert_gaussian(got[t], ahead(slds, y, t, horizon), atol=1e-10)
        assert_array_equal(got.cov[horizon:], np.swapaxes(got.cov[horizon:], 1, 2))


def test_later_forecasts_are_nearly_those_of_all_paths(rng):
    off, wider = [], []
    for i in range(6):
        slds = random_slds(2, d=2, order=1 + i % 2, rng=rng)
        y = sample(slds, 5, rng)[2]
        (got,) = forecasts(slds, [y], 2)
        for t in (5, 6):
            want = ahead(slds, y, t, 2)
            off.append(np.abs(got.mean[t] - want.mean) / np.sqrt(np.diag(want.cov)))
            wider.append(np.diag(got.cov[t]) / np.diag(want.cov))
    # The filter collapses every frame's pairs. Measured over 60 models, of a forecast's own deviation: median
    # 3e-5, at most 0.024; of its variance at most 5 %.
    assert np.median(off) < 1e-3
    assert np.max(off) < 0.1
    assert_allclose(wider, 1.0, atol=0.15)


def naive_recurrent(slds, y, horizon):
    """Means (T, M) of the pose `horizon` frames on, by GPB2 with a recurrent switch, pair by pair."""
    reach, K = regions(slds), slds.K
    prob, means, covs = slds.pi0, slds.mean0, slds.cov0
    forecast = []
    for t in range(len(y)):
        if t > 0:
            prob, means, covs = naive_step(slds, reach, prob, means, covs, y[t])
        else:
            found = [condition(means[k], covs[k], slds.C, slds.R, y[0]) for k in range(K)]
            prob = prob * np.exp([f[2] for f in found])
            prob, means, covs = prob / prob.sum(), [f[0] for f in found], [f[1] for f in found]
        ahead = prob, means, covs
        for _ in range(horizon):
            ahead = naive_step(slds, reach, *ahead, np.full(len(slds.C), np.nan))
        forecast.append(slds.C @ np.tensordot(ahead[0], ahead[1], 1))
    return np.array(forecast)


def naive_step(slds, reach, prob, means, covs, y):
    K = slds.K
    joint, pairs = np.empty((K, K)), {}
    for j in range(K):
        led = [slds.A[i] @ means[j] + slds.b[i] for i in range(K)]
        seen = [log_density(reach.regard @ led[i], reach.mean[i], reach.cov[i]) for i in range(K)]
        switch = slds.Pi[j] * np.exp(POSE * np.array(seen))
        for i in range(K):
            cov = slds.A[i] @ covs[j] @ slds.A[i].T + slds.Q[i]
            mean, cov, log_lik = condition(led[i], cov, slds.C, slds.R, y)
            pairs[j, i] = mean, cov
            joint[j, i] = prob[j] * switch[i] / switch.sum() * np.exp(log_lik)
    joint /= joint.sum()
    share = joint / joint.sum(0)
    mixed = [mixture(share[:, i], *zip(*(pairs[j, i] for j in range(K)), strict=True)) for i in range(K)]
    return joint.sum(0), [one.mean for one in mixed], [one.cov for one in mixed]


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("horizon", [1, 3])
def test_a_recurrent_forecast_is_that_of_a_filter_pair_by_pair(order, horizon, rng):
    slds = random_slds(3, d=3, order=order, travelling=("b",), rng=rng)
    ys = [sample(slds, T, rng)[2] for T in (7, 3)]
    ys[0][4] = np.nan
    found, papers = forecasts(slds, ys, horizon, recurrent=True), forecasts(slds, ys, horizon)
    for y, got, other in zip(ys, found, papers, strict=True):
        assert_allclose(got.mean[horizon:], naive_recurrent(slds, y, horizon), atol=1e-9)
        assert np.abs(other.mean[-1] - got.mean[-1]).max() > 1e-3


@pytest.mark.parametrize("horizon", [1, 3])
def test_no_forecast_knows_what_comes(horizon, rng):
    slds = random_slds(2, order=2, noise=0.05, rng=rng)
    y = sample(slds, 50, rng)[2] + 0.2 * rng.normal(size=(50, 2))
    other = sample(slds, 20, rng)[2]
    (whole, _) = predict(slds, [y, other], horizon)
    for known in (4, 15, 46):
        later = y.copy()
        later[known:] = 3.0 * rng.normal(size=later[known:].shape)
        (got, _) = predict(slds, [later, other], horizon)
        assert_array_equal(got.mean[: known + horizon], whole.mean[: known + horizon])
        assert_array_equal(got.cov[horizon : known + horizon], whole.cov[horizon : known + horizon])
        assert np.abs(got.mean[known + horizon] - whole.mean[known + horizon]).max() > 1e-6


def test_forecasts_go_by_the_noise_of_the_frames_before(rng):
    slds = random_slds(2, order=2, noise=0.05, rng=rng)
    ys = [sample(slds, T, rng)[2] + 0.2 * rng.normal(size=(T, 2)) for T in (60, 20, 3)]
    got = predict(slds, ys, 2)
    own = drawn(wider(slds), TOWARDS)
    for known, until in ((0, 5), (5, 15), (15, 45), (45, 60)):
        before = [y[:known] for y in ys]
        fitted = at_process_noise(at_noise(own, before), before) if known else own
        for one, want in zip(got, forecasts(fitted, ys, 2, recurrent=True), strict=True):
            rows = slice(known + 2, until + 2)
            # The same operations, in batches of other lengths.
            assert_gaussian(one[rows], want[rows], atol=1e-12)


def test_a_forecast_is_made_once_from_every_frame(rng, monkeypatch):
    slds, steps, one_on = random_slds(2, order=2, noise=0.05, rng=rng), [], tasks._switched
    y = sample(slds, 60, rng)[2]
    monkeypatch.setattr(tasks, "_switched", lambda *of: steps.append(len(of[1])) or one_on(*of))
    predict(slds, [y], 7)
    assert sum(steps) == 7 * len(y)


def test_forecasts_take_the_memory_of_what_they_return(rng):
    slds = random_slds(6, d=3, order=2, rng=rng)
    y = sample(slds, 4000, rng)[2]
    tasks.forecasts(slds, [y[:2]])  # what is compiled stays
    tracemalloc.start()
    try:
        ahead = tasks.forecasts(slds, [y])[0]
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 8 * (ahead.mean.nbytes + ahead.cov.nbytes)
