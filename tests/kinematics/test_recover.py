"""Poses from marked joints: there and back, what is missing, which way the figure faces, what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kinematics.figure import SCALE, STRETCH
from kinematics.recover import PoseError, facing_of, facing_told, met, recover, start_pose
from kinematics.spm import joints
from tests.kinematics.figures import (
    FOOTLESS,
    HORSE,
    WALKER,
    Puppet,
    every_figure,
    marks_of,
    random_pose,
    upright,
)

BREATHING = replace(HORSE, links=tuple(replace(link, breathes=True) for link in HORSE.links))

TOES = ("near_toe", "far_toe")
either_way = pytest.mark.parametrize("facing", [1, -1], ids=["right", "left"])

# Joints near 1 leg length, links of 0.2 and more: angles to 10 * 2e-16 / 0.2.
ROUNDING = {"rtol": 0.0, "atol": 1e-12}


def uneven(figure, rng):
    """The figure with other lengths, each side its own, and one leg length to a leg on average.

    No link is so short beside its twin that it must be foreshortened.
    """
    lengths = [link.length * rng.uniform(0.9, 1.15) for link in figure.links]
    legs = [length for link, length in zip(figure.links, lengths, strict=True) if figure.is_leg(link)]
    return figure.with_lengths([length / (0.5 * sum(legs)) for length in lengths])


def person(figure, rng):
    """The figure with other lengths, the same on both sides, and one leg length to a leg."""
    lengths = {link.name.split("_")[0]: link.length * rng.uniform(0.7, 1.3) for link in figure.links}
    leg = sum(lengths[part] for part in figure.leg)
    return figure.with_lengths([lengths[link.name.split("_")[0]] / leg for link in figure.links])


def lengths_in(start):
    """(L,) leg lengths of the links as they are at the start, stretched."""
    figure, layout = start.figure, start.figure.layout
    stretch = np.where(layout.breathes, start.q[layout.stretch], 0.0)
    return np.array([link.length for link in figure.links]) * np.exp(stretch)


@every_figure
def test_recover_reads_place_and_angles_whatever_the_lengths(figure, rng):
    for _ in range(30):
        q = random_pose(figure, rng)
        back, known = recover(figure, Puppet(figure, q).joints())
        D = len(figure.pose_freedoms)
        assert_allclose(back[:D], q[:D], **ROUNDING)
        assert_array_equal(back[D:], 0.0)
        assert known.all()


@every_figure
@either_way
@pytest.mark.parametrize("body", [person, uneven])
def test_a_marked_frame_gives_back_pose_lengths_and_view(figure, body, facing, rng):
    for _ in range(5):
        someone, q = body(figure, rng), random_pose(figure, rng, size=0.0)
        start = start_pose(figure, marks_of(someone, q, facing=facing, unit=83.0), facing)
        to_scale = slice(figure.index(SCALE) + 1)
        assert_allclose(start.q[to_scale], q[to_scale], **ROUNDING)
        assert start.known.all()
        assert start.view.origin == (320.0, 200.0)
        assert start.view.unit == pytest.approx(83.0, rel=1e-12)
        assert start.view.facing == facing
        assert_allclose(lengths_in(start), [link.length for link in someone.links], rtol=1e-12)
        want = list(marks_of(someone, q, facing=facing, unit=83.0).values())
        assert_allclose(start.view.to_pixels(joints(start.figure, start.q)), want, atol=1e-10)


def test_twins_are_alike_at_rest_stretched_at_the_start_and_the_unit_is_the_mean_of_the_legs():
    sizes = {"torso": 60.0, "head": 30.0, "thigh_near": 52.0, "shank_near": 50.0}
    sizes |= {"thigh_far": 48.0, "shank_far": 42.0, "foot_near": 20.0, "foot_far": 24.0}
    limping = WALKER.with_lengths([sizes[link.name] for link in WALKER.links])
    start = start_pose(WALKER, marks_of(limping, upright(WALKER, hip_near=0.3), unit=1.0), 1)
    assert start.view.unit == pytest.approx(0.5 * (52.0 + 50.0 + 48.0 + 42.0))
    assert_allclose(96.0 * lengths_in(start), [sizes[link.name] for link in WALKER.links])
    rest = {link.name: 96.0 * link.length for link in start.figure.links}
    thigh, shank = np.sqrt(52.0 * 48.0), np.sqrt(50.0 * 42.0)
    assert rest == pytest.approx(
        sizes | {"thigh_near": thigh, "thigh_far": thigh, "shank_near": shank, "shank_far": shank}
    )
    # Neither torso nor head has a twin, and feet do not breathe.
    alone = [start.figure.index(STRETCH + name) for name in ("torso", "head")]
    assert_array_equal(start.q[alone], 0.0)


@pytest.mark.parametrize(("share", "turned"), [(0.5, True), (0.7, True), (0.8, False), (1.3, False)])
def test_a_foot_that_looks_much_shorter_than_the_other_is_foreshortened(share, turned):
    far = WALKER.links[WALKER.link_of("far_toe")].length
    sizes = {"foot_near": share * far}
    turning = WALKER.with_lengths([sizes.get(link.name, link.length) for link in WALKER.links])
    q = upright(WALKER, ankle_near=-0.4, hip_near=0.2)
    start = start_pose(WALKER, marks_of(turning, q), 1)
    assert start.foreshortened == ({"foot_near"} if turned else set())
    near = start.figure.links[WALKER.link_of("near_toe")].length
    assert near == pytest.approx(far if turned else share * far)
    # It still points where it was marked.
    assert_allclose(start.q[start.figure.index("ankle_near")], -0.4, **ROUNDING)


def test_a_shank_that_looks_short_is_stretched_not_foreshortened():
    sizes = {"shank_near": 0.2}
    bent = WALKER.with_lengths([sizes.get(link.name, link.length) for link in WALKER.links])
    start = start_pose(WALKER, marks_of(bent, upright(WALKER)), 1)
    assert not start.foreshortened
    assert start.q[start.figure.index(STRETCH + "shank_near")] < -0.3


@pytest.mark.parametrize("without", [("far_ankle",), ("near_ankle",), ("far_ankle", "far_toe")])
def test_a_missing_ankle_takes_its_twins_shank_a_straight_knee_and_a_square_foot(without, rng):
    someone, q = person(WALKER, rng), random_pose(WALKER, rng, size=0.0)
    start = start_pose(WALKER, marks_of(someone, q, without=without), 1)
    side = without[0].removesuffix("_ankle")
    unseen = [WALKER.index(name) for name in (f"knee_{side}", f"ankle_{side}", f"stretch_shank_{side}")]
    assert_array_equal(np.flatnonzero(~start.known), unseen)
    assert_array_equal(start.q[unseen], 0.0)
    assert_allclose(np.delete(start.q, unseen), np.delete(q, unseen), **ROUNDING)
    assert_allclose(start.figure.layout.length, someone.layout.length, rtol=1e-12)


def test_without_both_ankles_the_shank_is_the_proportion_of_what_was_seen():
    ankles = ("near_ankle", "far_ankle", "near_toe", "far_toe")
    # Nine tenths of the walker's own size in everything seen.
    start = start_pose(WALKER, marks_of(WALKER, upright(WALKER, torso=0.2), unit=90.0, without=ankles), 1)
    assert start.view.unit == pytest.approx(90.0)
    assert_allclose([a.length for a in start.figure.links], [b.length for b in WALKER.links], rtol=1e-12)
    unseen = [WALKER.freedoms[i] for i in np.flatnonzero(~start.known)]
    assert unseen[:4] == ["knee_near", "knee_far", "ankle_near", "ankle_far"]
    assert unseen[4:] == ["stretch_shank_near", "stretch_shank_far"]
    # A long torso and head alone lengthen shanks by their share: 57 + 34 + 51 + 51 = 193 pixels, now 251.
    tall = WALKER.with_lengths([1.0, 0.49, 0.51, 0.49, 0.51, 0.49, 0.27, 0.27])
    start = start_pose(WALKER, marks_of(tall, upright(WALKER), without=ankles), 1)
    assert start.view.unit == pytest.approx(51.0 + 49.0 * 251.0 / 193.0)


def test_toes_may_be_marked_or_not_where_the_figure_has_none(rng):
    marks = marks_of(FOOTLESS, random_pose(FOOTLESS, rng, size=0.0))
    toes = {"near_toe": (1.0, 2.0), "far_toe": (float("nan"), 3.0)}
    with_toes, without = (start_pose(FOOTLESS, given, 1) for given in (marks | toes, marks))
    assert with_toes.figure == without.figure
    assert_array_equal(with_toes.q, without.q)


def test_a_horses_hidden_forelegs_are_taken_from_the_other_side_or_from_proportions(rng):
    someone, q = person(HORSE, rng), random_pose(HORSE, rng, size=0.0)
    one = start_pose(
        HORSE, marks_of(someone, q, without=["far_knee", "far_fetlock", "far_hock", "far_hoof"]), 1
    )
    unseen = [HORSE.freedoms[i] for i in np.flatnonzero(~one.known)]
    assert unseen[:3] == ["hock_far", "elbow_far", "knee_far"]
    assert unseen[3:] == [f"stretch_{name}_far" for name in ("shank", "arm", "cannon")]
    assert_allclose([a.length for a in one.figure.links], [b.length for b in someone.links], rtol=1e-12)
    # A hock cannot be straight: its limits begin at 5 degrees.
    assert one.q[HORSE.index("hock_far")] == pytest.approx(np.radians(5.0))
    assert one.q[HORSE.index("elbow_far")] == 0.0
    seen = np.flatnonzero(one.known)
    assert_allclose(one.q[seen], q[seen], **ROUNDING)

    forelegs = [f"{side}_{joint}" for side in ("near", "far") for joint in ("knee", "fetlock")]
    both = start_pose(HORSE, marks_of(HORSE, q, without=forelegs), 1)
    assert_allclose([a.length for a in both.figure.links], [b.length for b in HORSE.links], rtol=1e-12)


def test_a_joint_beyond_a_missing_one_is_not_used_where_a_link_may_be_foreshortened(rng):
    q = random_pose(HORSE, rng, size=0.0)
    hidden, lone = ["far_hock", "far_hoof"], ["far_hock"]
    without = start_pose(HORSE, marks_of(HORSE, q, without=hidden), 1)
    start = start_pose(HORSE, marks_of(HORSE, q, without=lone), 1)
    assert_array_equal(start.known, without.known)
    assert_array_equal(start.q, without.q)
    assert start.figure == without.figure


@either_way
@pytest.mark.parametrize("bend", [0.2, 1.0, 2.0])
def test_a_missing_joint_is_where_its_links_meet_bent_as_their_limits_have_it(rng, bend, facing):
    q = random_pose(HORSE, rng, size=0.0)
    q[HORSE.index("knee_far")] = bend
    marks = marks_of(HORSE, q, facing=facing, without=["far_knee"])
    start = start_pose(HORSE, marks, facing)
    # The length of the arm is its twin's, that of the cannon too.
    assert_allclose(start.q, q, **ROUNDING)
    assert start.known.all()
    body = {name: start.view.to_body(np.array(place)) for name, place in marks.items()}
    knee = Puppet(HORSE, q).joints()["far_knee"] - q[:2]
    assert_allclose(met(start.figure, body)["far_knee"], knee, **ROUNDING)


def test_links_that_cannot_meet_point_at_each_other(rng):
    points = Puppet(HORSE, random_pose(HORSE, rng, size=0.0)).joints()
    start = points["croup"] + 0.85 * (points["withers"] - points["croup"])
    del points["far_knee"]
    points["far_fetlock"] = start + np.array([0.0, -2.0])  # of links of 0.5 and 0.4
    assert_allclose(met(HORSE, points)["far_knee"], start + np.array([0.0, -0.5]), **ROUNDING)
    points["far_fetlock"] = start + np.array([0.0, -0.02])
    assert_allclose(met(HORSE, points)["far_knee"], start + np.array([0.0, -0.5]), **ROUNDING)


@either_way
def test_a_figure_faces_the_way_its_pairs_of_joints_lie(rng, facing):
    figure = replace(HORSE, ahead=(("croup", "withers"), ("poll", "muzzle")))
    marks = marks_of(figure, upright(figure, head=1.0, hock_near=0.5, hock_far=0.5), facing=facing)
    assert facing_of(marks, figure=figure) == facing
    legs = {name: marks[name] for name in ("croup", "near_stifle", "near_hock")}
    assert facing_of(legs, figure=figure) == facing


def test_recover_rests_what_it_cannot_see_and_still_reads_what_hangs_at_its_start(rng):
    q = random_pose(HORSE, rng, size=0.0)
    points = Puppet(HORSE, q).joints()
    del points["withers"]
    back, known = recover(HORSE, points)
    unseen = {HORSE.freedoms[i] for i in np.flatnonzero(~known) if i < HORSE.index(SCALE)}
    assert unseen == {"trunk", "neck", "head", "elbow_near", "elbow_far"}
    # The tail starts where the trunk does. Its angle is relative to a trunk taken to lie level.
    assert known[HORSE.index("tail")]
    tail, trunk = (HORSE.index(name) for name in ("tail", "trunk"))
    assert back[tail] == pytest.approx(q[tail] + q[trunk], abs=1e-12)


@pytest.mark.parametrize(
    ("figure", "missing", "links"),
    [
        (WALKER, "neck", ["torso", "head"]),
        (WALKER, "head_top", ["head"]),
        (WALKER, "far_knee", ["thigh_far", "shank_far"]),
        (WALKER, "near_ankle", ["shank_near"]),
        (WALKER, "near_toe", []),  # a foot has no stretch
        (HORSE, "withers", ["trunk", "neck", "head", "arm_near", "arm_far"]),
        (HORSE, "poll", ["neck", "head"]),
        (HORSE, "near_hoof", []),
        (BREATHING, "near_hoof", ["hoof_near"]),  # which has no angle
        (BREATHING, "withers", ["trunk", "neck", "head", "arm_near", "arm_far"]),  # its tail is at the croup
    ],
)
def test_a_stretch_is_known_where_both_ends_of_its_link_are(figure, missing, links, rng):
    points = Puppet(figure, random_pose(figure, rng, size=0.0)).joints()
    del points[missing]
    q, known = recover(figure, points)
    unseen = [figure.freedoms[i] for i in np.flatnonzero(~known) if i >= figure.index(SCALE)]
    assert unseen == [STRETCH + name for name in links]
    assert_array_equal(q[figure.index(SCALE) :], 0.0)


@either_way
@pytest.mark.parametrize("evidence", ["toes", "knees", "motion", "a slight bend"])
def test_facing_is_read_from_toes_knees_or_motion_and_turns_with_the_picture(evidence, facing):
    bend = {"knees": 0.5, "a slight bend": 0.03}.get(evidence, 0.0)
    q = upright(WALKER, torso=0.2, hip_near=0.3, knee_near=bend, hip_far=-0.4, knee_far=bend)
    marks = marks_of(WALKER, q, facing=facing, without=TOES)
    later = None
    if evidence == "toes":
        for side in ("near", "far"):
            x, y = marks[f"{side}_ankle"]
            marks[f"{side}_toe"] = (x + facing * 12.0, y + 5.0)
    if evidence == "motion":
        later = {name: (x + facing * 9.0, y) for name, (x, y) in marks.items()}
    assert facing_of(marks, later) == facing


@either_way
def test_a_lone_foot_that_points_down_and_back_does_not_outvote_bent_knees(facing):
    marks = marks_of(
        WALKER, upright(WALKER, hip_near=0.4, knee_near=0.6, knee_far=0.3), facing=facing, without=TOES
    )
    x, y = marks["near_ankle"]
    assert facing_of(marks | {"near_toe": (x - facing * 4.0, y + 25.0)}) == facing


def test_who_walks_backwards_faces_as_toes_and_knees_say():
    marks = marks_of(WALKER, upright(WALKER, hip_near=0.4, knee_near=0.6, knee_far=0.3), without=TOES)
    back = {"hip": (marks["hip"][0] - 9.0, marks["hip"][1])}
    assert facing_of(marks, back) == 1
    straight = marks_of(WALKER, upright(WALKER, hip_near=0.2), without=TOES)
    toe = {"near_toe": (straight["near_ankle"][0] + 10.0, 300.0)}
    assert facing_of({**straight, **toe}, back) == 1
    assert facing_of(straight, back) == -1


def test_straight_legs_marked_a_pixel_off_leave_facing_to_motion():
    marks = marks_of(WALKER, upright(WALKER, hip_near=0.2, hip_far=-0.2), without=TOES)
    x, y = marks["near_knee"]
    later = {"hip": (marks["hip"][0] + 9.0, marks["hip"][1])}
    # Marks repeat to 1.5 pixels.
    assert facing_of({**marks, "near_knee": (x - 1.5, y)}, later) == 1
    assert facing_of({**marks, "near_knee": (x - 1.5, y)}) == -1
    assert facing_of({**marks, "near_knee": (x - 4.0, y)}, later) == -1


def test_facing_is_told_by_all_toes_or_by_the_bend_of_all_legs():
    bent = marks_of(WALKER, upright(WALKER, knee_near=0.6, knee_far=0.3))
    assert facing_told(bent)
    knees = {name: place for name, place in bent.items() if name not in TOES}
    assert facing_told(knees)
    assert not facing_told({name: place for name, place in knees.items() if name != "far_ankle"})
    straight = marks_of(WALKER, upright(WALKER, hip_near=0.2))
    assert facing_told(straight)
    assert not facing_told({name: place for name, place in straight.items() if name != "far_toe"})
    # Of a figure of which nothing could, there is nothing to be asked.
    assert facing_told({}, replace(WALKER, ahead=(), leg=("torso",)))


def test_facing_is_right_where_nothing_tells_and_marks_without_a_position_say_nothing():
    nowhere = (float("nan"), float("nan"))
    assert facing_of({}) == 1
    assert facing_of({"near_knee": (1.0, 2.0), "near_ankle": (0.0, 3.0)}, {"hip": (9.0, 9.0)}) == 1
    left = marks_of(WALKER, upright(WALKER, knee_near=0.6, knee_far=0.6), facing=-1, without=TOES)
    assert facing_of({**left, "near_toe": nowhere, "far_toe": nowhere}) == -1
    assert facing_of({**left, "near_knee": nowhere}) == -1
    assert facing_of(left, {"hip": nowhere}) == -1


@pytest.mark.parametrize("joint", ["hip", "neck", "head_top", "near_knee", "far_knee"])
def test_a_joint_the_pose_cannot_do_without_is_named(joint):
    marks = marks_of(WALKER, upright(WALKER, hip_near=0.3, knee_near=0.2))
    needed = "mark hip, neck, head_top, near_knee, far_knee at least"
    with pytest.raises(PoseError, match=f"the start pose lacks {joint}; {needed}"):
        start_pose(WALKER, {name: point for name, point in marks.items() if name != joint}, 1)
    for point in ((float("nan"), 3.0), (3.0, float("inf"))):
        with pytest.raises(PoseError, match=f"the start pose has no position for {joint}; mark it again"):
            start_pose(WALKER, {**marks, joint: point}, 1)


@pytest.mark.parametrize(
    ("joint", "onto"),
    [("neck", "hip"), ("head_top", "neck"), ("near_knee", "hip"), ("far_ankle", "far_knee")],
)
def test_joints_on_one_spot_are_refused(joint, onto):
    marks = marks_of(WALKER, upright(WALKER, hip_near=0.3))
    x, y = marks[onto]
    with pytest.raises(PoseError, match=f"{joint} lies on the joint before it; mark the two apart"):
        start_pose(WALKER, {**marks, joint: (x + 0.5, y - 0.5)}, 1)


def test_a_base_alone_is_no_pose_to_start_in():
    lax = replace(WALKER, optional=tuple(name for name in WALKER.marks if name != WALKER.base))
    with pytest.raises(PoseError, match="no limb has both its ends marked"):
        start_pose(lax, {WALKER.base: (10.0, 10.0)}, 1)


def test_a_figure_without_a_leg_recovers_poses_but_has_no_unit_to_start_in(rng):
    legless = replace(WALKER, leg=())
    q = random_pose(WALKER, rng, size=0.0)
    assert_allclose(recover(legless, Puppet(WALKER, q).joints())[0], q, **ROUNDING)
    with pytest.raises(
        ValueError, match="figure 'walker' has no leg to measure in; list its links under leg"
    ):
        start_pose(legless, marks_of(WALKER, q), 1)
