"""Clips as others might film or play them: against the light, in haze, in slow motion. All are followed."""

from pathlib import Path

import pytest

from tests.benchmarks.evaluation.cases import BEFORE_ALL, QUIET, marks_of
from tests.benchmarks.evaluation.disturbances import Film, dimmed, read_film, write_film
from tests.benchmarks.evaluation.films import FILMS
from tracker.clip.follow import follow
from tracker.clip.found import people, start_of
from tracker.clip.job import Following, Job
from tracker.run.score import Score, places, score
from tracker.settings import Settings
from videos.frames import Video

pytestmark = pytest.mark.claims

FRAMES = 60  # of a clip


def scored(film: Film, path: Path, **changes: object) -> Score:
    write_film(film, path)
    settings = Settings.model_validate(changes)
    job = Job(path, film.marks, settings=settings, start=0, stop=max(film.marks))
    return score(film.marks, places(follow(job, QUIET).track), 0)


def made(data_dir: Path, clip: str, film: str) -> Film:
    path = data_dir / "video" / f"{clip}.mp4"
    marks = {frame: row for frame, row in marks_of(path).items() if frame < FRAMES}
    return FILMS[film](read_film(path, marks))


def test_where_grey_levels_are_few_they_are_spread(data_dir: Path, tmp_path: Path) -> None:
    spread, as_filmed = [], []
    for clip, film in (("park_jog_rl", "against the light"), ("markers_walk_lr", "in haze")):
        pictures = made(data_dir, clip, film)
        found = scored(pictures, tmp_path / f"{clip}.mov")
        assert found.first_failure_frame is None
        assert found.swaps == 0
        assert found.mean_error_leg < 0.06
        spread.append(found.mean_error_leg)
        as_filmed.append(scored(pictures, tmp_path / f"{clip}.mov", contrast=0.0).mean_error_leg)
    assert sum(as_filmed) > 1.3 * sum(spread)


@pytest.mark.parametrize("clip", ["park_jog_rl", "track_run_rl"])
def test_a_figure_is_found_and_followed_while_the_light_fades(
    clip: str, data_dir: Path, tmp_path: Path
) -> None:
    path = data_dir / "video" / f"{clip}.mp4"
    pictures = dimmed(read_film(path, marks_of(path)))
    write_film(pictures, tmp_path / "film.mov")
    video = Video(tmp_path / "film.mov")
    job = Following().job(video.path, start_of(people(video, QUIET), Following(), video))
    found = score(pictures.marks, places(follow(job, QUIET).track), BEFORE_ALL)
    assert found.swaps == 0
    assert found.mean_error_leg < 0.06


def test_black_legs_that_pass_slowly_keep_their_names(data_dir: Path, tmp_path: Path) -> None:
    pictures = made(data_dir, "gym_walk_rl", "half speed")
    found = scored(pictures, tmp_path / "film.mov")
    assert found.first_failure_frame is None
    assert found.swaps == 0
    assert found.mean_error_leg < 0.07


def test_a_walker_whose_legs_pass_fast_keeps_their_names_where_the_motion_hardly_tells(
    data_dir: Path, tmp_path: Path
) -> None:
    path = data_dir / "video_hard" / "room_walk_rl.mp4"
    found = scored(read_film(path, marks_of(path)), tmp_path / "film.mov")
    assert found.first_failure_frame is None
    assert found.swaps == 0
    assert found.mean_error_leg < 0.07
