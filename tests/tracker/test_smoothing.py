"""Smoothing of a run: the Rauch-Tung-Striebel pass along the best path, a window at a time."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.belief import Belief, first_belief, propose
from dynamics.gaussian import Gaussian, apply
from dynamics.kalman import update
from dynamics.viterbi import viterbi
from tests.oracles import random_slds
from tracker.smoothing import smoothed
from tracker.track import Estimate


def filtered(slds, y):
    """What the loop leaves of measurements that come straight from the poses: an estimate a frame."""
    R = slds.R
    belief = first_belief(slds, y[0], R)
    beliefs = [belief]
    for row in y[1:]:
        prior = propose(slds, belief, prune=np.inf)
        states, log_lik = update(prior.states, row, slds.C, R)
        belief = Belief(states, prior.cost - log_lik, prior.s, prior.parent)
        beliefs.append(belief)
    return [Estimate(b.merged(), int(b.s[b.best]), f"frame {t}", b) for t, b in enumerate(beliefs)]


def tracker_of(slds):
    """As much of a tracker as smoothing asks for."""
    return SimpleNamespace(
        slds=slds, pose=lambda x: Gaussian(apply(slds.C, x.mean), slds.C @ x.cov @ slds.C.T)
    )


@pytest.mark.parametrize("states", [1, 3])
@pytest.mark.parametrize("T", [1, 2, 40])
def test_a_run_is_smoothed_along_its_own_best_path(states, T, rng):
    slds = random_slds(states, order=2, rng=rng)
    y = slds.sample(T, rng)[2]
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


def test_windows_give_what_the_whole_run_gives_but_for_what_is_far_ahead(rng):
    slds = random_slds(2, order=2, rng=rng)
    y = slds.sample(300, rng)[2]
    estimates = filtered(slds, y)
    whole = list(smoothed(tracker_of(slds), estimates, lag=300))
    parts = list(smoothed(tracker_of(slds), estimates, lag=40))
    assert len(parts) == len(whole) == 300
    for one, other in zip(parts, whole, strict=True):
        # Systems of radius 0.95 at most forget within 40 frames to 0.95**80 = 2e-2 of a belief at the least.
        sd = np.sqrt(np.diag(other.pose.cov))
        assert (np.abs(one.pose.mean - other.pose.mean) < 0.05 * sd).all()


def test_smoothing_is_surer_than_filtering_and_ends_where_it_ends(rng):
    slds = random_slds(1, order=2, rng=rng)
    estimates = filtered(slds, slds.sample(30, rng)[2])
    found = list(smoothed(tracker_of(slds), estimates))
    before, after = (np.array([np.trace(e.pose.cov) for e in es]) for es in (estimates, found))
    assert (after[:-1] < 1.01 * before[:-1]).all()
    assert after[:10].sum() < 0.95 * before[:10].sum()


def test_no_more_than_two_windows_are_kept_waiting(rng):
    slds = random_slds(1, rng=rng)
    estimates = filtered(slds, slds.sample(50, rng)[2])
    taken = []

    def source():
        for estimate in estimates:
            taken.append(estimate)
            yield estimate

    for given, _ in enumerate(smoothed(tracker_of(slds), source(), lag=5), start=1):
        assert len(taken) - given < 10


def test_a_run_of_no_frames_is_none(rng):
    assert list(smoothed(tracker_of(random_slds(1, rng=rng)), [])) == []
