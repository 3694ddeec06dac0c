"""Marks that cannot be right: what is said of them, and that people in motion are not doubted."""

import numpy as np
import pytest

from kinematics.doubts import beyond_limits, doubts
from kinematics.recover import facing_of
from tests.kinematics.figures import HORSE, WALKER, Puppet, marks_of, random_pose, upright
from tracker.tables.keypoints import points, read_keypoints

STEP = upright(WALKER, torso=0.1, hip_near=0.4, knee_near=0.3, hip_far=-0.3, knee_far=0.9)
TOES = ("near_toe", "far_toe")


def clicked(q=STEP, unit=90.0, **more):
    return marks_of(WALKER, q, unit=unit, **more)


def doubted(marks, facing=None):
    return doubts(WALKER, marks, facing or facing_of(marks))


def stretched(marks, joint, onto, factor):
    """A joint moved away from another."""
    (x, y), (u, v) = marks[joint], marks[onto]
    return marks | {joint: (u + factor * (x - u), v + factor * (y - v))}


def exchanged(one, other, marks):
    return marks | {one: marks[other], other: marks[one]}


@pytest.mark.parametrize("facing", [1, -1])
@pytest.mark.parametrize(
    "without",
    [
        (),
        TOES,
        ("far_toe",),
        ("near_ankle", "near_toe"),
        ("far_ankle", *TOES),
        ("neck", "head_top"),
        ("hip",),
    ],
)
def test_a_step_is_not_doubted_whole_or_in_part(facing, without):
    assert doubted(clicked(facing=facing, without=without), facing) == []


def test_marks_are_judged_from_the_first_on():
    whole = clicked()
    for count in range(len(whole) + 1):
        assert doubted(dict(list(whole.items())[:count])) == []


@pytest.mark.parametrize(
    ("joint", "onto", "than"),
    [
        ("near_ankle", "near_knee", "from far_knee to far_"),
        ("far_ankle", "far_knee", "from near_knee to near_"),
        ("head_top", "neck", "the other limbs suggest"),
    ],
)
def test_a_limb_of_impossible_length_is_named(joint, onto, than):
    clauses = doubted(stretched(clicked(without=TOES), joint, onto, 2.3))
    assert clauses[0].startswith(f"from {onto} to {joint} is 2.3 times as far as {than}")


@pytest.mark.parametrize(("share", "wrong"), [(2.0, True), (1.8, False), (0.55, False), (0.45, True)])
def test_a_trunk_is_impossible_from_a_known_share_of_the_others_on(share, wrong):
    marks = clicked(unit=100.0)
    hip, neck, head = (np.array(marks[name]) for name in ("hip", "neck", "head_top"))
    moved = hip + share * (neck - hip)
    found = doubted(marks | {"neck": tuple(moved), "head_top": tuple(head + moved - neck)})
    assert [clause.startswith("from hip to neck is") for clause in found] == [True] * wrong


@pytest.mark.parametrize("factor", [0.75, 1.3])
def test_limbs_as_uneven_as_a_turned_body_makes_them_are_not_doubted(factor):
    for joint, onto in (("near_ankle", "near_knee"), ("far_ankle", "far_knee"), ("head_top", "neck")):
        assert doubted(stretched(clicked(), joint, onto, factor)) == []


@pytest.mark.parametrize(("degrees", "wrong"), [(17, False), (23, True)])
def test_a_joint_may_go_a_little_beyond_its_limits_and_no_more(degrees, wrong):
    link = WALKER.links[WALKER.link_of("near_ankle")]
    q = upright(WALKER, hip_near=0.5, knee_near=link.limits[0] - np.radians(degrees), knee_far=0.6)
    said = f"near_ankle is turned about near_knee by {degrees} degrees more than a body can"
    assert doubted(clicked(q)) == [said] * wrong


def test_knees_bent_backwards_are_named_and_fit_the_other_way():
    marks = clicked(without=TOES)
    (clause,) = doubted(marks, facing=-1)
    assert clause.startswith("far_ankle is turned about far_knee by 42 degrees more")
    assert beyond_limits(WALKER, marks, -1) == [clause]
    assert not beyond_limits(WALKER, marks, 1)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("near_ankle", "far_ankle"),
        ("near_knee", "far_knee"),
        ("near_toe", "far_toe"),
        ("head_top", "neck"),
        ("neck", "hip"),
    ],
)
@pytest.mark.parametrize("facing", [1, -1])
def test_exchanged_joints_are_named(one, other, facing):
    stride = upright(WALKER, hip_near=0.4, knee_near=0.2, hip_far=-0.35, knee_far=0.3, torso=0.05)
    (clause,) = doubted(exchanged(one, other, clicked(stride, 100.0, facing=facing)))
    cures = clause.partition(" look exchanged: ")[0].split(", or ")
    assert {f"{one} and {other}", f"{other} and {one}"} & set(cures)


def test_a_facing_that_is_told_is_not_put_down_to_exchanged_marks():
    assert not any("exchanged" in clause for clause in doubted(clicked(), facing=-1))


@pytest.mark.parametrize(("unit", "small"), [(24.0, True), (26.0, False)])
def test_a_figure_too_small_to_register_is_refused_for_that_alone(unit, small):
    found = doubted(clicked(unit=unit))
    assert found == (["a leg is 24 px long, and 25 are needed; enlarge the video"] if small else [])


@pytest.mark.parametrize(
    ("factor", "wrong"), [(0.35, False), (-0.35, False), (2.0, False), (2.4, True), (-1.0, True)]
)
def test_a_foot_may_be_short_and_a_short_one_has_any_direction(factor, wrong):
    found = doubted(stretched(clicked(), "near_toe", "near_ankle", factor))
    assert ["near_toe" in clause for clause in found] == [True] * wrong


def test_joints_in_one_place_are_no_crash():
    assert doubted(dict.fromkeys(clicked(), (5.0, 5.0)))


def test_another_figure_is_judged_by_its_own_limits(rng):
    q = random_pose(HORSE, rng, size=0.0)
    places = {name: (100.0 * x, -100.0 * y) for name, (x, y) in Puppet(HORSE, q).joints().items()}
    assert doubts(HORSE, places, 1) == []


def hand_marked(data_dir):
    """Every marked frame of the open clips, and the way its figure faces."""
    for path in sorted((data_dir / "video").glob("*.keypoints.csv")):
        marks = read_keypoints(path)
        for marked in marks.values():
            yield points(marked), facing_of(points(marks[min(marks)]))


def test_no_hand_marked_frame_is_doubted_nor_one_in_a_hundred_when_disturbed(data_dir, rng):
    frames, disturbed = list(hand_marked(data_dir)), []
    assert len(frames) > 100
    for places, facing in frames:
        assert doubted(places, facing) == doubted(places) == []
        for _ in range(20):
            moved = {name: tuple(rng.normal(at, 3.0)) for name, at in places.items()}
            disturbed.append(doubted(moved, facing))
    assert np.mean([bool(clauses) for clauses in disturbed]) < 0.01


def test_exchanged_ankles_of_hand_marked_frames_are_seen_where_they_are_apart(data_dir):
    apart = [
        places
        for places, _ in hand_marked(data_dir)
        if {"near_ankle", "far_ankle", "neck"} <= places.keys()
        and np.hypot(*np.subtract(places["near_ankle"], places["far_ankle"]))
        > 0.5 * np.hypot(*np.subtract(places["hip"], places["neck"]))
    ]
    assert len(apart) > 50
    assert all(doubted(exchanged("near_ankle", "far_ankle", places)) for places in apart)
