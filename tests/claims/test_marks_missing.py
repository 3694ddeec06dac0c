"""What is not marked at the start, hidden or out of the picture, is followed from when it is seen."""

from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.evaluation.cases import marks_of
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.progress import Progress
from tracker.run.score import leg_length, places, score

pytestmark = pytest.mark.claims

# Their marks in frame 0 are little more than half as far from the ankle as the other foot's.
TURNED = (("gym_walk_rl", "near_toe"), ("indoor_walk_lr", "far_toe"))
TOES = ("near_toe", "far_toe")
ANKLES = ("near_ankle", "far_ankle")


@pytest.mark.parametrize(
    ("name", "missing", "most"),
    [
        ("desert_run_lr", TOES, 0.07),
        ("track_run_rl", (*TOES, "far_ankle"), 0.05),
        ("markers_walk_lr", (*TOES, "near_ankle"), 0.05),
        ("markers_walk_lr", (*TOES, *ANKLES), 0.06),
        ("track_run_rl", (*TOES, *ANKLES), 0.08),
        ("gym_walk_rl", (*TOES, *ANKLES), 0.06),
    ],
)
def test_a_clip_is_followed_as_well_from_a_start_without_some_marks(
    name: str, missing: tuple[str, ...], most: float, data_dir: Path
) -> None:
    clip = data_dir / "video" / f"{name}.mp4"
    truth = marks_of(clip)
    start = {joint: mark for joint, mark in truth[0].items() if joint not in missing}
    job = Job(clip, {**truth, 0: start}, "walk-run", start=0, stop=max(truth))
    result = score(truth, places(follow(job, Progress("quiet")).track), 0)
    assert result.first_failure_frame is None
    assert result.swaps == 0
    assert result.mean_error_leg < most


@pytest.mark.parametrize(("name", "toe"), TURNED)
def test_a_foot_that_is_turned_at_the_start_is_followed_at_its_full_length(
    name: str, toe: str, data_dir: Path
) -> None:
    clip = data_dir / "video" / f"{name}.mp4"
    truth = marks_of(clip)
    found = places(follow(Job(clip, truth, "walk-run", start=0, stop=max(truth)), Progress("quiet")).track)
    marked = {frame: marks[toe] for frame, marks in truth.items() if toe in marks}
    away = [np.hypot(mark.x - found[k][toe][0], mark.y - found[k][toe][1]) for k, mark in marked.items()]
    # As short as it was marked, it would end a seventh of a leg before its toe.
    assert np.mean(away) < 0.08 * leg_length(truth, sorted(truth))
