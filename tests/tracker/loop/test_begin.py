"""The first frame: the belief in marked, unmarked and hidden joints, and the templates of hidden limbs."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.viterbi import viterbi
from kinematics.recover import Start
from kinematics.spm import joint_jacobian
from tests.kinematics.figures import WALKER, upright
from tests.tracker.gaits import gait
from tests.tracker.loop.walks import run, start_of, still
from tests.tracker.painted import FULL, STRIDE, VIEW, Painted, freedoms
from tracker.loop.begin import START_ANGLE, begin, start_belief
from tracker.loop.tracker import make_tracker
from tracker.models.find import find_model


def test_who_leans_more_than_any_model_knows_starts_as_marked(walk, models):
    q = walk.start.q.copy()
    q[WALKER.index("torso")] = np.radians(45.0)
    marked = replace(walk.start, q=q)

    def torso(constant):
        tracker = make_tracker(marked, models["walk-run"], FULL.model_copy(update={"constant": constant}))
        belief = start_belief(tracker, marked)
        return np.degrees(tracker.pose(belief.merged()).mean[WALKER.index("torso")])

    assert torso(0.01) < 30.0  # without it the model's own lean wins
    assert torso(FULL.constant) > 36.0


def test_knees_that_stay_bent_are_expected_to_stay_so_where_they_are_not_seen(walk, models, rng):
    poses, knees = (
        gait("walk", 60, rng, noise=0.0),
        [WALKER.index(name) for name in ("knee_near", "knee_far")],
    )
    poses[:, knees] += np.radians(25.0)
    poses[:, [WALKER.index("hip_near"), WALKER.index("hip_far")]] += np.radians(15.0)
    seen = np.full((len(poses), len(WALKER.freedoms)), np.nan)
    seen[:40, : poses.shape[1]] = poses[:40]

    def straighter(constant):
        settings = FULL.model_copy(update={"constant": constant})
        slds = make_tracker(walk.start, models["walk-run"], settings).slds
        found = viterbi(slds, seen).states.mean @ slds.C.T
        return np.degrees((poses - found[:, : poses.shape[1]])[45:, knees].mean())

    assert straighter(0.01) > 10.0  # without it the knees straighten as in the learned walks
    assert abs(straighter(FULL.constant)) < 7.0


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


def hiding(q, *joints):
    """A start whose every freedom was marked, some joints as hidden; its tracker and picture."""
    start = replace(still(WALKER, q), hidden=frozenset(joints))
    tracker = make_tracker(start, find_model("cv", 30.0, FULL), FULL)
    return tracker, start, Painted(np.random.default_rng(20)).picture(q)


@pytest.mark.parametrize(
    ("hidden", "unknown"),
    [
        ((), set()),
        (("near_ankle", "far_ankle"), {"shank_near", "shank_far", "foot_near", "foot_far"}),
        (("near_ankle",), set()),  # it is taken to look as the far one does
        (("head_top",), {"head"}),
        (("neck",), {"torso", "head"}),
    ],
    ids=lambda names: " ".join(sorted(names)) or "none",
)
def test_links_beyond_a_mark_that_something_hides_are_unknown_but_for_what_their_twins_show(hidden, unknown):
    tracker, start, picture = hiding(STRIDE, *hidden)
    templates = begin(tracker, start, picture)[0].templates
    known = np.bincount(templates.link, templates.known) > 0.0
    assert {link.name for link, seen in zip(WALKER.links, known, strict=True) if not seen} == unknown


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
