"""Limbs and figures that are hidden, lost or outside the picture, and how they are found again."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from dynamics.gaussian import Gaussian
from kinematics.spm import joint_jacobian, joints
from tests.kinematics.figures import FOOTLESS, WALKER, upright
from tests.tracker.loop.walks import WHOLE, begun, field_of, pixels, run, start_of, still
from tests.tracker.painted import BARE, FULL, STRIDE, VIEW, Painted
from tests.tracker.walls import behind_wall
from tracker.loop.begin import begin
from tracker.loop.estimate import Estimate
from tracker.loop.judging import LEAST_INSIDE, judged
from tracker.loop.outcome import Outcome
from tracker.loop.tracker import make_tracker
from tracker.models.find import find_model
from tracker.picture.backdrop import ALIKE, UNKNOWN, UNSEEN, Scenery
from tracker.registration.align import align
from tracker.settings import Settings


def test_a_limb_that_shows_the_bare_scene_is_hidden(walk, models):
    tracker, image = make_tracker(walk.start, models["cv"], WHOLE), walk.images[0]
    state, estimate = begin(tracker, walk.start, image)
    field = field_of(tracker, state.templates, state, image)
    (found,) = align(field, Gaussian(estimate.pose.mean[None], 1e-9 * estimate.pose.cov[None]))

    def outcome(scenery):
        return judged(replace(field, scenery=scenery), Outcome.OK, found.q, found, image.shape[:2])

    assert outcome(UNSEEN) is Outcome.OK
    differs = np.full(image.shape[:2], UNKNOWN, np.float32)
    shank = state.templates.link == [link.name for link in WALKER.links].index("shank_near")
    column, row = np.floor(found.pixels[shank] + 0.5).astype(int).T
    differs[row, column] = 0.0
    assert outcome(Scenery(differs, 1)) is Outcome.HIDDEN
    differs[row, column] = 2.0 * ALIKE
    assert outcome(Scenery(differs, 1)) is Outcome.OK


@pytest.fixture(scope="module")
def passing():
    """A near leg that swings past a far one at rest, broad enough to hide it for four frames; no feet."""
    broad = ("thigh_near", "shank_near")
    links = [replace(link, width=0.34, taper=1.0) if link.name in broad else link for link in FOOTLESS.links]
    figure = replace(FOOTLESS, links=tuple(links))
    swing = [0.8, 0.72, 0.64, 0.5, 0.3, 0.08, 0.0, 0.0, 0.0, -0.08, -0.3, -0.5, -0.64, -0.72, -0.8]
    poses = [upright(figure, hip_near=angle, torso=0.05) for angle in swing]
    painted, noise = Painted(np.random.default_rng(3), figure), np.random.default_rng(4)
    images = [painted.picture(q, noise=2.0, rng=noise) for q in poses]
    start = still(figure, poses[0])
    settings = BARE.model_copy(update={"cv_angle": 2.0, "cv_place": 0.01})
    tracker = make_tracker(start, find_model("cv", 30.0, settings), settings)
    return figure, poses, list(run(tracker, start, images))


HIDDEN = slice(5, 10)  # frames in which the near thigh is within 0.1 rad of the far one


def ankle_variance(figure, estimate: Estimate, joint: str) -> float:
    """px^2, both axes."""
    J = VIEW.unit * joint_jacobian(figure, estimate.pose.mean)[figure.joints.index(joint)]
    return float(np.trace(J @ estimate.pose.cov @ J.T))


def test_a_leg_grows_uncertain_while_it_is_hidden_and_sure_again_after(passing):
    figure, _, estimates = passing
    far = np.array([ankle_variance(figure, e, "far_ankle") for e in estimates])
    near = np.array([ankle_variance(figure, e, "near_ankle") for e in estimates])
    assert (np.diff(far[5:9]) > 0).all()
    assert far[HIDDEN].max() > 5.0 * far[2]
    assert far[-1] < 0.3 * far[HIDDEN].max()
    assert near[HIDDEN].max() < 2.0 * near[2]


def test_a_covered_leg_is_named_hidden_and_one_in_the_open_ok(passing):
    _, _, estimates = passing
    outcomes = [e.outcome for e in estimates]
    assert set(outcomes[HIDDEN]) == {"hidden"}
    assert set(outcomes[:3]) == {"ok"}
    assert set(outcomes[-3:]) == {"ok"}


def test_the_leg_that_was_hidden_is_found_again(passing):
    figure, poses, estimates = passing
    away = VIEW.unit * np.linalg.norm(
        joints(figure, estimates[-1].pose.mean) - joints(figure, poses[-1]), axis=-1
    )
    assert away.max() < 2.0  # pixels; half a pixel where registration is weak and a prior stronger


def test_a_figure_that_left_the_frame_is_outside_and_templates_are_kept(rng):
    painted, tracker, state, _ = begun(rng)
    mean = state.belief.states.mean.copy()
    mean[:, tracker.slds.names.index("root_x")] += 4.0
    gone = replace(state, belief=replace(state.belief, states=Gaussian(mean, 1e-6 * state.belief.states.cov)))
    after, estimate = tracker.step(gone, painted.picture(STRIDE))
    assert estimate.outcome == "outside"
    assert after.templates is state.templates


@pytest.mark.parametrize("before", [Outcome.LOST, Outcome.OUTSIDE, Outcome.OK])
def test_only_after_a_loss_a_figure_is_sought_where_it_may_have_gone(before, rng):
    painted, start = Painted(rng, size=(280, 190)), still(WALKER, STRIDE)
    tracker = make_tracker(start, find_model("cv", 30.0, FULL), FULL)
    state, _ = begin(tracker, start, painted.picture(STRIDE))
    N, M = tracker.slds.C.shape[::-1]
    aside = np.zeros(N)
    aside[[0, N - M]] = 0.4  # legs, the pose and the one before it alike
    states = state.belief.states
    wide = replace(state.belief, states=Gaussian(states.mean, states.cov + np.outer(aside, aside)))
    want = STRIDE + upright(WALKER, root_x=0.7)
    _, estimate = tracker.step(replace(state, belief=wide, outcome=before), painted.picture(want))
    away = np.linalg.norm(joints(WALKER, estimate.pose.mean) - joints(WALKER, want), axis=-1).mean()
    if before is Outcome.OK:
        assert away > 0.3
    else:
        assert estimate.outcome == "found"
        assert away < 0.03


@dataclass(frozen=True)
class Disturbed:
    """A walk followed while a wall hides it.

    covered : (T,) whether the walker is wholly behind the wall; `bare`: wholly in the open
    away    : (T,) mean error of the joints, leg lengths
    """

    covered: np.ndarray
    bare: np.ndarray
    away: np.ndarray
    estimates: list

    @property
    def outcomes(self):
        return [e.outcome for e in self.estimates]


@pytest.fixture(scope="module")
def long_walk(scene):
    """With what the walker's body spans in each frame, pixels."""
    x = np.stack([places[:, 0] for places in scene.joints.values()])
    half = 0.12 * scene.leg_px  # of a trunk, and a head before its joints
    return scene, x.min(0) - half, x.max(0) + half


def followed(scene, images, name="walk-run"):
    """Estimates, and their mean errors in leg lengths."""
    start = start_of(scene.joints, scene.facing)
    estimates = list(run(make_tracker(start, find_model(name, 30.0, Settings()), Settings()), start, images))
    truth = np.stack([scene.joints[joint] for joint in start.figure.joints], axis=1)[: len(images)]
    return estimates, np.linalg.norm(pixels(start, estimates) - truth, axis=-1).mean(1) / scene.leg_px


@pytest.fixture(scope="module", params=["a curtain that falls", "a wall on the way"])
def disturbed(request, long_walk):
    """Ten frames and more behind a wall, which comes all at once or step by step."""
    scene, low, high = long_walk
    hidden = slice(10, 20) if "curtain" in request.param else slice(30, 40)
    first, last = int(low[hidden].min()), int(np.ceil(high[hidden].max()))
    T = 30 if "curtain" in request.param else 72
    there = np.zeros(T, dtype=bool)
    there[hidden if "curtain" in request.param else slice(None)] = True
    images = [
        behind_wall(image, first, last) if there[t] else image for t, image in enumerate(scene.images[:T])
    ]
    low, high = low[:T], high[:T]
    return Disturbed(
        there & (low >= first) & (high <= last),
        ~there | (high < first) | (low > last),
        *reversed(followed(scene, images)),
    )


def test_a_figure_behind_a_wall_is_lost_or_hidden_within_three_frames(disturbed):
    covered = np.flatnonzero(disturbed.covered)
    assert len(covered) >= 10
    assert {disturbed.outcomes[t] for t in covered[3:]} <= {"lost", "hidden"}
    assert "lost" in {disturbed.outcomes[t] for t in covered[:4]}
    assert not set(disturbed.outcomes[: covered[0]]) & {"outside"}


def test_a_lost_figure_grows_uncertain_from_frame_to_frame(disturbed):
    root = np.array([np.trace(e.pose.cov[:2, :2]) for e in disturbed.estimates])
    lost = np.array([not outcome.measured for outcome in disturbed.outcomes])
    first, last = np.flatnonzero(lost)[[0, -1]]
    assert last - first >= 9
    assert lost[first : last + 1].all()
    grown = root[first : last + 1]
    assert (np.diff(grown[:10]) > 0.0).all()
    # A gait speeds up and slows down in every step, and so does what is not known of it.
    assert (grown[10:] > grown[:-10]).all()


def test_a_figure_that_comes_from_behind_a_wall_is_found_and_its_joints_are_right_again(disturbed):
    back = np.flatnonzero(disturbed.covered)[-1] + 1
    back += int(disturbed.bare[back:].argmax())
    assert "found" in disturbed.outcomes[: back + 6]
    assert set(disturbed.outcomes[back + 5 :]) <= {"ok", "hidden", "found"}
    assert disturbed.away[back + 5 :].max() < 0.1


def test_a_figure_in_the_open_before_a_wall_is_neither_lost_nor_found(disturbed):
    open_before = disturbed.bare & (np.arange(len(disturbed.bare)) < np.flatnonzero(disturbed.covered)[0])
    assert {disturbed.outcomes[t] for t in np.flatnonzero(open_before)} <= {"ok", "hidden"}
    assert disturbed.away[open_before].max() < 0.1


def test_a_figure_that_leaves_the_picture_is_outside_within_three_frames_and_stays_so(long_walk):
    scene, _, _ = long_walk
    assert scene.facing == -1
    edge = int(scene.joints["hip"][30, 0])  # the picture begins where the hip is in this frame
    cut = [np.ascontiguousarray(image[:, edge:]) for image in scene.images[:60]]
    places = {name: at - [edge, 0] for name, at in scene.joints.items()}
    estimates, away = followed(replace(scene, joints=places), cut)
    outcomes = [e.outcome for e in estimates]
    x = np.stack([at[:60, 0] for at in places.values()])
    share = (x >= 0).mean(0)
    gone = int((share < LEAST_INSIDE).argmax())
    assert 30 <= gone < 50
    assert not any(outcome.measured for outcome in outcomes[gone + 3 :])
    assert "outside" in outcomes[gone : gone + 4]
    assert set(outcomes[: int((share < 1.0).argmax())]) <= {"ok", "hidden"}
    assert "outside" not in outcomes[: int((share < 0.5).argmax())]
    assert away[: int((share < 0.7).argmax())].max() < 0.1
