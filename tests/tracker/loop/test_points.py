"""The loop with a pose network's points: they carry it alone, their faults are repaired, gaps are gaps."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.gaussian import Gaussian
from kinematics.sides import other_side
from kinematics.spm import joint_jacobian, joints
from tests.benchmarks.evaluation.spoiled import Damage, constant_velocity, filled, median, spoil
from tests.kinematics.figures import WALKER, upright
from tests.tracker.clips import points_of
from tests.tracker.loop.walks import begun, detected, start_of
from tests.tracker.painted import STRIDE
from tracker.loop.begin import begin
from tracker.loop.detections import Detections
from tracker.loop.outcome import Outcome
from tracker.loop.smoothing import smoothed
from tracker.loop.tracker import WIDEST, Tracker, make_tracker
from tracker.models.find import find_model
from tracker.scene.film import render
from tracker.settings import Settings

FRAMES = 40
ALONE = Settings(templates=False, camera=False)
JITTER = 3.0  # px; a leg of this walker has 63


@pytest.fixture(scope="module")
def walk():
    """A rendered walk whose joints are known exactly."""
    return render(5, frames=FRAMES, size=(480, 270), shrubs=False)


@pytest.fixture(scope="module")
def true_points(walk):
    return points_of(walk.joints)


def tracker_of(walk, settings=ALONE, model="walk-run"):
    """A start as marked, and its tracker."""
    start = start_of(walk.joints, walk.facing)
    return start, make_tracker(start, find_model(model, walk.fps, settings), settings)


def run(start, tracker, images, points):
    """Estimates of a walk by points."""
    state, estimate = begin(tracker, start, images[0])
    yield estimate
    for image, places in zip(images[1:], points.places[1:], strict=True):
        state, estimate = tracker.step(state, image, Detections.of(start.figure, points.names, places))
        yield estimate


def followed(walk, points):
    """Smoothed estimates of a walk by points; no picture is looked at but the first."""
    start, tracker = tracker_of(walk)
    return start, list(smoothed(tracker, run(start, tracker, walk.images[:1] * FRAMES, points)))


def places_of(start, estimates):
    """Joints by frame and name."""
    return [
        dict(zip(start.figure.joints, start.view.to_pixels(joints(start.figure, e.pose.mean)), strict=True))
        for e in estimates
    ]


def rows_of(points):
    """The same of points."""
    return [dict(zip(points.names, row, strict=True)) for row in points.places]


def error(walk, rows):
    """Mean distance from the true joints after frame 0, leg lengths; toes do not count."""
    names = [name for name in walk.joints if "toe" not in name]
    away = [np.hypot(*(rows[t][n] - walk.joints[n][t])) for t in range(1, FRAMES) for n in names]
    return np.mean(away) / walk.leg_px


def exchanged_frames(walk, rows):
    """Frames in which the legs fit the truth better when they are exchanged."""
    legs = ("near_knee", "near_ankle", "far_knee", "far_ankle")
    out = []
    for t in range(1, FRAMES):
        told = sum(np.hypot(*(rows[t][n] - walk.joints[n][t])) for n in legs)
        twin = sum(np.hypot(*(rows[t][n] - walk.joints[other_side(n)][t])) for n in legs)
        if twin < told - 0.1 * 4 * walk.leg_px:
            out.append(t)
    return out


def test_spoiled_points_are_repaired_beyond_what_filters_of_each_joint_do(walk, true_points):
    bad = spoil(true_points, Damage(JITTER, exchanged=0.1, missing=0.1), np.random.default_rng(1))
    start, estimates = followed(walk, bad.points)
    rows = places_of(start, estimates)
    ours = error(walk, rows)
    rivals = [filled(bad.points), median(bad.points)]
    rivals += [constant_velocity(bad.points, a, JITTER) for a in (0.3, 1.0, 3.0)]
    others = [error(walk, rows_of(rival)) for rival in rivals]
    # A tenth of the frames is exchanged, which is .05 to .1 leg in the mean for who does not see it.
    assert ours < 0.035
    assert ours < 0.75 * min(others)
    assert {e.outcome for e in estimates} <= {"ok", "hidden"}
    assert len(exchanged_frames(walk, rows_of(filled(bad.points)))) >= 3
    assert exchanged_frames(walk, rows) == []


def test_twenty_frames_on_end_may_be_exchanged(walk, true_points):
    bad = spoil(true_points, Damage(JITTER, stretch=20), np.random.default_rng(2)).points
    rows = places_of(*followed(walk, bad))
    assert exchanged_frames(walk, rows) == []
    assert error(walk, rows) < 0.035


def test_where_there_is_no_point_the_covariance_grows_and_the_figure_is_lost_then_found(walk, true_points):
    hole = slice(20, 28)
    places = true_points.places.copy()
    places[hole] = np.nan
    start, tracker = tracker_of(walk)
    spread, outcomes = [], []
    estimates = run(start, tracker, walk.images[:1] * FRAMES, replace(true_points, places=places))
    for estimate in list(estimates)[1:]:
        J = joint_jacobian(start.figure, estimate.pose.mean)[start.figure.joints.index("near_ankle")]
        spread.append(np.trace(J @ estimate.pose.cov @ J.T))
        outcomes.append(estimate.outcome)
    within = slice(hole.start - 1, hole.stop - 1)  # the first frame is not in the lists
    assert (np.diff(spread[within]) > 0.0).all()
    assert spread[hole.stop - 2] > 10.0 * spread[hole.start - 2]
    assert spread[hole.stop + 1] < 2.0 * spread[hole.start - 2]
    assert outcomes[within] == ["lost"] * 8
    assert outcomes[hole.stop - 1] == "found"
    assert set(outcomes[: hole.start - 1]) | set(outcomes[hole.stop :]) <= {"ok", "hidden"}


def test_without_points_a_figure_that_has_left_the_picture_is_outside_and_one_within_is_lost(walk):
    start, tracker = tracker_of(walk, model="cv")
    state, _ = begin(tracker, start, walk.images[0])
    mean = state.belief.states.mean.copy()
    mean[:, tracker.slds.names.index("root_x")] -= 20.0  # leg lengths
    gone = replace(state, belief=replace(state.belief, states=Gaussian(mean, state.belief.states.cov)))
    assert tracker.step(state, walk.images[0])[1].outcome == "lost"
    assert tracker.step(gone, walk.images[0])[1].outcome == "outside"


def test_points_of_a_picture_that_a_moving_camera_shifted_are_where_it_shows_the_figure(walk, true_points):
    pan = np.cumsum(np.full((FRAMES, 2), [1.0, 0.0]), axis=0).round()
    images = [np.roll(walk.images[t], pan[t].astype(int), axis=(1, 0)) for t in range(FRAMES)]
    panned = replace(true_points, places=true_points.places + pan[:, None])
    moved = replace(walk, images=images, joints={n: at + pan for n, at in walk.joints.items()})
    start, tracker = tracker_of(moved, ALONE.model_copy(update={"camera": True}))
    estimates = list(smoothed(tracker, run(start, tracker, images, panned)))
    shifts = np.array([e.moved[:2] for e in estimates])
    assert_allclose(shifts, pan - pan[0], atol=1.0)
    rows = [
        {name: at + e.moved[:2] for name, at in row.items()}
        for row, e in zip(places_of(start, estimates), estimates, strict=True)
    ]
    assert error(moved, rows) < 0.03


def test_where_no_template_matches_the_figure_is_lost_unless_it_agrees_with_the_points(rng):
    _, tracker, state, _ = begun(rng)
    blocks = np.kron(rng.integers(0, 2, (38, 36, 3)) * 255, np.ones((5, 5, 1))).astype(np.uint8)
    for found, outcome in ((None, "lost"), (detected(STRIDE), "ok")):
        after, estimate = tracker.step(state, blocks, found)
        assert estimate.outcome == outcome
        assert after.templates is state.templates
    assert tracker.step(state, blocks, detected(STRIDE, without=("neck",)))[1].outcome == "hidden"
    assert tracker.step(replace(state, outcome=Outcome.LOST), blocks, detected(STRIDE))[1].outcome == "found"
    elsewhere = detected(STRIDE)
    elsewhere = replace(elsewhere, pixels=elsewhere.pixels + rng.normal(0.0, 80.0, elsewhere.pixels.shape))
    assert tracker.step(state, blocks, elsewhere)[1].outcome == "lost"


def test_templates_climb_from_where_the_points_are(rng):
    painted, tracker, state, _ = begun(rng)
    want = STRIDE.copy()
    want[WALKER.index("root_x")] += 0.25  # further than templates climb by themselves in one frame
    image = painted.picture(want)
    reached = {}
    for name, found in (("alone", None), ("told", detected(want))):
        _, estimate = tracker.step(state, image, found)
        away = joints(WALKER, estimate.pose.mean) - joints(WALKER, want)
        reached[name] = np.linalg.norm(away, axis=-1).mean()
    assert reached["alone"] > 0.1
    assert reached["told"] < 0.02


def test_points_and_pictures_are_two_measurements_one_after_the_other(rng):
    painted, tracker, state, _ = begun(rng)
    found = detected(STRIDE, without=("far_toe",))
    image = painted.picture(STRIDE)
    both, _ = tracker.step(state, image, found)
    first = tracker.detected(tracker.proposed(state.belief), found)
    pictured, _ = tracker.step(state, image)
    # What the picture says is the same, as the figure stands where it is foreseen: information adds.
    added = [
        np.linalg.inv(tracker.pose(b.states).cov[0])
        for b in (both.belief, first, pictured.belief, tracker.proposed(state.belief))
    ]
    assert_allclose(added[0], added[1] + added[2] - added[3], rtol=0.05, atol=0.02 * np.abs(added[0]).max())


def test_each_hypothesis_pays_for_what_the_points_say_against_it(rng):
    _, tracker, state, _ = begun(rng, name="walk-run")
    belief = tracker.proposed(state.belief)
    mean = belief.states.mean.copy()
    mean[1:, tracker.slds.names.index("hip_near")] += 0.5
    belief = replace(belief, states=Gaussian(mean, belief.states.cov), cost=np.zeros(len(belief.cost)))
    for swap in (False, True):
        after = tracker.detected(belief, detected(STRIDE, swap=swap))
        assert after.cost[0] == 0.0
        assert (after.cost[1:] > 3.0).all()


@pytest.mark.parametrize("moved", [0.0, 0.02, 0.4])
def test_a_figure_as_the_points_have_it_is_tried_only_where_they_are_far_from_all_that_was_foreseen(
    moved, rng
):
    _, tracker, state, _ = begun(rng, name="walk-run")
    belief = tracker.proposed(state.belief)
    pose = STRIDE.copy()
    pose[tracker.figure.index("knee_near")] += moved
    pose[tracker.figure.index("hip_far")] -= moved
    after = tracker.detected(belief, detected(pose))
    assert len(after.cost) == len(belief.cost) + (moved > 0.1)
    away = np.abs(tracker.pose(after.states).mean - pose).max(1)
    if moved > 0.1:
        assert away[-1] < 0.5 * away[:-1].min()
        assert after.s[-1] == belief.s[belief.best]


def test_points_that_jump_in_every_frame_make_no_covariance_grow_without_bound(rng):
    _, tracker, state, _ = begun(rng, name="walk-run")
    belief, widest = state.belief, []
    for t in range(12):
        found = detected(STRIDE + upright(WALKER, root_x=0.8 * (-1.0) ** t))
        trunk = replace(found, joint=found.joint[:3], pixels=found.pixels[:3])  # nothing is told of the legs
        belief = tracker.detected(tracker.proposed(belief), trunk)
        belief = belief.at([belief.best])
        widest.append(np.diagonal(belief.states.cov[0]).max())
    assert 1.0 < max(widest) < 2.0 * WIDEST


def test_templates_that_match_where_hardly_a_point_is_lie_on_something_else(rng, monkeypatch):
    painted, tracker, state, _ = begun(rng)
    monkeypatch.setattr(Tracker, "detected", lambda self, belief, detections: belief)  # points judge alone
    image = painted.picture(STRIDE)
    beside, elsewhere = (STRIDE + upright(WALKER, root_x=away) for away in (0.25, 1.0))

    def judged(pose, **without):
        after, estimate = tracker.step(state, image, detected(pose, **without))
        return estimate.outcome, after.templates is state.templates

    assert judged(STRIDE) == ("ok", False)
    assert judged(beside) == judged(elsewhere) == ("lost", True)
    # The fewer there are, the farther off they must be to tell.
    assert judged(beside, without=WALKER.joints[:3]) == ("ok", False)
    assert judged(elsewhere, without=WALKER.joints[:3]) == ("lost", True)
    assert judged(elsewhere, without=WALKER.joints[:6]) == ("ok", False)
    bent = STRIDE + upright(WALKER, knee_near=0.8, knee_far=0.8)
    assert judged(bent) == ("ok", False)  # some points are where the joints are
