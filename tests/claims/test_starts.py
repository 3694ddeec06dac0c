"""What anchors, a start in the middle and a start that lacks marks make of the hand-marked open clips."""

from dataclasses import replace

import numpy as np
import pytest

from tests.benchmarks.evaluation.cases import QUIET, marks_of
from tests.benchmarks.evaluation.feet import ANKLES, TOES
from tests.claims.followed import assert_followed, scored
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.clip.outlines import look
from tracker.clip.plan import prepare
from tracker.run.score import places, score

pytestmark = pytest.mark.claims

EVERY = 20  # frames from one anchor to the next


def test_an_anchor_every_twenty_frames_takes_a_tenth_off_the_error_between_them(data_dir):
    clip = data_dir / "video" / "indoor_walk_lr.mp4"
    truth = marks_of(clip)
    given = {t: marks for t, marks in truth.items() if t % EVERY == 0}
    between = {t: marks for t, marks in truth.items() if t == 0 or t not in given}
    job = Job(clip, given, stop=max(truth))
    seen = look(prepare(job), QUIET)  # which hears of the start alone
    without, with_them = (scored(each, between, seen) for each in (job, replace(job, anchors=True)))
    assert with_them.mean_error_leg < 0.9 * without.mean_error_leg
    assert with_them.first_failure_frame is None


@pytest.mark.parametrize(("name", "start"), [("gym_walk_rl", 30), ("desert_walk_rl", 60)])
def test_from_a_start_in_the_middle_the_clip_is_followed_back_to_frame_zero(name, start, data_dir):
    clip = data_dir / "video" / f"{name}.mp4"
    truth = marks_of(clip)
    job = Job(clip, truth, start=start, stop=start + 5)
    found = places(follow(job, QUIET).track)
    # As a clip that runs backwards, so that the start is its first frame.
    there = {start - t: marks for t, marks in truth.items() if t <= start}
    result = score(there, {start - t: places for t, places in found.items()}, 0)
    assert result.truth_frames >= 6
    assert result.first_failure_frame is None
    assert result.mean_error_leg < 0.07
    assert np.max(list(result.frame_errors.values())) < 0.12


def test_legs_keep_their_names_from_a_start_in_the_middle(data_dir):
    clip = data_dir / "video" / "desert_walk_rl.mp4"
    truth = marks_of(clip)
    found = places(follow(Job(clip, truth, start=150, stop=max(truth)), QUIET).track)
    # The start frame is scored in no case, so that all others may come after it.
    result = score({-1: truth.pop(150), **truth}, found, -1)
    assert result.swaps == 0
    assert result.mean_error_leg < 0.12


@pytest.mark.parametrize(
    ("name", "missing", "most"),
    [
        ("desert_run_lr", TOES, 0.07),
        ("markers_walk_lr", (*TOES, "near_ankle"), 0.05),
        ("track_run_rl", (*TOES, *ANKLES), 0.08),
        ("gym_walk_rl", (*TOES, *ANKLES), 0.06),
    ],
)
def test_a_clip_is_followed_as_well_from_a_start_without_some_marks(name, missing, most, data_dir):
    clip = data_dir / "video" / f"{name}.mp4"
    truth = marks_of(clip)
    start = {joint: mark for joint, mark in truth[0].items() if joint not in missing}
    assert_followed(scored(Job(clip, {**truth, 0: start}, start=0, stop=max(truth)), truth), most)
