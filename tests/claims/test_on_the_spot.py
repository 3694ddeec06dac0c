"""Who stays in the picture's middle is found rightly, or refused with about the joints; nothing else is."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kinematics.sides import other_side
from tests.benchmarks.evaluation.cases import marks_of
from tests.benchmarks.evaluation.disturbances import Film, read_film, write_film
from tests.benchmarks.evaluation.films import on_the_spot, panned
from tracker.clip.found import people, start_of
from tracker.clip.job import Following
from tracker.clip.start import FoundError
from tracker.progress import Progress
from tracker.run.score import leg_length
from tracker.tables.keypoints import Mark
from videos.frames import Video

pytestmark = pytest.mark.claims

QUIET = Progress("quiet")


@pytest.mark.parametrize(
    ("clip", "moved", "said"),
    [
        ("gym_walk_rl", on_the_spot, "somebody may move on the spot, as on a treadmill"),
        ("indoor_walk_lr", on_the_spot, ""),
        ("markers_walk_lr", panned, "not sure which way the figure faces"),
        ("indoor_walk_lr", panned, ""),
    ],
)
def test_a_walker_in_the_middle_of_the_picture_is_found_rightly_or_refused_with_a_suggestion(
    clip: str, moved: Callable[[Film], Film], said: str, data_dir: Path, tmp_path: Path
) -> None:
    path = data_dir / "video" / f"{clip}.mp4"
    film = moved(read_film(path, marks_of(path)))
    write_film(film, tmp_path / "film.mov")
    video = Video(tmp_path / "film.mov")
    leg = leg_length(film.marks, sorted(film.marks))
    frame, marks, refused = _start(video)
    assert bool(refused) == bool(said)
    assert said in refused
    assert "\n" not in refused
    truth = _nearest(film, frame)
    exchanged = {other_side(name): mark for name, mark in marks.items()}
    if refused:
        assert _away({"hip": truth["hip"]}, marks) < 0.4 * leg
    else:
        assert min(_away(truth, marks), _away(truth, exchanged)) < 0.1 * leg


def _start(video: Video) -> tuple[int, dict[str, Mark], str]:
    """Frame and joints of the start, and why it was refused, if it was."""
    try:
        found = start_of(people(video, QUIET), Following(), video)
    except FoundError as error:
        ((frame, marks),) = (error.suggested or {}).items()
        return frame, marks, str(error)
    return found.frame, found.marks, ""


def _nearest(film: Film, frame: int) -> dict[str, Mark]:
    return film.marks[min(film.marks, key=lambda marked: abs(marked - frame))]


def _away(truth: dict[str, Mark], found: dict[str, Mark]) -> float:
    """Mean distance of the joints from their marks, pixels."""
    off = np.array([(found[name].x - mark.x, found[name].y - mark.y) for name, mark in truth.items()])
    return float(np.hypot(*off.T).mean())
