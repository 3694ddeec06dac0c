"""Hypotheses: one alone is a Kalman filter, several agree with dense algebra, unlikely ones are not tried."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian
from dynamics.kalman import predict
from dynamics.slds import SLDS
from kinematics.figure import SCALE
from kinematics.recover import Start
from tests.oracles import condition, mixture
from tests.tracker.loop.walks import WHOLE, Walk, field_of
from tests.tracker.painted import FULL
from tracker.loop.begin import START_ANGLE, START_LENGTH, START_PLACE, begin
from tracker.loop.tracker import Tracker, make_tracker
from tracker.models.find import find_model
from tracker.picture.backdrop import ALIKE, first_backdrop
from tracker.registration.align import align
from tracker.registration.field import Field, Registration


@dataclass(frozen=True)
class Hypothesis:
    """One switching state's belief over x, and what it cost."""

    mean: np.ndarray
    cov: np.ndarray
    cost: float


def began(tracker: Tracker, start: Start) -> list[Hypothesis]:
    """The marked pose as a measurement of each state's first belief, by conditioning the joint Gaussian."""
    slds = tracker.slds
    first_length = start.figure.freedoms.index(SCALE)
    deviation = [
        START_PLACE if i < 2 else START_ANGLE if i < first_length else START_LENGTH
        for i in range(len(start.q))
    ]
    y = np.where(start.known, start.q - tracker.offset, np.nan)
    found = []
    for k in range(slds.K):
        mean, cov, log_p = condition(slds.mean0[k], slds.cov0[k], slds.C, np.diag(deviation) ** 2, y)
        found.append(Hypothesis(mean, cov, -np.log(slds.pi0[k]) - log_p))
    return found


def stepped(
    tracker: Tracker, field: Field, before: list[Hypothesis]
) -> tuple[list[Hypothesis], list[Registration]]:
    """One frame on by dense algebra, no hypothesis pruned."""
    slds, offset = tracker.slds, tracker.offset
    after, registrations = [], []
    for k in range(slds.K):
        price = [h.cost - np.log(slds.Pi[j, k]) for j, h in enumerate(before)]
        parent = before[int(np.argmin(price))]
        m = slds.A[k] @ parent.mean + slds.b[k]
        P = slds.A[k] @ parent.cov @ slds.A[k].T + slds.Q[k]
        pose, spread = slds.C @ m + offset, slds.C @ P @ slds.C.T
        prior = Gaussian(pose, 0.5 * (spread + spread.T))
        alone = Gaussian(prior.mean[None], prior.cov[None])
        (r,) = align(field, alone)
        L = slds.C.T @ r.information @ slds.C
        h = slds.C.T @ (r.vector - r.information @ offset)
        # (P^-1 + L)^-1 (P^-1 m + h) without the inverse of P.
        cov = np.linalg.inv(np.eye(len(P)) + P @ L) @ P
        mean = m + cov @ (h - L @ m)
        away = r.q - pose
        evidence = r.cost + 0.5 * away @ np.linalg.inv(spread) @ away
        evidence += 0.5 * np.log(np.linalg.det(np.eye(len(spread)) + spread @ r.information))
        after.append(Hypothesis(mean, cov, min(price) + evidence))
        registrations.append(r)
    return after, registrations


def merged(tracker: Tracker, hypotheses: list[Hypothesis]) -> tuple[np.ndarray, Gaussian]:
    """Weights, and the moments of the pose over all hypotheses."""
    cost, C = np.array([h.cost for h in hypotheses]), tracker.slds.C
    weights = np.exp(cost.min() - cost) / np.exp(cost.min() - cost).sum()
    pose = mixture(weights, [C @ h.mean for h in hypotheses], [C @ h.cov @ C.T for h in hypotheses])
    return weights, Gaussian(pose.mean + tracker.offset, pose.cov)


def check_against_twin(walk: Walk, slds: SLDS, frames: int) -> None:
    tracker = make_tracker(walk.start, slds, WHOLE)
    state, estimate = begin(tracker, walk.start, walk.images[0])
    # A scene known everywhere, from when the walker had gone on.
    beside = (-9.0, -9.0, -1.0, -1.0)
    state = replace(state, backdrop=first_backdrop(walk.images[-1], beside, tracker.view.unit, state.curve))
    hypotheses = began(tracker, walk.start)
    _, pose = merged(tracker, hypotheses)
    # Both invert covariances whose axes differ by up to 1e6 in size: 1e6 * 2e-16 a step, a search between.
    assert_allclose(estimate.pose.mean, pose.mean, atol=1e-8)
    for image in walk.images[1:frames]:
        old = state.templates
        state, estimate = tracker.step(state, image)
        field = field_of(tracker, old, state, image)
        hypotheses, found = stepped(tracker, field, hypotheses)
        weights, pose = merged(tracker, hypotheses)
        assert_allclose(state.belief.weights, weights, atol=1e-6)
        assert_allclose(estimate.pose.mean, pose.mean, atol=1e-7)
        assert_allclose(estimate.pose.cov, pose.cov, atol=1e-6 * pose.cov.max())
        assert estimate.s == state.belief.s[weights.argmax()]
        best = found[int(weights.argmax())]
        assert estimate.misfit == pytest.approx(best.misfit, abs=1e-6)
        refreshed = old.refreshed(field.seen(best), best.match, WHOLE.blend, best.offset)
        assert_allclose(state.templates.colours, refreshed.colours, atol=1e-3)
        assert_array_equal(state.templates.known, refreshed.known)
        assert_allclose(state.templates.light, refreshed.light, atol=1e-3)
        assert state.scenery.differs.max() > 1.0 > ALIKE > np.median(state.scenery.differs)


@pytest.mark.parametrize("name", ["cv", "walk-run-1"])
def test_one_hypothesis_is_the_extended_kalman_filter(name, walk):
    slds = find_model(name, 30.0, FULL.model_copy(update={"surprise": 0.0}))
    assert slds.K == 1
    check_against_twin(walk, slds, frames=5)


def test_hypotheses_cost_their_past_the_switch_and_the_evidence_of_their_picture(walk, models):
    assert models["walk-run"].K > 1
    check_against_twin(walk, models["walk-run"], frames=4)


@pytest.mark.parametrize("name", ["cv", "walk-run"])
def test_a_picture_that_tells_nothing_leaves_the_prediction(name, walk, models):
    tracker = make_tracker(walk.start, models[name], FULL)
    state, _ = begin(tracker, walk.start, walk.images[0])
    blank = np.full_like(walk.images[0], 90)
    after, _ = tracker.step(state, blank)
    slds = tracker.slds
    for h, s in enumerate(after.belief.s):
        price = state.belief.cost - slds.log_Pi[state.belief.s, s]
        ahead = predict(state.belief.states[int(price.argmin())], slds.A[s], slds.b[s], slds.Q[s])
        # Of one grey level, blurring leaves 1e-5 of slope; squared it is no information.
        assert_allclose(after.belief.states[h].mean, ahead.mean, atol=1e-7)
        assert_allclose(after.belief.states[h].cov, ahead.cov, atol=1e-7 * ahead.cov.max())


def test_a_hypothesis_far_dearer_than_the_best_is_not_tried(walk, models):
    slds = models["walk-run"]
    rare = np.full((slds.K, slds.K), np.exp(-20.0))
    np.fill_diagonal(rare, 1.0 - rare[0, 1:].sum())
    tracker = make_tracker(walk.start, replace(slds, Pi=rare), FULL)
    state, _ = begin(tracker, walk.start, walk.images[0])
    for ahead, tried in ((1e5, [1]), (0.0, list(range(slds.K)))):
        cost = np.full(slds.K, ahead)
        cost[1] = 0.0
        belief = replace(state.belief, cost=cost)
        after, _ = tracker.step(replace(state, belief=belief), walk.images[1])
        assert after.belief.s.tolist() == tried
