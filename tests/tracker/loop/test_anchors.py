"""Anchors: marks as a measurement of the pose, and a new start where the figure was lost."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kinematics.figure import SCALE
from kinematics.recover import Start
from kinematics.spm import joint_jacobian, joints
from tests.kinematics.figures import FOOTLESS, WALKER, upright
from tests.tracker.painted import CLASSIC, FULL, STRIDE, VIEW, Painted
from tracker.loop import anchors as anchors_module
from tracker.loop.anchors import ALONG, SEEN, Anchor, anew, passed
from tracker.loop.anchors import _noise as noise
from tracker.loop.begin import begin
from tracker.loop.outcome import Outcome
from tracker.loop.tracker import make_tracker
from tracker.models.find import find_model

JOINTS = WALKER.joints
# Some degrees and hundredths of a leg from the stride: what a tracker that slid may be off.
NEARBY = STRIDE + upright(WALKER, root_x=0.04, torso=0.05, hip_near=0.1, knee_near=0.15, hip_far=-0.1)


def at_a_stride(model, settings=FULL):
    """A tracker, its state at a marked stride, and that picture."""
    image = Painted(np.random.default_rng(1)).picture(STRIDE)
    start = Start(WALKER, VIEW, STRIDE, np.ones(len(STRIDE), dtype=bool))
    tracker = make_tracker(start, find_model(model, 30.0, settings), settings)
    return tracker, begin(tracker, start, image)[0], image


@pytest.fixture(scope="module", params=["cv", "walk-run"])
def begun(request):
    return at_a_stride(request.param)


def anchor_of(q, names=JOINTS, hidden=(), figure=WALKER):
    places = VIEW.to_pixels(joints(WALKER, q))
    return Anchor.of(figure, {n: places[JOINTS.index(n)] for n in names}, hidden)


def pixels(estimate):
    return VIEW.to_pixels(joints(WALKER, estimate.pose.mean))


def away(estimate, q):
    """(J,) pixels."""
    return np.linalg.norm(pixels(estimate) - VIEW.to_pixels(joints(WALKER, q)), axis=-1)


def through(begun, anchor, before=Outcome.OK):
    tracker, state, image = begun
    return passed(tracker, replace(state, outcome=before), anchor, image)


@pytest.mark.parametrize("zoom", [0.5, 1.0, 3.0])
def test_what_is_far_off_is_told_by_the_size_in_that_frame(zoom, begun):
    tracker, state, image = begun
    state = replace(state, moved=np.array([0.0, 0.0, zoom]), camera=None)
    view = tracker.seen_by(state).view
    places = view.to_pixels(joints(WALKER, tracker.pose(state.belief.merged()).mean))
    for off, far in ((0.15, False), (0.4, True)):
        marks = dict(zip(JOINTS, places + np.array([off * view.unit, 0.0]), strict=True))
        assert passed(tracker, state, Anchor.of(WALKER, marks), image)[1].began == far


def test_tracking_passes_through_the_marks(begun):
    _, estimate = through(begun, anchor_of(NEARBY))
    assert not estimate.began
    assert estimate.outcome is Outcome.OK
    assert away(estimate, STRIDE).max() > 5.0
    # Marks repeat to 1.5 pixels, hips and knees along the limb to 4; a foot's length is no freedom.
    assert away(estimate, NEARBY).max() < 2.0
    assert away(estimate, NEARBY).mean() < 1.0


def test_one_foot_far_off_is_a_new_start(begun):
    """As where legs were taken for each other; over all joints that is little."""
    lifted = STRIDE + upright(WALKER, knee_far=0.9)
    _, estimate = through(begun, anchor_of(lifted))
    assert estimate.began
    assert away(estimate, lifted).max() < 3.0


def test_the_measurement_is_iterated_until_it_stands(begun, monkeypatch):
    turned = anchor_of(STRIDE + upright(WALKER, knee_near=0.42, knee_far=0.42))
    found = pixels(through(begun, turned)[1])
    monkeypatch.setattr(anchors_module, "ITERATIONS", 20)
    assert_allclose(found, pixels(through(begun, turned)[1]), atol=0.02)


def spread(estimate, joint):
    """(2, 2) covariance, px^2."""
    J = (joint_jacobian(WALKER, estimate.pose.mean) * VIEW.axes[:, None])[JOINTS.index(joint)]
    return J @ estimate.pose.cov @ J.T


def test_a_joint_without_a_mark_measures_nothing(begun):
    few = [name for name in JOINTS if not name.startswith("far")]
    every, some = (through(begun, anchor_of(NEARBY, names))[1] for names in (JOINTS, few))
    ankle = "far_ankle"
    assert np.trace(spread(some, ankle)) > 3.0 * np.trace(spread(every, ankle))
    near = [JOINTS.index(name) for name in few]
    assert away(some, NEARBY)[near].max() < 2.0
    assert away(some, NEARBY)[JOINTS.index(ankle)] > 2.0 * away(every, NEARBY)[JOINTS.index(ankle)]


def test_a_hidden_mark_is_doubted(begun):
    legs = [name for name in JOINTS if "ankle" in name or "knee" in name or "toe" in name]
    seen, unseen = (through(begun, anchor_of(NEARBY, hidden=hidden))[1] for hidden in ((), legs))
    for joint in ("near_ankle", "far_ankle"):
        assert np.trace(spread(unseen, joint)) > 2.0 * np.trace(spread(seen, joint))


def test_a_knee_is_surer_across_its_limb_than_along_it(begun):
    _, estimate = through(begun, anchor_of(NEARBY))
    hip, knee = (pixels(estimate)[JOINTS.index(name)] for name in ("hip", "near_knee"))
    along = (knee - hip) / np.linalg.norm(knee - hip)
    across = np.array([-along[1], along[0]])
    P = spread(estimate, "near_knee")
    assert along @ P @ along > 1.1 * (across @ P @ across)
    assert across @ P @ across < 1.5**2


@pytest.mark.parametrize("breathes", [True, False])
def test_the_base_is_as_sure_whether_the_first_link_breathes_or_not(breathes):
    first, *others = WALKER.links
    figure = replace(WALKER, links=(replace(first, breathes=breathes), *others))
    tracker = SimpleNamespace(figure=figure, view=VIEW)
    base = Anchor.of(figure, {"hip": (0.0, 0.0)})
    sds = np.sqrt(np.linalg.eigvalsh(noise(tracker, base, np.zeros((1, len(figure.freedoms))))[0]))
    assert_allclose(sds, VIEW.unit * np.array([SEEN, ALONG]))


def test_a_toe_marked_nearer_than_the_foot_is_long_only_turns_it(begun):
    """Feet that point towards the camera look short."""
    anchor = anchor_of(NEARBY)
    places, (ankle, toe) = anchor.pixels.copy(), map(JOINTS.index, ("near_ankle", "near_toe"))
    places[toe] = 0.5 * (places[ankle] + places[toe])
    estimate = through(begun, replace(anchor, pixels=places))[1]
    others = [j for j, name in enumerate(JOINTS) if name != "near_toe"]
    assert away(estimate, NEARBY)[others].max() < 2.0


def test_templates_that_slid_are_shifted_without_a_change_of_speed():
    tracker, state, image = at_a_stride("cv")
    for _ in range(4):
        state, _ = tracker.step(state, image)
    shifted = STRIDE + upright(WALKER, root_x=3.0 / VIEW.unit)
    after, estimate = passed(tracker, state, anchor_of(shifted), image)
    d = len(find_model("cv", 30.0, FULL).names)
    x = after.belief.states.mean[0]
    moved = pixels(estimate)[0, 0] - VIEW.to_pixels(joints(WALKER, STRIDE))[0, 0]
    assert moved > 2.0
    assert abs(x[0] - x[d]) * VIEW.unit < 0.5 * moved


@pytest.mark.parametrize("before", [Outcome.OK, Outcome.LOST, Outcome.OUTSIDE])
def test_an_anchor_far_away_or_after_a_loss_is_a_new_start(begun, before):
    by = 0.0 if before is not Outcome.OK else 5.0
    there = NEARBY + upright(WALKER, root_x=by)
    _, estimate = through(begun, anchor_of(there), before)
    assert estimate.began
    assert away(estimate, there).max() < 3.0


def test_a_new_start_keeps_the_figure_s_size_unless_the_marks_know_better(begun):
    tracker, state, image = begun
    grown = STRIDE + upright(WALKER, root_x=1.0, **{SCALE: 0.12})
    _, estimate = anew(tracker, state, anchor_of(grown), image)
    assert away(estimate, grown).max() < 3.0
    assert estimate.pose.mean[WALKER.index(SCALE)] > 0.06
    _, estimate = anew(tracker, state, anchor_of(STRIDE), image)
    assert_allclose(estimate.pose.mean[WALKER.index(SCALE)], 0.0, atol=0.02)


def test_a_new_start_without_a_hip_begins_from_the_pose_there_was(begun):
    names = [name for name in JOINTS if name != "hip"]
    _, estimate = through(begun, anchor_of(NEARBY, names), Outcome.LOST)
    assert estimate.began
    assert away(estimate, NEARBY).max() < 4.0


@pytest.mark.parametrize("light", [0.0, 20.0])
def test_half_of_what_an_anchor_shows_goes_into_the_templates_less_the_light(begun, light):
    tracker, state, image = begun
    state = replace(state, templates=replace(state.templates, light=np.full(3, light)))
    bright = (image // 2 + 100).astype(np.uint8)
    after, estimate = passed(tracker, state, anchor_of(STRIDE), bright)
    now = tracker.templates_at(estimate.pose.mean, bright, state.curve)
    both = now.known & state.templates.known
    assert both.sum() > 300
    halfway = 0.5 * (state.templates.colours + now.colours - light)
    assert_allclose(after.templates.colours[:, both], halfway[:, both], atol=1e-3)


@pytest.mark.parametrize("guessed", [True, False], ids=["hidden", "not-marked"])
def test_a_limb_that_ends_in_a_hidden_joint_shows_nothing(guessed, begun):
    tracker, state, image = begun
    names = [name for name in JOINTS if guessed or name != "near_knee"]
    anchor = anchor_of(STRIDE, names, hidden=("near_knee",))
    after, _ = passed(tracker, state, anchor, (image // 2).astype(np.uint8))
    thigh = state.templates.link == WALKER.link_of("near_knee")
    assert_array_equal(after.templates.colours[:, thigh], state.templates.colours[:, thigh])
    assert (after.templates.colours[:, ~thigh] != state.templates.colours[:, ~thigh]).any()


def test_the_papers_templates_stay_those_of_the_first_frame():
    tracker, state, image = at_a_stride("cv", CLASSIC)
    after, _ = passed(tracker, state, anchor_of(STRIDE), (image // 2).astype(np.uint8))
    assert after.templates is state.templates


def test_marks_of_joints_that_the_figure_has_not_are_left_out():
    anchor = anchor_of(STRIDE, hidden=("neck",), figure=FOOTLESS)
    assert [FOOTLESS.joints[j] for j in anchor.joint] == list(FOOTLESS.joints)
    assert anchor.visible.tolist() == [name != "neck" for name in FOOTLESS.joints]


def test_marks_are_as_sure_on_a_larger_picture(begun):
    tracker, _, _ = begun
    larger = replace(tracker, view=replace(VIEW, unit=4.0 * VIEW.unit))
    anchor, q = anchor_of(STRIDE, hidden=("far_knee",)), STRIDE[None]
    assert_allclose(noise(larger, anchor, q), 16.0 * noise(tracker, anchor, q))
