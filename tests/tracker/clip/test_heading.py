"""Which way a figure faces whose feet are not marked, seen from the film."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from kinematics.figure_file import WALKER
from tests.tracker.clips import FPS, QUIET, write_video
from tracker.clip import plan as plan_module
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.clip.plan import facing_unknown, heading, prepare
from tracker.clip.start import facing_at, marked_start
from tracker.settings import Settings
from tracker.tables.keypoints import Mark, read_keypoints

FEET = ("near_ankle", "near_toe", "far_ankle", "far_toe")


def without(marks, joints):
    return {0: {name: mark for name, mark in marks[0].items() if name not in joints}}


@pytest.fixture(scope="module")
def marks(clip):
    return read_keypoints(clip.keypoints)


@pytest.fixture(scope="module")
def mirrored(clip):
    """The clip's pictures and its first marks, right and left exchanged."""

    def turn(marks):
        width = clip.images[0].shape[1]
        return {t: {n: replace(m, x=width - 1 - m.x) for n, m in row.items()} for t, row in marks.items()}

    return [image[:, ::-1].copy() for image in clip.images], turn


def start_of(marks, facing, image):
    return marked_start(marks, 0, facing, image.shape[1::-1])


@pytest.mark.parametrize("taken", [1, -1], ids=["taken-right", "taken-left"])
def test_a_figure_faces_the_way_it_goes_whichever_way_its_start_was_taken(taken, clip, marks, mirrored):
    images, turn = mirrored
    lacking = without(marks, FEET)
    right = start_of(lacking, taken, images[0])
    left = start_of(turn(lacking), taken, images[0])
    assert heading(clip.images, right, FPS, Settings()) == 1
    assert heading(images, left, FPS, Settings()) == -1


@pytest.mark.parametrize("taken", [1, -1])
def test_who_stands_still_faces_as_the_start_says(taken, clip, marks):
    still = [clip.images[0]] * 5
    start = start_of(without(marks, FEET), taken, still[0])
    assert heading(still, start, FPS, Settings()) == taken


def test_half_a_second_is_followed_for_the_facing_at_any_frame_rate(clip, marks, monkeypatch):
    asked = []
    monkeypatch.setattr(plan_module, "heading", lambda *_: 1)
    job = Job(clip.video, without(marks, FEET))
    for fps in (24.0, 240.0):
        video = SimpleNamespace(width=10_000, height=10_000, fps=fps)
        video.pictures = lambda first, last: asked.append(last - first)
        plan_module._start(job, video, Settings())
    assert asked == [12, 120]


@pytest.mark.parametrize(
    ("missing", "want"),
    [
        ([], False),
        (["near_toe", "far_toe"], False),  # both knees bend
        (["near_ankle", "near_toe", "far_toe"], True),
        (["near_ankle", "near_toe"], True),
        (FEET, True),
    ],
)
def test_without_all_toes_or_the_bend_of_both_legs_the_facing_is_untold(missing, want, clip, marks):
    job = Job(clip.video, without(marks, missing), model="cv")
    assert facing_unknown(job, WALKER) == want
    assert not facing_unknown(replace(job, facing=1), WALKER)


def test_a_job_whose_marks_lack_the_feet_faces_as_the_film_shows(clip, marks, mirrored, tmp_path):
    images, turn = mirrored
    write_video(tmp_path / "left.mp4", images)
    lacking = turn(without(marks, FEET))
    job = Job(tmp_path / "left.mp4", lacking, model="cv")
    assert prepare(job).start.view.facing == -1
    assert prepare(replace(job, facing=1)).start.view.facing == 1


@pytest.mark.parametrize("facing", [None, 1])
def test_a_facing_that_nobody_told_is_said(facing, clip, marks):
    job = Job(clip.video, without(marks, FEET), model="cv", facing=facing, stop=1)
    said = [warning for warning in follow(job, QUIET).warnings if "face right" in warning]
    assert len(said) == (facing is None)


def test_a_job_with_a_foot_marked_is_not_asked_of_the_film(clip, marks, monkeypatch):
    monkeypatch.setattr(plan_module, "heading", None)
    assert prepare(Job(clip.video, marks, model="cv")).start.view.facing == 1


@pytest.mark.parametrize("facing", [1, -1])
def test_where_marks_are_few_a_figure_faces_the_way_in_which_its_knee_can_bend(facing):
    places = {
        "head_top": (0.0, -95.0),
        "neck": (0.0, -60.0),
        "hip": (0.0, 0.0),
        "near_knee": (15.0, 45.0),
        "near_ankle": (-20.0, 80.0),
        "far_knee": (-5.0, 50.0),
    }
    here = {name: Mark(200.0 + facing * x, 150.0 + y) for name, (x, y) in places.items()}
    # By the base alone it goes back.
    panned = {name: replace(mark, x=mark.x - 10.0 * facing) for name, mark in here.items()}
    assert facing_at({0: here, 5: panned}, 0) == facing
