"""A motion is taken up by who moves at its pace: nobody who walks ahead is taken to walk backwards."""

from pathlib import Path

import pytest

from tests.benchmarks.evaluation.cases import marks_of
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.models.find import find_model
from tracker.progress import Progress
from tracker.run.score import places, score
from tracker.run.track import Track
from tracker.settings import Settings

pytestmark = pytest.mark.claims

QUIET = Progress("quiet")


def followed(clip: Path, start: int, **changes: object) -> Track:
    marks = marks_of(clip)
    settings = Settings.model_validate(changes)
    return follow(Job(clip, marks, "walk-run", settings, start=start, stop=max(marks)), QUIET).track


def frames_back(track: Track) -> int:
    """In how many the motion is one that goes backwards."""
    slds = find_model("walk-run", 30.0, Settings())
    pace = slds.mean0[:, 0] - slds.mean0[:, len(slds.names)]
    assert (pace < 0.0).any()
    return int((pace[track.s] < 0.0).sum())


def test_who_walks_ahead_is_not_taken_to_walk_backwards(data_dir: Path) -> None:
    clip = data_dir / "video" / "indoor_walk_lr.mp4"
    assert frames_back(followed(clip, 0)) == 0


def test_legs_keep_their_names_from_a_start_in_the_middle(data_dir: Path) -> None:
    clip = data_dir / "video" / "desert_walk_rl.mp4"
    others = {frame: row for frame, row in marks_of(clip).items() if frame != 150}
    # The start frame is scored in no case, so that all others may come after it.
    found = score({-1: marks_of(clip)[150], **others}, places(followed(clip, 150)), -1)
    assert found.swaps == 0
    assert found.mean_error_leg < 0.12
