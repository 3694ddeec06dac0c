"""The loop: a rendered walk is followed, one hypothesis is a Kalman filter, what hides grows uncertain."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian
from dynamics.kalman import predict
from dynamics.slds import SLDS
from kinematics.figure import SCALE
from kinematics.recover import Start, start_pose
from kinematics.spm import joint_jacobian, joints
from tests.kinematics.figures import FOOTLESS, WALKER, upright
from tests.oracles import condition
from tests.tracker.painted import BARE, FULL, STRIDE, VIEW, Painted, freedoms, levels_of, placed
from tests.tracker.walls import behind_wall
from tracker.loop.begin import START_ANGLE, START_LENGTH, START_PLACE, begin, start_belief
from tracker.loop.estimate import Estimate, State
from tracker.loop.judging import LEAST_INSIDE, judged
from tracker.loop.outcome import Outcome
from tracker.loop.tracker import ANKLE_KEEP, BREATH_KEEP, Tracker, make_tracker
from tracker.models.find import find_model
from tracker.picture.backdrop import ALIKE, UNKNOWN, UNSEEN, Scenery, first_backdrop
from tracker.registration.align import align
from tracker.registration.field import Field, Registration
from tracker.registration.templates import Templates
from tracker.scene.film import render
from tracker.settings import Settings

FRAMES = 20
# A part of the frame that is always the whole frame: what lies outside is then the frame's own edge.
WHOLE = FULL.model_copy(update={"margin": 50.0})


@dataclass(frozen=True)
class Walk:
    """The first frames of a rendered walk."""

    images: list
    joints: dict
    start: Start
    leg_px: float


def start_of(places, facing, without=()):
    return start_pose(
        WALKER, {name: tuple(at[0]) for name, at in places.items() if name not in without}, facing
    )


@pytest.fixture(scope="module")
def scene():
    """A walker whom no shrub hides."""
    return render(5, frames=72, size=(480, 270), shrubs=False)


@pytest.fixture(scope="module")
def walk(scene):
    places = {name: at[:FRAMES] for name, at in scene.joints.items()}
    return Walk(scene.images[:FRAMES], places, start_of(places, scene.facing), scene.leg_px)


@pytest.fixture(scope="module")
def models():
    return {name: find_model(name, 30.0, FULL) for name in ("walk-run", "walk-run-1", "cv")}


def run(tracker, start, images):
    """One estimate an image, the first of which is the marked one."""
    images = iter(images)
    state, estimate = begin(tracker, start, next(images))
    yield estimate
    for image in images:
        state, estimate = tracker.step(state, image)
        yield estimate


def pixels(start, estimates):
    """(T, J, 2)"""
    return np.stack([start.view.to_pixels(joints(start.figure, e.pose.mean)) for e in estimates])


@pytest.mark.parametrize("name", ["walk-run", "walk-run-1", "cv"])
def test_a_rendered_walk_is_followed(name, walk, models):
    tracker = make_tracker(walk.start, models[name], Settings())
    estimates = list(run(tracker, walk.start, walk.images))
    assert len(estimates) == FRAMES
    truth = np.stack([walk.joints[joint] for joint in walk.start.figure.joints], axis=1)
    away = np.linalg.norm(pixels(walk.start, estimates) - truth, axis=-1) / walk.leg_px
    # Hands mark joints to 0.02 leg; the cloth slides over the bones of this walker by about as much again.
    assert away.mean() < 0.05
    assert away.mean(axis=1).max() < 0.12
    # Standing still where it was marked would be off by more than half a leg at the end.
    assert np.linalg.norm(truth[-1] - truth[0], axis=-1).mean() / walk.leg_px > 0.5
    assert {e.outcome for e in estimates} <= {"ok", "hidden"}


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


def field_of(tracker: Tracker, templates: Templates, state: State, image) -> Field:
    """What the templates are laid on: the whole frame, before the scene as the loop has come to know it."""
    view, settings = tracker.view.shifted(state.shift), tracker.settings
    levels = levels_of(image, settings, view, curve=state.curve)
    return Field(templates, levels, tracker.figure, view, settings, state.scenery)


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


def mixture(tracker: Tracker, hypotheses: list[Hypothesis]) -> tuple[np.ndarray, Gaussian]:
    """Weights, and the moments of the pose over all hypotheses."""
    cost = np.array([h.cost for h in hypotheses])
    weights = np.exp(cost.min() - cost) / np.exp(cost.min() - cost).sum()
    C = tracker.slds.C
    mean = sum(w * (C @ h.mean) for w, h in zip(weights, hypotheses, strict=True))
    cov = np.zeros((len(C), len(C)))
    for w, h in zip(weights, hypotheses, strict=True):
        apart = C @ h.mean - mean
        cov += w * (C @ h.cov @ C.T + np.outer(apart, apart))
    return weights, Gaussian(mean + tracker.offset, cov)


def check_against_twin(walk: Walk, slds: SLDS, frames: int) -> None:
    tracker = make_tracker(walk.start, slds, WHOLE)
    state, estimate = begin(tracker, walk.start, walk.images[0])
    # A scene known everywhere, from when the walker had gone on.
    beside = (-9.0, -9.0, -1.0, -1.0)
    state = replace(state, backdrop=first_backdrop(walk.images[-1], beside, tracker.view.unit, state.curve))
    hypotheses = began(tracker, walk.start)
    _, pose = mixture(tracker, hypotheses)
    # Both invert covariances whose axes differ by up to 1e6 in size: 1e6 * 2e-16 a step, a search between.
    assert_allclose(estimate.pose.mean, pose.mean, atol=1e-8)
    for image in walk.images[1:frames]:
        old = state.templates
        state, estimate = tracker.step(state, image)
        field = field_of(tracker, old, state, image)
        hypotheses, found = stepped(tracker, field, hypotheses)
        weights, pose = mixture(tracker, hypotheses)
        assert_allclose(state.belief.weights, weights, atol=1e-6)
        assert_allclose(estimate.pose.mean, pose.mean, atol=1e-7)
        assert_allclose(estimate.pose.cov, pose.cov, atol=1e-6 * pose.cov.max())
        assert estimate.s == state.belief.s[weights.argmax()]
        best = found[int(weights.argmax())]
        assert estimate.misfit == pytest.approx(best.misfit, abs=1e-6)
        seen, new = field.seen(best), field.new(best)
        place = placed(tracker.figure, best.q, old) * (field.view.facing, -1.0)
        assert new.any()
        refreshed = old.learned(seen, new, place).refreshed(seen, best.match, WHOLE.blend, best.offset)
        assert_allclose(state.templates.colours, refreshed.colours, atol=1e-3)
        assert_allclose(state.templates.place, refreshed.place, atol=1e-6)
        assert_array_equal(state.templates.alike, refreshed.alike)
        assert_allclose(state.templates.light, refreshed.light, atol=1e-3)
        assert state.scenery.differs.max() > 1.0 > ALIKE > np.median(state.scenery.differs)


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


@pytest.mark.parametrize("name", ["cv", "walk-run-1"])
def test_one_hypothesis_is_the_extended_kalman_filter(name, walk):
    slds = find_model(name, 30.0, FULL.model_copy(update={"surprise": 0.0}))
    assert slds.K == 1
    check_against_twin(walk, slds, frames=5)


def test_hypotheses_cost_their_past_the_switch_and_the_evidence_of_their_picture(walk, models):
    assert models["walk-run"].K > 1
    check_against_twin(walk, models["walk-run"], frames=4)


def test_a_switch_that_cannot_be_is_never_made(walk, models):
    slds = models["walk-run"]
    stuck = replace(slds, Pi=np.eye(slds.K), pi0=np.eye(slds.K)[1])
    tracker = make_tracker(walk.start, stuck, FULL)
    assert {estimate.s for estimate in run(tracker, walk.start, walk.images[:3])} == {1}


def test_who_leans_more_than_any_model_knows_starts_as_marked(walk, models):
    q = walk.start.q.copy()
    q[WALKER.index("torso")] = np.radians(45.0)
    marked = replace(walk.start, q=q)

    def torso(lean):
        tracker = make_tracker(marked, models["walk-run"], FULL.model_copy(update={"lean": lean}))
        belief = start_belief(tracker, marked)
        return np.degrees(tracker.pose(belief.merged()).mean[WALKER.index("torso")])

    assert torso(0.01) < 30.0  # without it the model's own lean wins
    assert torso(FULL.lean) > 36.0


def still(figure, q):
    """A start whose every freedom was marked."""
    return Start(figure, VIEW, q, np.ones(len(q), dtype=bool))


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


def begun(rng, settings=FULL, name="cv"):
    painted, start = Painted(rng), still(WALKER, STRIDE)
    tracker = make_tracker(start, find_model(name, 30.0, settings), settings)
    state, estimate = begin(tracker, start, painted.picture(STRIDE))
    return painted, tracker, state, estimate


def test_where_nothing_matches_the_figure_is_lost_and_templates_are_kept(rng):
    _, tracker, state, _ = begun(rng)
    height, width = 190, 180
    blocks = rng.integers(0, 2, (height // 5, width // 5, 3)) * 255
    after, estimate = tracker.step(state, np.kron(blocks, np.ones((5, 5, 1))).astype(np.uint8))
    assert estimate.outcome == "lost"
    assert after.templates is state.templates


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


def test_a_figure_that_stands_still_is_ok_and_its_templates_take_their_share(rng):
    painted, tracker, state, first = begun(rng)
    after, estimate = tracker.step(state, painted.picture(STRIDE, light=np.full(len(WALKER.links), 8.0)))
    assert (first.outcome, estimate.outcome) == ("ok", "ok")
    assert after.templates is not state.templates
    assert (after.templates.known | ~state.templates.known).all()


def test_facing_left_is_the_mirror_image_of_facing_right(walk, models):
    width = walk.images[0].shape[1]
    flipped = {name: np.array([width - 1, 0]) + at * [-1, 1] for name, at in walk.joints.items()}
    other = start_of(flipped, -walk.start.view.facing)
    tracks = [
        pixels(start, run(make_tracker(start, models["walk-run"], FULL), start, images))
        for start, images in (
            (walk.start, walk.images[:8]),
            (other, [np.ascontiguousarray(image[:, ::-1]) for image in walk.images[:8]]),
        )
    ]
    # The parts that are blurred end at other pixels, which moves values by some hundredths of a grey level.
    assert_allclose(tracks[1], np.array([width - 1, 0]) + tracks[0] * [-1, 1], atol=0.1)
    assert np.abs(tracks[0][-1] - tracks[0][0]).max() > 10.0


def test_where_the_figure_stands_in_the_picture_does_not_matter(walk, models):
    by = np.array([37, 21])
    shifted = {name: at + by for name, at in walk.joints.items()}
    other = start_of(shifted, walk.start.view.facing)
    wide = [np.pad(image, ((21, 0), (37, 0), (0, 0)), mode="edge") for image in walk.images[:6]]
    near, far = (
        pixels(start, run(make_tracker(start, models["walk-run"], FULL), start, images))
        for start, images in ((walk.start, walk.images[:6]), (other, wide))
    )
    # Places some hundred pixels off are rounded at 1e-13; the search stops where it may.
    assert_allclose(far, near + by, atol=1e-3)


@pytest.mark.parametrize("name", ["cv", "walk-run"])
def test_an_ankle_that_was_not_marked_is_uncertain_at_first(name, walk, models):
    start = start_of(walk.joints, walk.start.view.facing, without=("far_ankle", "far_toe"))
    tracker = make_tracker(start, models[name], FULL)
    _, estimate = begin(tracker, start, walk.images[0])
    J = joint_jacobian(start.figure, estimate.pose.mean)
    spread = np.sqrt(np.einsum("jad,de,jae->j", J, estimate.pose.cov, J))
    at = dict(zip(start.figure.joints, spread, strict=True))
    assert at["far_ankle"] > 2.0 * at["near_ankle"]
    assert at["far_ankle"] > 0.1  # leg lengths: a knee swings a shank of 0.5 through a radian
    # Marks are off by 4 degrees of at most a leg, and by the hip's own 0.02.
    assert at["far_knee"] < 0.1
    assert at["near_ankle"] < 0.15


def test_the_first_estimate_is_the_marked_pose_where_the_model_does_not_object(walk, models):
    tracker = make_tracker(walk.start, models["cv"], FULL)
    estimate = next(iter(run(tracker, walk.start, walk.images)))
    # The model's first belief is 1 leg or radian wide, the marks 0.09: 0.8 % of the way to zero.
    ankles = [WALKER.index(name) for name in ("ankle_near", "ankle_far")]
    assert_allclose(np.delete(estimate.pose.mean, ankles), np.delete(walk.start.q, ankles), atol=0.008)
    # An ankle, of which no model speaks, is 25 degrees wide.
    marked = walk.start.q[ankles] / (1.0 + (np.degrees(START_ANGLE) / 25.0) ** 2)
    assert_allclose(estimate.pose.mean[ankles], marked, rtol=1e-9)
    assert estimate.outcome == "ok"


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


def test_a_learned_model_knows_the_neck_by_its_deviation_from_the_marked_one(models):
    start = still(WALKER, upright(WALKER, neck=0.5))
    neck = WALKER.index("neck")
    learned = make_tracker(start, models["walk-run-1"], FULL)
    assert_array_equal(np.flatnonzero(learned.offset), [neck])
    assert learned.offset[neck] == 0.5
    assert not make_tracker(start, models["cv"], FULL).offset.any()


def test_scale_and_stretches_join_the_model_s_freedoms(models):
    start = still(WALKER, STRIDE)
    for name in ("walk-run", "cv"):
        slds = models[name]
        N, d = slds.A.shape[-1], len(slds.names)
        full = make_tracker(start, slds, FULL).slds
        assert_allclose(full.Q[:, :N, :N], slds.Q, rtol=1e-12)
        assert full.names == WALKER.freedoms
        assert_allclose(full.C[:d, :N], slds.C)


def test_a_model_of_other_freedoms_is_refused_with_what_to_do(models):
    slds = models["cv"]
    renamed = replace(slds, names=("elbow", *slds.names[1:]))
    with pytest.raises(ValueError, match=r"elbow.*learn a model for this figure"):
        make_tracker(still(WALKER, STRIDE), renamed, FULL)


def hiding(q, *joints):
    """A start whose every freedom was marked, some joints as hidden; its tracker and picture."""
    start = replace(still(WALKER, q), hidden=frozenset(joints))
    tracker = make_tracker(start, find_model("cv", 30.0, FULL), FULL)
    return tracker, start, Painted(np.random.default_rng(20)).picture(q)


@pytest.mark.parametrize(
    ("hidden", "strange"),
    [
        ((), set()),
        (("near_ankle", "far_ankle"), {"shank_near", "shank_far", "foot_near", "foot_far"}),
        (("near_ankle",), set()),  # it is taken to look as the far one does
        (("head_top",), {"head"}),
        (("neck",), {"torso", "head"}),
    ],
    ids=lambda names: " ".join(sorted(names)) or "none",
)
def test_links_beyond_a_mark_that_something_hides_are_strange_but_for_what_their_twins_show(hidden, strange):
    tracker, start, picture = hiding(STRIDE, *hidden)
    templates = begin(tracker, start, picture)[0].templates
    assert {link.name for link, odd in zip(WALKER.links, templates.strange, strict=True) if odd} == strange


def test_what_a_hidden_limb_is_taken_to_show_is_not_what_hides_it():
    frank, hidden = (
        begin(tracker, start, picture)[0].templates
        for tracker, start, picture in (hiding(STRIDE), hiding(STRIDE, "near_ankle"))
    )
    shank = frank.link == WALKER.link_of("near_ankle")
    assert not np.isclose(hidden.colours[:, shank], frank.colours[:, shank]).all(axis=(0, 2)).any()


def test_a_foreshortened_foot_is_taken_to_look_as_its_twin_does():
    tracker, start, picture = hiding(STRIDE)
    short = replace(start, foreshortened=frozenset({"foot_near"}))
    frank, taken = (begin(tracker, one, picture)[0].templates for one in (start, short))
    near, far = (frank.link == WALKER.link_of(joint) for joint in ("near_toe", "far_toe"))
    assert taken.known[near].mean() > 0.5
    looks = {tuple(colour) for colour in taken.colours[-1, far]}
    assert {tuple(colour) for colour in taken.colours[-1, near & taken.known]} <= looks
    assert_array_equal(taken.colours[:, ~near], frank.colours[:, ~near])


def test_a_mark_hidden_by_the_figure_s_own_nearer_leg_is_as_good_as_any():
    crossed = upright(WALKER, hip_near=0.1, hip_far=0.15, knee_far=0.1)
    (tracker, frank, picture), (_, hidden, _) = hiding(crossed), hiding(crossed, "far_knee", "far_ankle")
    before, after = (begin(tracker, start, picture)[0] for start in (frank, hidden))
    assert_array_equal(after.templates.known, before.templates.known)
    assert_array_equal(after.templates.colours, before.templates.colours)
    assert_array_equal(after.belief.states.cov, before.belief.states.cov)


def test_a_limb_with_a_hidden_tip_is_believed_half_as_sharply_in_its_angle_and_of_any_length():
    tracker, start, _ = hiding(STRIDE, "near_ankle")
    shank, knee = freedoms(WALKER, "shank_near", "knee_near")
    known = np.arange(len(STRIDE)) != shank
    frank, hidden, unmarked = (
        tracker.pose(start_belief(tracker, one).merged())
        for one in (replace(start, hidden=frozenset()), start, Start(WALKER, VIEW, STRIDE, known))
    )
    sd = [np.sqrt(np.diag(pose.cov)) for pose in (frank, hidden, unmarked)]
    # The model's own first belief, 1 radian wide, narrows 8 degrees by 1 %.
    assert sd[1][knee] == pytest.approx(2.0 * sd[0][knee], rel=0.02)
    assert sd[1][shank] == pytest.approx(sd[2][shank], rel=1e-9)
    assert sd[2][shank] > 2.0 * sd[0][shank]
    others = [i for i in range(len(STRIDE)) if i not in (knee, shank)]
    assert_allclose(sd[1][others], sd[0][others], rtol=1e-9)


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


@pytest.mark.parametrize("fps", [24.0, 60.0, 240.0])
def test_ankles_stretches_and_size_drift_as_far_in_a_second_at_any_frame_rate(fps, walk):
    slds = make_tracker(walk.start, find_model("cv", fps, FULL), FULL).slds
    n = len(slds.drifts)
    keep, noise = slds.A[0].diagonal()[-n:], slds.Q[0].diagonal()[-n:]
    ankles = slds.drifts.index("scale")
    assert_allclose(keep[:ankles] ** fps, ANKLE_KEEP**30, rtol=1e-9)
    assert_allclose(keep[ankles + 1 :] ** fps, BREATH_KEEP**30, rtol=1e-9)
    assert noise[ankles] * fps == pytest.approx(FULL.scale_drift**2 * 30)
    spread = noise[:ankles] / (1.0 - keep[:ankles] ** 2)
    assert_allclose(np.sqrt(spread), np.radians(FULL.ankle), rtol=1e-9)


def test_templates_are_renewed_as_fast_in_a_second_at_any_frame_rate(walk, monkeypatch):
    shares = []
    monkeypatch.setattr(
        Templates, "refreshed", lambda self, seen, trust, blend, offset: shares.append(blend) or self
    )
    for fps in (24.0, 30.0, 60.0):
        tracker = make_tracker(walk.start, find_model("cv", fps, FULL), FULL)
        state, _ = begin(tracker, walk.start, walk.images[0])
        tracker.step(state, walk.images[1])
    at_24, at_30, at_60 = shares
    assert at_24 == at_30 == pytest.approx(FULL.blend)
    assert (1.0 - at_60) ** 2 == pytest.approx(1.0 - FULL.blend)


def test_the_searched_box_covers_wide_links():
    wide = replace(WALKER, links=tuple(replace(link, width=1.6, taper=1.2) for link in WALKER.links))
    for figure, margin in ((WALKER, FULL.margin), (wide, 0.96)):
        pose = np.zeros(len(figure.freedoms))
        tracker = SimpleNamespace(figure=figure, view=VIEW, settings=FULL)
        pixels = VIEW.to_pixels(joints(figure, pose))
        wanted = np.array([pixels.min(0), pixels.max(0)]) + margin * VIEW.unit * np.array([[-1.0], [1.0]])
        assert_allclose(Tracker.box(tracker, pose[None]), wanted.ravel())
