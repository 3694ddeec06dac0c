"""Smoothing of a run: the Rauch-Tung-Striebel pass along the best path, a window at a time."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.belief import first_belief, propose
from dynamics.gaussian import Gaussian, apply
from dynamics.kalman import predict, update
from dynamics.viterbi import viterbi
from tests.oracles import given_path, random_slds, sample
from tracker.loop.estimate import Estimate
from tracker.loop.smoothing import smoothed, turned_belief


def filtered(slds, y, wide=None, by=1.0):
    """What the loop leaves of measurements that come straight from the poses: an estimate a frame.

    In frame `wide` the predicted covariance is increased by a factor.
    """
    R = slds.R
    belief = first_belief(slds, y[0], R)
    beliefs = [belief]
    for t, row in enumerate(y[1:], 1):
        prior = propose(slds, belief, prune=np.inf, most=9)
        if t == wide:
            states = Gaussian(prior.states.mean, by * prior.states.cov)
            prior = replace(prior, states=states, wider=by * prior.wider)
        states, log_lik = update(prior.states, row, slds.C, R)
        belief = replace(prior, states=states, cost=prior.cost - log_lik)
        beliefs.append(belief)
    return [
        Estimate(b.merged(), int(b.s[b.best]), f"frame {t}", b, np.full(2, float(t)))
        for t, b in enumerate(beliefs)
    ]


def tracker_of(slds):
    """As much of a tracker as smoothing asks for."""
    return SimpleNamespace(
        slds=slds, pose=lambda x: Gaussian(apply(slds.C, x.mean), slds.C @ x.cov @ slds.C.T)
    )


@pytest.mark.parametrize("states", [1, 3])
@pytest.mark.parametrize("T", [1, 2, 40])
def test_a_run_is_smoothed_along_its_own_best_path(states, T, rng):
    slds = random_slds(states, order=2, rng=rng)
    y = sample(slds, T, rng)[2]
    estimates = filtered(slds, y)
    found = list(smoothed(tracker_of(slds), estimates))
    path, h = [], estimates[-1].belief.best
    for estimate in estimates[::-1]:
        path.insert(0, int(estimate.belief.s[h]))
        h = estimate.belief.parent[h]
    assert [e.s for e in found] == path
    only = np.where(np.arange(states) == np.array(path)[:, None], 0.0, -np.inf)
    want = viterbi(slds, y, only).states
    for t, estimate in enumerate(found):
        # The smoother raises the predicted covariance by 1e-12 of its size; its inverse may be 1e3 larger.
        assert_allclose(estimate.pose.mean, slds.C @ want.mean[t], atol=1e-9)
        assert_allclose(estimate.pose.cov, slds.C @ want.cov[t] @ slds.C.T, atol=1e-9)
        assert estimate.outcome == f"frame {t}"
        assert (estimate.moved == t).all()


@pytest.mark.parametrize("order", [1, 2])
def test_a_frame_whose_prediction_was_widened_is_smoothed_as_one_of_more_noise(order, rng):
    slds, wide, by = random_slds(1, order=order, rng=rng), 5, 20.0
    y = sample(slds, 9, rng)[2]
    estimates = filtered(slds, y, wide, by)
    before = estimates[wide - 1].belief.states
    noise = slds.Q + (by - 1.0) * predict(before, slds.A, slds.b, slds.Q).cov
    usual = {name: np.repeat(getattr(slds, name), 2, axis=0) for name in ("A", "b", "mean0", "cov0")}
    other = SimpleNamespace(
        Q=np.concatenate([slds.Q, noise]),
        log_pi0=np.zeros(2),
        log_Pi=np.zeros((2, 2)),
        C=slds.C,
        R=slds.R,
        **usual,
    )
    mean, cov, _ = given_path(other, y, [int(t == wide) for t in range(9)])
    found = list(smoothed(tracker_of(slds), estimates))
    for t, estimate in enumerate(found):
        assert_allclose(estimate.pose.mean, slds.C @ mean[t], atol=1e-9)
        assert_allclose(estimate.pose.cov, slds.C @ cov[t, :, t] @ slds.C.T, atol=1e-9)
    first = turned_belief(slds, estimates[wide - 1].belief, found[wide].belief)
    there = Gaussian(mean[wide - 1], cov[wide - 1, :, wide - 1])
    place = slice(0, len(slds.names))
    assert_allclose(first.states.mean[0, place], there.mean[place], atol=1e-9)
    assert_allclose(first.states.cov[0, place, place], there.cov[place, place], atol=1e-9)


def test_windows_give_what_the_whole_run_gives_but_for_what_is_far_ahead(rng):
    slds = random_slds(2, order=2, rng=rng)
    y = sample(slds, 300, rng)[2]
    estimates = filtered(slds, y)
    whole = list(smoothed(tracker_of(slds), estimates, lag=300))
    parts = list(smoothed(tracker_of(slds), estimates, lag=40))
    assert len(parts) == len(whole) == 300
    for one, other in zip(parts, whole, strict=True):
        # Systems of radius 0.95 at most forget within 40 frames to 0.95**80 = 2e-2 of a belief at the least.
        sd = np.sqrt(np.diag(other.pose.cov))
        assert (np.abs(one.pose.mean - other.pose.mean) < 0.05 * sd).all()


def test_a_picture_that_repeats_adds_nothing_to_what_is_known_of_the_others(rng):
    slds = random_slds(2, order=2, rng=rng)
    estimates = filtered(slds, sample(slds, 20, rng)[2])
    again = replace(estimates[7], repeats=True)
    want = list(smoothed(tracker_of(slds), estimates))
    found = list(smoothed(tracker_of(slds), [*estimates[:8], again, again, *estimates[8:]]))
    for one, other in zip(found, [*want[:8], want[7], want[7], *want[8:]], strict=True):
        assert_array_equal(one.pose.mean, other.pose.mean)
        assert_array_equal(one.pose.cov, other.pose.cov)


def test_no_more_than_a_window_is_kept_waiting(rng):
    slds = random_slds(1, rng=rng)
    estimates = filtered(slds, sample(slds, 100, rng)[2])
    taken = []

    def source():
        for estimate in estimates:
            taken.append(estimate)
            yield estimate

    for given, _ in enumerate(smoothed(tracker_of(slds), source(), lag=5), start=1):
        assert len(taken) - given < 2 * 5


@pytest.mark.parametrize(("fps", "waiting"), [(24.0, 200), (60.0, 396), (240.0, 600)])
def test_three_strides_are_kept_waiting_as_far_as_memory_allows(fps, waiting, rng):
    slds = replace(random_slds(1, rng=rng), fps=fps)
    source = iter(filtered(slds, sample(slds, 620, rng)[2]))
    next(smoothed(tracker_of(slds), source))
    assert 620 - len(list(source)) == waiting


def test_nothing_is_carried_over_a_new_beginning(rng):
    slds = random_slds(2, order=2, rng=rng)
    first, second = (filtered(slds, sample(slds, T, rng)[2]) for T in (7, 12))
    second[0] = replace(second[0], began=True)
    found = list(smoothed(tracker_of(slds), [*first, *second]))
    apart = [*smoothed(tracker_of(slds), first), *smoothed(tracker_of(slds), second)]
    assert len(found) == 19
    for one, other in zip(found, apart, strict=True):
        assert_allclose(one.pose.mean, other.pose.mean, rtol=1e-12)
        assert one.s == other.s


def test_a_smoothed_estimate_s_belief_is_its_one_hypothesis_with_its_own_past(rng):
    slds = random_slds(3, order=2, rng=rng)
    estimates = filtered(slds, sample(slds, 9, rng)[2])
    found = list(smoothed(tracker_of(slds), estimates))
    for raw, one in zip(estimates, found, strict=True):
        assert one.belief.s.tolist() == [one.s]
        h = int(np.flatnonzero(raw.belief.s == one.s)[0])
        assert one.belief.parent[0] == raw.belief.parent[h]
        assert_allclose(slds.C @ one.belief.states.mean[0], one.pose.mean)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("drifts", [0, 2])
def test_the_other_way_begins_with_what_all_the_run_says_of_its_first_two_poses(order, drifts, rng):
    slds = random_slds(1, order=order, rng=rng)
    d, T = len(slds.names), 5
    if drifts:
        names = [f"z{i}" for i in range(drifts)]
        slds = slds.with_drifts(names, np.full(drifts, 0.8), np.full(drifts, 0.3), np.full(drifts, 0.5))
    y = sample(slds, T, rng)[2]
    estimates = filtered(slds, y)
    second = list(smoothed(tracker_of(slds), estimates))[1]
    found = turned_belief(slds, estimates[0].belief, second.belief)

    N = slds.A.shape[-1]
    mean, cov, _ = given_path(slds, y, [0] * T)
    after = N + np.arange(d) if order == 2 else []
    pick = np.r_[np.arange(d), after, N - drifts + np.arange(drifts)].astype(int)
    # The smoother raises the predicted covariance by 1e-12 of its size.
    assert_allclose(found.states.mean[0], mean.ravel()[pick], atol=1e-8)
    assert_allclose(found.states.cov[0], cov.reshape(T * N, T * N)[np.ix_(pick, pick)], atol=1e-8)


def test_a_run_of_no_frames_is_none(rng):
    assert list(smoothed(tracker_of(random_slds(1, rng=rng)), [])) == []
