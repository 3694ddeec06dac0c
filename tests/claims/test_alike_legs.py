"""Of legs in the same trousers the nearer one is told by the arms, in whatever part of a film."""

from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.evaluation.cases import QUIET, marks_of
from tracker.clip.found import people
from videos.frames import Video

pytestmark = pytest.mark.claims

ANKLES = "near_ankle", "far_ankle"


@pytest.mark.parametrize(
    ("clip", "first", "last"),
    [("video/gym_walk_rl", 36, 80), ("video/gym_walk_rl", 48, 92), ("video_hard/gym_backwalk_lr", 18, 62)],
)
def test_legs_in_the_same_black_trousers_are_named_rightly(
    clip: str, first: int, last: int, data_dir: Path
) -> None:
    path = data_dir / f"{clip}.mp4"
    (one,) = people(Video(path), QUIET, first, last)
    marks = {frame: row for frame, row in marks_of(path).items() if one.first <= frame <= one.last}
    assert len(marks) >= 3
    columns = [one.figure.joints.index(name) for name in ANKLES]
    for frame, row in marks.items():
        found = one.outline.joints[frame - one.first, columns]
        truth = np.array([(row[name].x, row[name].y) for name in ANKLES])
        named, exchanged = (np.hypot(*(found - each).T).sum() for each in (truth, truth[::-1]))
        assert named < exchanged
