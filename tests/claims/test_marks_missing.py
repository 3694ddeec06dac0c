"""What is not marked at the start, hidden or out of the picture, is followed from when it is seen."""

from pathlib import Path

import pytest

from tests.benchmarks.evaluation.cases import marks_of
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.progress import Progress
from tracker.run.score import places, score

pytestmark = pytest.mark.claims

TOES = ("near_toe", "far_toe")
ANKLES = ("near_ankle", "far_ankle")


@pytest.mark.parametrize(
    ("name", "missing", "most"),
    [
        ("desert_run_lr", TOES, 0.07),
        ("markers_walk_lr", (*TOES, "near_ankle"), 0.05),
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
    job = Job(clip, {**truth, 0: start}, start=0, stop=max(truth))
    result = score(truth, places(follow(job, Progress("quiet")).track), 0)
    assert result.first_failure_frame is None
    assert result.swaps == 0
    assert result.mean_error_leg < most
