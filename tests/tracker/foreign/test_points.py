"""Near and far become right and left, what is missing is where it is said to be, likelihood has a meaning."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kinematics.spm import UNMOVED
from tests.kinematics.figures import FOOTLESS, WALKER
from tests.tracker.records import FIRST, T, made_record, made_track, write_folder
from tracker.foreign.points import HALPE, leg_pixels, named_points
from tracker.run.read import RunError, read_run
from tracker.run.track import WITHIN

ROWS = slice(FIRST, FIRST + T)


def record_of(track, folder):
    return read_run(write_folder(track, folder))


def at(points, name):
    return points.places[:, points.names.index(name)]


@pytest.mark.parametrize(("facing", "near", "far"), [(1, "R", "L"), (-1, "L", "R")])
def test_the_side_towards_the_camera_is_the_right_one_of_who_faces_right(rng, tmp_path, facing, near, far):
    record = made_record(rng, tmp_path)
    points = named_points(record, HALPE, facing)
    for part, joint in (("Knee", "knee"), ("Ankle", "ankle"), ("BigToe", "toe")):
        assert_array_equal(at(points, near + part), record.place(f"near_{joint}"))
        assert_array_equal(at(points, far + part), record.place(f"far_{joint}"))


def test_both_hips_are_at_the_hip_and_both_shoulders_at_the_neck(rng, tmp_path):
    record = made_record(rng, tmp_path)
    points = named_points(record, HALPE, 1)
    for letter in "RL":
        assert_array_equal(at(points, f"{letter}Hip"), record.place("hip"))
        assert_array_equal(at(points, f"{letter}Shoulder"), record.place("neck"))
    assert_array_equal(at(points, "Head"), record.place("head_top"))


def test_a_figure_without_feet_has_no_toes(rng, tmp_path):
    record = made_record(rng, tmp_path, figure=FOOTLESS)
    names = named_points(record, HALPE, 1).names
    assert set(HALPE) - set(names) == {"RBigToe", "LBigToe"}


def test_likelihood_is_how_often_a_joint_lies_within_a_tenth_of_a_leg(rng, tmp_path):
    track = replace(made_track(rng), moved=np.tile(UNMOVED, (T, 1)))
    # A root known to 5 px, marks to theirs, and nothing else unknown: every joint is a round Gaussian.
    cov = np.zeros_like(track.cov)
    cov[:, 0, 0] = cov[:, 1, 1] = (5.0 / track.view.unit) ** 2
    record = record_of(replace(track, cov=cov), tmp_path)
    near = WITHIN * leg_pixels(record)
    spread = np.hypot(5.0, track.mark * track.view.unit)
    drawn = np.hypot(*rng.normal(scale=spread, size=(2, 200_000)))
    found = named_points(record, HALPE, 1).likelihood[ROWS][record.measured[ROWS]]
    # A share of 200000 has a standard deviation of at most 0.0012.
    assert_allclose(found, (drawn < near).mean(), atol=0.005)
    assert 0.3 < found.min() < 0.95


def test_a_leg_is_as_long_as_its_links(rng, tmp_path):
    track = replace(made_track(rng), q=np.zeros((T, len(WALKER.freedoms))), moved=np.tile(UNMOVED, (T, 1)))
    lengths = [link.length for link in WALKER.links if link.name in ("thigh_near", "shank_near")]
    assert leg_pixels(record_of(track, tmp_path)) == pytest.approx(70.0 * sum(lengths), abs=0.01)


def test_a_run_that_followed_nothing_is_refused(rng, tmp_path):
    record = made_record(rng, tmp_path, outcomes=("lost",) * T)
    with pytest.raises(RunError, match="followed in no frame"):
        named_points(record, HALPE, 1)
