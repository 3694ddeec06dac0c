"""A walker of the open clips who is not seen is said to be lost, and found again."""

from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.evaluation.cases import band_of, marks_of
from tests.benchmarks.evaluation.disturbances import Film, write_film
from tests.tracker.walls import behind_wall
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.progress import Progress
from tracker.run.track import Track
from tracker.tables.keypoints import points
from videos.frames import Video

pytestmark = pytest.mark.claims

FIRST, LAST = 204, 337  # columns of the wall: the walker of markers_walk_lr is behind it for some ten frames
BODY = 10.0  # pixels of body beyond the marked joints
STRIDE = 0.8  # leg lengths that anything of the body may be behind the near knee


@pytest.fixture(scope="module")
def film(data_dir: Path) -> Film:
    clip = data_dir / "video" / "markers_walk_lr.mp4"
    video = Video(clip)
    return Film([behind_wall(frame.image, FIRST, LAST) for frame in video], video.fps, marks_of(clip))


@pytest.fixture(scope="module")
def walled(film: Film, tmp_path_factory: pytest.TempPathFactory) -> Track:
    path = tmp_path_factory.mktemp("wall") / "walk.mov"
    write_film(film, path)
    return follow(Job(path, film.marks, start=0), Progress("quiet")).track


def covered(film: Film) -> list[int]:
    """Marked stretches in which all of the walker is behind the wall."""
    frames = sorted(film.marks)
    x = {t: [place[0] for place in points(film.marks[t]).values()] for t in frames}
    every = np.arange(frames[-1] + 1)
    low = np.interp(every, frames, [min(x[t]) for t in frames]) - BODY
    high = np.interp(every, frames, [max(x[t]) for t in frames]) + BODY
    return np.flatnonzero((low >= FIRST) & (high <= LAST)).tolist()


def test_a_walker_behind_a_wall_is_said_to_be_lost_or_hidden_within_three_frames(
    film: Film, walled: Track
) -> None:
    behind = covered(film)
    assert len(behind) >= 10
    said = {t: walled.outcome[t] for t in range(behind[0], behind[-1] + 1)}
    assert {said[t] for t in behind[3:]} <= {"lost", "hidden"}, said
    assert "lost" in said.values(), said


def test_a_walker_who_comes_from_behind_a_wall_is_found_again(
    film: Film, walled: Track, data_dir: Path
) -> None:
    knee = band_of(data_dir / "video" / "markers_walk_lr.mp4")
    leg = walled.view.unit
    bare = min(t for t, (x, _) in knee.items() if x - STRIDE * leg > LAST)
    after = [t for t in knee if t >= bare + 5]
    assert len(after) >= 10
    # Hidden for most of a stride, it may come out with its legs exchanged: one of the knees must be there.
    knees = walled.joints()[:, [walled.figure.joints.index(f"{side}_knee") for side in ("near", "far")]]
    away = [np.hypot(*(knees[t] - knee[t]).T).min() / leg for t in after]
    assert "found" in walled.outcome[: bare + 6], walled.outcome
    assert np.mean(away) < 0.15, away
