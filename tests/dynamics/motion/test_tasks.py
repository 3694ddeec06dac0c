"""Classification, prediction and synthesis against sums over all paths, the joint Gaussian and scipy."""

import tracemalloc
from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import solve_discrete_lyapunov

from dynamics.gaussian import Gaussian
from dynamics.gpb2 import gpb2_all, switching_all
from dynamics.motion import tasks
from dynamics.motion.noise import (
    FACTORS,
    SEARCHES,
    STRANGER,
    among_strangers,
    at_noise,
    at_process_noise,
    wider,
)
from dynamics.motion.tasks import (
    CLASSIFY_TICKS,
    TOWARDS,
    classify,
    classify_hmm,
    forecasts,
    predict,
    predict_ticks,
    synthesise,
)
from dynamics.region import POSE, drawn, pose_hints, regions
from dynamics.slds import combine
from dynamics.variational import variational_all
from dynamics.viterbi import viterbi_all
from tests.dynamics.hmms import enumerated as enumerated_hmm
from tests.dynamics.hmms import random_hmm
from tests.oracles import (
    all_paths,
    assert_gaussian,
    condition,
    enumerated,
    given_path,
    log_density,
    random_slds,
    sample,
)


def named(slds, *labels):
    return replace(slds, labels=labels)


# Classification


def two_motions(rng, *, order=2, noise=0.3):
    """A walk of two states and a run of one, whose first frames fall into their regions."""
    walk = named(random_slds(2, d=3, order=order, travelling=("b",), noise=noise, rng=rng), "walk", "walk")
    run = named(random_slds(1, d=3, order=order, travelling=("b",), noise=noise, rng=rng), "run")
    return combine([walk, replace(run, R=walk.R)], crossing=0.05)


def quiet(slds, T, rng):
    """A sequence of the model's own with nothing of its measurement noise, so that it keeps its own R."""
    return sample(slds, T, rng)[1] @ slds.C.T


def exactly(slds, ys, hints):
    """Exact inference with hints, by a sum over all paths; only prob and path."""

    found, hints = [], [np.zeros((len(y), slds.K)) for y in ys] if hints is None else hints
    for y, hint in zip(ys, hints, strict=True):
        paths, log_p = all_paths(slds, y)
        log_p = log_p + hint[np.arange(len(y)), paths].sum(1)
        weights = np.exp(log_p - np.logaddexp.reduce(log_p))
        prob = np.tensordot(weights, np.eye(slds.K)[paths], 1)
        found.append(SimpleNamespace(prob=prob, path=paths[weights.argmax()]))
    return found


def spoken_for(slds, y, weight):
    """(T, K) the pose's term by its definition: what of a and c was measured, b travels."""
    hints = np.zeros((len(y), slds.K))
    for t, k in product(range(len(y)), range(slds.K)):
        seen = [i for i in (0, 2) if not np.isnan(y[t, i])]
        if seen:
            mean, cov = slds.C @ slds.mean0[k], slds.C @ slds.cov0[k] @ slds.C.T + slds.R
            hints[t, k] = weight * log_density(y[t, seen], mean[seen], cov[np.ix_(seen, seen)])
    return hints


@pytest.mark.parametrize("weight", [None, 0.0, 2.0])
def test_motions_are_as_probable_as_their_states_together(weight, rng):
    slds = two_motions(rng)
    ys = [quiet(slds, T, rng) for T in (5, 1, 4)]
    ys[0][2, 0] = ys[2][1] = ys[2][:, 1] = np.nan
    options = {} if weight is None else {"pose": weight}
    got = classify(slds, ys, infer=exactly, **options)
    noisy = among_strangers(at_noise(slds, ys))
    for y, labelling in zip(ys, got, strict=True):
        (want,) = exactly(noisy, [y], [spoken_for(noisy, y, 0.5 if weight is None else weight)])
        shares = np.column_stack([want.prob[:, :2].sum(1), want.prob[:, 2]])
        assert_allclose(labelling.prob, shares, atol=1e-9)
        assert_allclose(labelling.prob.sum(1), 1.0, atol=1e-12)
        assert labelling.label == tuple(("walk", "run")[m] for m in shares.argmax(1))
        assert_array_equal(labelling.state, want.path)


@pytest.mark.parametrize("infer", [viterbi_all, gpb2_all, variational_all])
def test_without_the_poses_term_classification_is_plain_inference(infer, rng):
    slds = two_motions(rng)
    ys = [quiet(slds, T, rng) for T in (20, 12)]
    plain = infer(among_strangers(at_noise(slds, ys)), ys)
    found = classify(slds, ys, infer=infer, pose=0.0)
    for labelling, posterior in zip(found, plain, strict=True):
        assert_array_equal(labelling.state, posterior.path)
        assert_allclose(labelling.prob[:, 1], posterior.prob[:, 2], atol=1e-15)
    if infer is viterbi_all:
        assert set(np.unique(labelling.prob)) <= {0.0, 1.0}


def test_sequences_noisier_than_the_model_are_classified_with_their_noise(rng):
    slds = two_motions(rng, noise=0.05)
    ys = [
        y + [0.3, 0.0, 0.3] * rng.normal(size=y.shape) for y in (sample(slds, 30, rng)[2] for _ in range(6))
    ]
    noisy = at_noise(slds, ys)
    assert noisy.R[0, 0] > 10.0 * slds.R[0, 0]
    wide = among_strangers(noisy)
    plain = gpb2_all(wide, ys, [pose_hints(wide, y) for y in ys])
    for got, want in zip(classify(slds, ys), plain, strict=True):
        assert_allclose(got.prob[:, 1], want.prob[:, 2], atol=1e-11)
    assert np.abs(got.prob[:, 1] - gpb2_all(slds, ys)[-1].prob[:, 2]).max() > 0.01


def test_who_was_not_learned_from_is_allowed_ten_degrees_in_what_stays(rng):
    slds = two_motions(rng)
    raised = among_strangers(slds)
    want = slds.R + np.diag([np.radians(10.0) ** 2, 0.0, np.radians(10.0) ** 2])
    assert_allclose(raised.R, want, atol=1e-16)
    assert_array_equal(raised.Q, slds.Q)


@pytest.mark.parametrize("infer", [viterbi_all, switching_all, variational_all])
def test_a_walk_that_turns_into_a_run_is_told_from_it(infer, rng):
    walk, run = (settled(random_slds(1, noise=0.2, rng=rng)) for _ in range(2))
    run = settled(replace(run, b=run.b + np.array([1.0, -1.0]), R=walk.R))
    slds = combine([named(walk, "walk"), named(run, "run")], crossing=0.01)
    ys = [np.vstack([sample(one, 40, rng)[2] for one in pair]) for pair in ((walk, run), (run, walk))]
    for (first, second), got in zip(
        (("walk", "run"), ("run", "walk")), classify(slds, ys, infer=infer), strict=True
    ):
        assert got.labels == ("walk", "run")
        right = [label == want for label, want in zip(got.label, [first] * 40 + [second] * 40, strict=True)]
        # The two come to rest several deviations apart; around the join the model may be in doubt.
        assert all(right[:36] + right[44:])


def test_labels_of_a_hidden_markov_model_are_those_of_all_its_paths(rng):
    hmm = replace(random_hmm(3, rng), labels=("run", "walk", "run"))
    ys = [rng.normal(size=(T, 2)) for T in (5, 1)]
    ys[0][1] = ys[0][3, 0] = np.nan
    for y, labelling in zip(ys, classify_hmm(hmm, ys), strict=True):
        prob, _, _, path = enumerated_hmm(hmm, y)
        assert labelling.labels == ("run", "walk")
        assert_allclose(labelling.prob, np.column_stack([prob[:, 0] + prob[:, 2], prob[:, 1]]), atol=1e-12)
        assert labelling.label == tuple(("run", "walk")[m] for m in labelling.prob.argmax(1))
        assert tuple(labelling.state) == path


# The noise


def added(slds, noisy):
    """(M,) standard deviations of what was added to R, which must be nothing but variances."""
    more = noisy.R - slds.R
    assert_allclose(more, np.diag(np.diag(more)), atol=1e-15)
    return np.sqrt(np.diag(more))


def log_density_at(slds, y, added):
    """log p(y) of a one-state model with each of these standard deviations of noise added, by the joint."""
    T, seen = len(y), ~np.isnan(y.ravel())
    x, P, _ = given_path(slds, np.full_like(y, np.nan), [0] * T)
    H, noise = np.kron(np.eye(T), slds.C)[seen], np.kron(np.eye(T), slds.R)[np.ix_(seen, seen)]
    S = H @ P.reshape(x.size, x.size) @ H.T + noise
    return log_density(y.ravel()[seen], H @ x.ravel(), S + added[:, None, None] ** 2 * np.eye(len(S)))


@pytest.mark.parametrize("order", [1, 2])
def test_the_noise_of_one_state_is_the_likeliest_by_the_joint_gaussian(order, rng):
    slds = random_slds(1, d=2, order=order, noise=0.05, rng=rng)
    ys = [y + 0.1 * rng.normal(size=y.shape) for y in (sample(slds, 12, rng)[2] for _ in range(3))]
    ys[1][3:5] = ys[0][0, 0] = np.nan
    tried = np.arange(0.0, 0.3, 1e-3)
    values = sum(log_density_at(slds, y, tried) for y in ys)
    # The search stops within 5 %, the grid is half a step off.
    assert_allclose(added(slds, at_noise(slds, ys)), tried[int(np.argmax(values))], rtol=0.05, atol=5e-4)


@pytest.mark.parametrize(("stays", "travels"), [(0.4, 0.0), (0.1, 0.1), (0.03, 0.3)])
def test_added_noise_is_found_again(stays, travels, rng):
    slds = two_motions(rng, noise=0.03)
    ys = [
        y + [stays, travels, stays] * rng.normal(size=y.shape)
        for y in (sample(slds, 40, rng)[2] for _ in range(12))
    ]
    for y in ys:
        y[rng.random(len(y)) < 0.1] = np.nan
    found = added(slds, at_noise(slds, ys))
    assert found[0] == pytest.approx(found[2], rel=1e-12)
    # 900 numbers tell it to 3 % where it is above the model's own; then the dynamics take some for motion.
    assert found[0] == pytest.approx(stays, rel=0.15)
    assert found[1] == pytest.approx(travels, rel=0.15, abs=0.02)


def test_a_model_that_meets_no_more_noise_than_its_own_keeps_it(rng):
    slds = random_slds(2, noise=0.3, rng=rng)
    smooth = np.zeros((40, 2))
    assert at_noise(slds, [smooth]) is slds
    assert at_noise(slds, [np.full((5, 2), np.nan)]) is slds


def test_more_noise_than_half_a_radian_is_not_believed(rng):
    slds = random_slds(1, noise=0.03, rng=rng)
    ys = [y + 1.5 * rng.normal(size=y.shape) for y in (sample(slds, 40, rng)[2] for _ in range(6))]
    assert_allclose(added(slds, at_noise(slds, ys)), 0.5, rtol=0.05)  # what the search stops within


def test_a_place_that_was_not_measured_keeps_its_noise(rng):
    slds = two_motions(rng, noise=0.03)
    y = sample(slds, 200, rng)[2] + [0.1, 0.0, 0.1] * rng.normal(size=(200, 3))
    y[:, 1] = np.nan
    found = added(slds, at_noise(slds, [y]))
    assert found[1] == 0.0
    assert found[0] == pytest.approx(0.1, rel=0.2)


def test_more_sequences_than_needed_are_thinned_evenly(rng):
    slds = random_slds(1, noise=0.03, rng=rng)
    every = [sample(slds, 100, rng)[2] for _ in range(45)]
    loud = [y + 0.2 * rng.normal(size=y.shape) for y in every]
    # Of 4,500 frames 1,500 are enough: every third sequence.
    others = [every[n] if n % 3 == 1 else y for n, y in enumerate(loud)]
    thirds = [loud[n] if n % 3 == 1 else y for n, y in enumerate(every)]
    assert_allclose(added(slds, at_noise(slds, others)), 0.0, atol=0.02)
    assert_allclose(added(slds, at_noise(slds, thirds)), 0.2, rtol=0.1)
    # Short ones between long ones do not stand for these.
    long = sample(slds, 1500, rng)[2]
    long += 0.2 * rng.normal(size=long.shape)
    assert_allclose(added(slds, at_noise(slds, [every[0], long, every[1], long])), 0.2, rtol=0.1)


@pytest.mark.parametrize("factor", [0.5, 1.0, 4.0])
def test_the_factor_of_the_process_noise_is_found_again(factor, rng):
    slds = random_slds(2, d=3, order=2, noise=0.05, rng=rng)
    lively = replace(slds, Q=factor * slds.Q)
    ys = [sample(lively, 60, rng)[2] for _ in range(8)]
    for y in ys:
        y[rng.random(len(y)) < 0.1] = np.nan
    found = at_process_noise(slds, ys)
    # 1,300 numbers, which measurement noise of about the same size blurs.
    assert_allclose(found.Q, factor * slds.Q, rtol=0.2)
    assert_array_equal(found.R, slds.R)


@pytest.mark.parametrize("order", [1, 2])
def test_the_process_noise_of_one_state_is_the_likeliest_by_the_joint_gaussian(order, rng):
    slds = random_slds(1, d=2, order=order, noise=0.05, rng=rng)
    ys = [sample(replace(slds, Q=3.0 * slds.Q), 12, rng)[2] for _ in range(3)]
    tried = np.exp(np.arange(np.log(FACTORS[0]), np.log(FACTORS[1]), 0.02))
    values = [sum(log_density_at(replace(slds, Q=f * slds.Q), y, np.zeros(1))[0] for y in ys) for f in tried]
    # The search stops within 5 %, the grid is a step off.
    assert_allclose(at_process_noise(slds, ys).Q, tried[int(np.argmax(values))] * slds.Q, rtol=0.07)


def test_where_nothing_tells_the_process_noise_stays(rng):
    slds = random_slds(2, rng=rng)
    for ys in ([np.full((5, 2), np.nan)], []):
        assert at_process_noise(slds, ys) is slds


@pytest.mark.parametrize("order", [1, 2])
def test_who_was_not_learned_from_has_another_mean_posture(order, rng):
    slds = random_slds(2, d=3, order=order, travelling=("b",), rng=rng)
    shift = STRANGER * rng.normal(size=(200_000, 3)) * [1.0, 0.0, 1.0]
    # Every pose of a state shifts alike; 200,000 draws tell a variance to 0.3 %.
    want = slds.cov0 + np.cov(np.tile(shift, order).T)
    assert_allclose(wider(slds).cov0, want, atol=0.01 * STRANGER**2)


# Prediction


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
    means = [sum(share[j, i] * pairs[j, i][0] for j in range(K)) for i in range(K)]
    covs = [
        sum(
            share[j, i] * (pairs[j, i][1] + np.outer(pairs[j, i][0] - means[i], pairs[j, i][0] - means[i]))
            for j in range(K)
        )
        for i in range(K)
    ]
    return joint.sum(0), means, covs


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


def test_a_horizon_of_no_frames_is_refused(rng):
    with pytest.raises(ValueError, match=r"horizon must be at least 1 frame; got 0"):
        predict(random_slds(1, rng=rng), [np.zeros((3, 2))], 0)


# Synthesis


def settled(slds):
    """A one-state model whose region is where its own dynamics come to rest."""
    mean = np.linalg.solve(np.eye(slds.A.shape[-1]) - slds.A[0], slds.b[0])
    return replace(slds, mean0=mean[None], cov0=solve_discrete_lyapunov(slds.A[0], slds.Q[0])[None])


def drawn_towards(slds, weight=tasks.PULL):
    """The linear system of a one-state run, each of whose steps is conditioned on the region."""
    region = slds.cov0[0] / weight
    gain = slds.Q[0] @ np.linalg.inv(slds.Q[0] + region)
    rest = np.eye(len(gain)) - gain
    b = rest @ slds.b[0] + gain @ slds.mean0[0]
    return replace(slds, A=(rest @ slds.A[0])[None], b=b[None], Q=(rest @ slds.Q[0])[None])


def assert_drawn_from(mean, cov, y, *, n):
    """Sample moments to five standard errors of a Gaussian's, of n draws that are independent."""
    sd = np.sqrt(np.diag(cov))
    assert (np.abs(y.mean(0) - mean) < 5.0 * sd / np.sqrt(n)).all()
    assert (np.abs(np.cov(y.T) - cov) < 5.0 * np.outer(sd, sd) * np.sqrt(2.0 / n)).all()


def assert_has_moments(y, slds, *, frames):
    """Sample moments of a run are the stationary ones, as far as so many free frames tell."""
    want = settled(slds)
    assert_drawn_from(slds.C @ want.mean0[0], slds.C @ want.cov0[0] @ slds.C.T, y, n=frames)


@pytest.mark.parametrize("order", [1, 2])
def test_a_free_run_of_one_state_has_its_stationary_moments(order, rng):
    slds = settled(random_slds(1, order=order, rng=rng))
    s, y = synthesise(slds, 4000, rng, recurrent=False)
    assert_array_equal(s, 0)
    # Modes of radius 0.95 at most remember 20 frames.
    assert_has_moments(y, slds, frames=200)


def test_a_kept_run_of_one_state_has_the_moments_of_its_drawn_steps(rng, monkeypatch):
    monkeypatch.setattr(tasks, "INSIDE", 1.0)  # no pose is too far out
    slds = random_slds(1, noise=1.0, rng=rng)
    slds = settled(replace(slds, A=0.5 * slds.A))
    slds = replace(
        slds, mean0=slds.mean0 + 0.5, cov0=0.5 * slds.cov0
    )  # the region is not where it would rest
    _, y = synthesise(slds, 2500, rng)
    assert_has_moments(y, drawn_towards(slds), frames=1000)
    # It would not do for the free run.
    with pytest.raises(AssertionError):
        assert_has_moments(y, slds, frames=1000)


@pytest.mark.parametrize("recurrent", [True, False])
def test_switch_and_step_have_the_stated_probabilities(recurrent, rng, monkeypatch):
    monkeypatch.setattr(tasks, "INSIDE", 1.0)
    slds = random_slds(3, noise=0.8, rng=rng)
    cov0 = 2.0 * slds.cov0
    cov0[0] *= 1e-10  # every run starts at the same pose
    slds = replace(
        slds,
        pi0=[1.0, 0.0, 0.0],
        Pi=[[0.0, 0.4, 0.6], [0.3, 0.3, 0.4], [0.5, 0.0, 0.5]],
        b=slds.b + np.outer([0.0, 1.0, 0.0], [1.0, 1.0]),  # leads elsewhere than where it comes from
        mean0=0.5 * slds.mean0,
        cov0=cov0,
    )
    ahead = slds.A @ slds.mean0[0] + slds.b
    steps, log_p = [], np.log(np.maximum(slds.Pi[0], 1e-300))
    for k in range(3):
        cov, mean = slds.Q[k], ahead[k]
        if recurrent:
            log_p[k] += log_density(ahead[k], slds.mean0[k], slds.cov0[k])
            here, region = np.linalg.inv(slds.Q[k]), tasks.PULL * np.linalg.inv(slds.cov0[k])
            cov = np.linalg.inv(here + region)
            mean = cov @ (here @ ahead[k] + region @ slds.mean0[k])
        steps.append((mean, cov))
    prob = np.exp(log_p - np.logaddexp.reduce(log_p))

    n = 1000
    runs = [synthesise(slds, 2, rng, recurrent=recurrent) for _ in range(n)]
    s, y = np.array([run[0][1] for run in runs]), np.array([run[1][1] for run in runs])
    share = np.bincount(s, minlength=3) / n
    assert (np.abs(share - prob) <= 5.0 * np.sqrt(prob * (1.0 - prob) / n) + 1e-12).all()
    assert prob[1:].min() > 0.05  # both are there to be told apart
    for k in (1, 2):
        assert_drawn_from(*steps[k], y[s == k], n=np.sum(s == k))


@pytest.mark.parametrize("recurrent", [True, False])
def test_a_run_starts_as_a_sequence_does(recurrent, rng):
    slds = random_slds(2, order=2, rng=rng)
    runs = [synthesise(slds, 1, rng, recurrent=recurrent) for _ in range(1000)]
    s, y = np.array([run[0][0] for run in runs]), np.array([run[1][0] for run in runs])
    assert np.mean(s == 0) == pytest.approx(slds.pi0[0], abs=5.0 * 0.5 / np.sqrt(1000))
    for k in range(2):
        assert_drawn_from(slds.mean0[k][:2], slds.cov0[k][:2, :2], y[s == k], n=np.sum(s == k))


def swinging(radius, *, travelling=True):
    """One freedom going round in 20 frames in each of two halves of the swing, and a place that travels.

    The regions are those of a swing of amplitude 1, whatever the radius does.
    """
    turn = 2.0 * np.pi / 20.0
    A = np.zeros((2, 4, 4))
    A[:, 0, 0], A[:, 2:, :2] = 1.0, np.eye(2)
    A[:, 1, 1], A[:, 1, 3] = 2.0 * radius * np.cos(turn), -(radius**2)
    slds = random_slds(2, d=2, order=2, travelling=("a",), rng=np.random.default_rng(0))
    phase = np.linspace(0.0, np.pi, 50)
    mean0, cov0 = np.zeros((2, 4)), np.zeros((2, 4, 4))
    for k in range(2):
        half = np.column_stack([np.cos(phase + np.pi * k), np.cos(phase + np.pi * k - turn)])
        mean0[k, [1, 3]], mean0[k, 2] = half.mean(0), -0.1
        cov0[k] = 1e-3 * np.eye(4)
        cov0[k][np.ix_([1, 3], [1, 3])] += np.cov(half.T)
    b, Q = np.zeros((2, 4)), np.zeros((2, 4, 4))
    b[:, 0], Q[:, 0, 0], Q[:, 1, 1] = 0.1, 1e-4, 1e-3
    Pi = [[0.9, 0.1], [0.1, 0.9]]
    return replace(slds, pi0=[0.5, 0.5], A=A, b=b, Q=Q, mean0=mean0, cov0=cov0, Pi=Pi, C=np.eye(2, 4))


def test_where_all_freedoms_travel_the_first_order_is_synthesised_too(rng):
    slds = random_slds(2, travelling=("a", "b"), rng=rng)
    _, y = synthesise(slds, 50, np.random.default_rng(1))
    assert np.isfinite(y).all()


@pytest.mark.parametrize("radius", [0.97, 1.05])
def test_synthesis_stays_in_range_over_800_frames(radius):
    slds = swinging(radius)
    assert np.abs(np.linalg.eigvals(slds.A[0][np.ix_([1, 3], [1, 3])])).max() == pytest.approx(radius)
    s, y = synthesise(slds, 800, np.random.default_rng(1))
    assert s.shape == (800,)
    assert y.shape == (800, 2)
    assert np.isfinite(y).all()
    # The swing it was learned from reaches 1, with deviations of 0.7; chi2(2) has INSIDE within 3.3 of them.
    assert np.abs(y[:, 1]).max() < 2.4
    assert y[-400:, 1].std() > 0.1  # nor does it die down
    # Both halves are gone through, and it travels on as it did.
    assert 0.2 < s.mean() < 0.8
    assert np.diff(y[:, 0]).mean() == pytest.approx(0.1, abs=0.02)


def test_without_the_regions_an_unstable_run_leaves_every_range_and_is_finite():  # 1.05**2500 is 1e53
    _, y = synthesise(swinging(1.05), 2500, np.random.default_rng(1), recurrent=False)
    assert np.abs(y[:1000, 1]).max() > 1e6
    assert np.isfinite(y).all()


def test_a_step_is_drawn_among_the_poses_of_its_state_where_noise_allows(rng):
    slds = settled(random_slds(1, noise=0.5, rng=rng))
    slds = replace(slds, b=slds.b + 20.0)  # every step leads far out
    radius = [
        np.sqrt((y - m) @ np.linalg.solve(P, y - m))
        for y, m, P in ((synthesise(slds, 2, rng)[1][1], slds.mean0[0], slds.cov0[0]) for _ in range(150))
    ]
    # chi2(2) has INSIDE of its mass within 10.6; the rest is the step's own noise, less than the region's.
    assert np.mean(radius) < np.sqrt(10.6) + 1.0
    free = synthesise(slds, 2, rng, recurrent=False)[1][1]
    assert np.linalg.norm(free - slds.mean0[0]) > 15.0


def test_a_step_without_noise_goes_on_however_far_out_it_is(rng):
    slds = random_slds(1, rng=rng)
    slds = replace(slds, Q=1e-30 * slds.Q, b=slds.b + 100.0)
    _, y = synthesise(slds, 20, rng)
    # The noise drawn is 1e-15 times that of the model.
    assert_allclose(y[1:], y[:-1] @ slds.A[0].T + slds.b[0], atol=1e-10)


@pytest.mark.parametrize("recurrent", [True, False])
def test_the_same_seed_makes_the_same_motion_and_another_another(recurrent, rng):
    slds = random_slds(3, order=2, travelling=("a",), rng=rng)
    (s, y), (again_s, again), (_, other) = (
        synthesise(slds, 60, np.random.default_rng(seed), recurrent=recurrent) for seed in (3, 3, 4)
    )
    assert_array_equal(s, again_s)
    assert_array_equal(y, again)
    assert np.abs(y - other).min() > 0.0


@pytest.mark.parametrize("travelling", [(), ("b",)])
def test_the_work_ticks_as_often_as_it_says(rng, travelling):
    slds = random_slds(2, travelling=travelling, rng=rng)
    ys = [rng.normal(size=(T, len(slds.names))) for T in (4, 20)]
    ticks = []
    at_noise(slds, ys, lambda: ticks.append("noise"))
    assert len(ticks) == SEARCHES
    classify(slds, ys, tick=lambda: ticks.append("classify"))
    assert ticks.count("classify") == CLASSIFY_TICKS
    predict(slds, ys, 2, tick=lambda: ticks.append("predict"))
    assert ticks.count("predict") == predict_ticks(ys) > predict_ticks([ys[0]]) >= 1
