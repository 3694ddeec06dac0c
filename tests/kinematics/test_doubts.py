"""Start poses that cannot be right: what is said of them, and that people in motion are not doubted."""

import numpy as np
import pytest

from kinematics.doubts import beyond_limits, doubts
from kinematics.recover import facing_of, marked_part, start_pose
from tests.kinematics.figures import WALKER, Puppet, upright
from tracker.keypoints import points, read_keypoints

STEP = upright(WALKER, torso=0.1, hip_near=0.4, knee_near=0.3, hip_far=-0.3, knee_far=0.9)


def marks_of(q, unit=90.0, without=()):
    body = Puppet(WALKER, q).joints()
    return {
        name: (300.0 + unit * x, 200.0 - unit * y) for name, (x, y) in body.items() if name not in without
    }


def doubted(marks, facing=1):
    return doubts(WALKER, marks, start_pose(marked_part(WALKER, marks), marks, facing))


def stretched(marks, joint, onto, factor):
    """A joint moved away from another."""
    (x, y), (u, v) = marks[joint], marks[onto]
    return marks | {joint: (u + factor * (x - u), v + factor * (y - v))}


def test_a_step_is_not_doubted():
    assert doubted(marks_of(STEP)) == []
    assert doubted(marks_of(STEP, without=("far_ankle", "far_toe", "near_toe"))) == []


@pytest.mark.parametrize(
    ("joint", "onto", "said"),
    [
        ("near_ankle", "near_knee", "shank_near is 2.2 times as long as shank_far"),
        ("far_ankle", "far_knee", "shank_far is 2.2 times as long as shank_near"),
        ("head_top", "neck", "the head is 2.5 times as long as the rest has it"),
    ],
)
def test_a_limb_of_impossible_length_is_named(joint, onto, said):
    factor = 2.5 if joint == "head_top" else 2.2
    (clause,) = doubted(stretched(marks_of(STEP), joint, onto, factor))
    assert clause == said


def test_a_trunk_too_short_is_named_as_well():
    marks = marks_of(STEP)
    moved = {name: (marks[name][0], marks[name][1] + 36.0) for name in ("neck", "head_top")}
    (clause,) = doubted(marks | moved)
    assert clause.startswith("the torso is 0.")


@pytest.mark.parametrize("factor", [0.75, 1.3])
def test_limbs_as_uneven_as_a_turned_body_makes_them_are_not_doubted(factor):
    for joint, onto in (("near_ankle", "near_knee"), ("far_ankle", "far_knee"), ("head_top", "neck")):
        assert doubted(stretched(marks_of(STEP), joint, onto, factor)) == []


def test_a_knee_bent_backwards_is_named_with_its_limits_and_fits_the_other_way():
    marks = marks_of(STEP)
    (clause,) = doubted(marks, facing=-1)
    assert clause == "knee_far is bent to -52 degrees, beyond -10 to 155"
    assert not beyond_limits(start_pose(WALKER, marks, 1))


def test_a_head_at_the_feet_is_doubted():
    marks = marks_of(STEP)
    hip = marks["hip"][1]
    over = {name: (x, 2.0 * hip - y) for name, (x, y) in marks.items()}
    assert any(clause.startswith("torso is bent to") for clause in doubted(over))


def test_a_joint_that_was_not_marked_is_not_doubted():
    marks = marks_of(STEP, without=("far_ankle", "far_toe"))
    assert doubted(marks, facing=-1) == []


@pytest.mark.parametrize(("unit", "small"), [(24.0, True), (26.0, False)])
def test_a_figure_too_small_to_register_is_refused_for_that_alone(unit, small):
    found = doubted(marks_of(STEP, unit=unit))
    assert found == (["a leg is 24 px long, and 25 are needed; enlarge the video"] if small else [])


def test_feet_may_have_any_length_and_direction():
    marks = marks_of(STEP)
    for factor in (0.3, 2.0, -1.0):
        assert doubted(stretched(marks, "near_toe", "near_ankle", factor)) == []


def test_no_hand_marked_frame_is_doubted_nor_one_in_a_hundred_when_disturbed(data_dir, rng):
    clean, disturbed = [], []
    for path in sorted((data_dir / "video").glob("*.keypoints.csv")):
        marks = read_keypoints(path)
        for marked in marks.values():
            places = points(marked)
            facing = facing_of(points(marks[min(marks)]))
            clean.append(doubted(places, facing))
            for _ in range(5):
                moved = {name: tuple(rng.normal(at, 3.0)) for name, at in places.items()}
                disturbed.append(doubted(moved, facing))
    assert len(clean) > 100
    assert [clauses for clauses in clean if clauses] == []
    assert np.mean([bool(clauses) for clauses in disturbed]) < 0.01
