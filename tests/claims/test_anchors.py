"""What anchors and a start in the middle do for the hand-marked open clips."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.evaluation.cases import marks_of
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.clip.outlines import look
from tracker.clip.plan import prepare
from tracker.progress import Progress
from tracker.run.score import Score, places, score

pytestmark = pytest.mark.claims

QUIET = Progress("quiet")
EVERY = 20  # frames from one anchor to the next


def scored(clip: Path) -> Iterator[Score]:
    """Over the marked frames that are no anchors, without using these and with them."""
    truth = marks_of(clip)
    given = {t: marks for t, marks in truth.items() if t % EVERY == 0}
    between = {t: marks for t, marks in truth.items() if t == 0 or t not in given}
    without = Job(clip, given, stop=max(truth))
    seen = look(prepare(without), QUIET)  # which hears of the start alone
    for job in (without, replace(without, anchors=True)):
        yield score(between, places(follow(job, QUIET, seen=seen).track), 0)


def test_an_anchor_every_twenty_frames_takes_a_tenth_off_the_error_between_them(data_dir: Path) -> None:
    clip = data_dir / "video" / "indoor_walk_lr.mp4"
    without, with_them = scored(clip)
    assert with_them.mean_error_leg < 0.9 * without.mean_error_leg
    assert with_them.first_failure_frame is None


@pytest.mark.parametrize(("name", "start"), [("gym_walk_rl", 30), ("desert_walk_rl", 60)])
def test_from_a_start_in_the_middle_the_clip_is_followed_back_to_frame_zero(
    name: str, start: int, data_dir: Path
) -> None:
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


def test_legs_keep_their_names_from_a_start_in_the_middle(data_dir: Path) -> None:
    clip = data_dir / "video" / "desert_walk_rl.mp4"
    truth = marks_of(clip)
    found = places(follow(Job(clip, truth, start=150, stop=max(truth)), QUIET).track)
    # The start frame is scored in no case, so that all others may come after it.
    result = score({-1: truth.pop(150), **truth}, found, -1)
    assert result.swaps == 0
    assert result.mean_error_leg < 0.12
