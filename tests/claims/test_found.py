"""Who is found without marks: on the spot, before a camera that goes along, or with legs that look alike."""

import numpy as np
import pytest

from kinematics.sides import other_side
from tests.benchmarks.evaluation.cases import QUIET, marks_of
from tests.benchmarks.evaluation.disturbances import read_film, write_film
from tests.benchmarks.evaluation.feet import ANKLES
from tests.benchmarks.evaluation.films import on_the_spot, panned
from tracker.clip.found import people, start_of
from tracker.clip.job import Following
from tracker.clip.start import FoundError
from tracker.run.score import leg_length
from videos.frames import Video

pytestmark = pytest.mark.claims

ON_THE_SPOT = "somebody may move on the spot, as on a treadmill or before a camera that goes along"


@pytest.mark.parametrize(
    ("clip", "moved", "said"),
    [
        ("gym_walk_rl", on_the_spot, ON_THE_SPOT),
        ("indoor_walk_lr", on_the_spot, ""),
        ("markers_walk_lr", panned, ON_THE_SPOT),
        ("indoor_walk_lr", panned, ""),
    ],
)
def test_a_walker_in_the_middle_of_the_picture_is_found_rightly_or_refused_with_a_suggestion(
    clip, moved, said, data_dir, tmp_path
):
    path = data_dir / "video" / f"{clip}.mp4"
    film = moved(read_film(path, marks_of(path)))
    write_film(film, tmp_path / "film.mov")
    leg = leg_length(film.marks, sorted(film.marks))
    frame, marks, refused = start(Video(tmp_path / "film.mov"))
    assert bool(refused) == bool(said)
    assert said in refused
    assert "\n" not in refused
    truth = film.marks[min(film.marks, key=lambda marked: abs(marked - frame))]
    exchanged = {other_side(name): mark for name, mark in marks.items()}
    if refused:
        assert away({"hip": truth["hip"]}, marks) < 0.4 * leg
    else:
        assert min(away(truth, marks), away(truth, exchanged)) < 0.1 * leg


def start(video):
    """Frame and joints of the start, and why it was refused, if it was."""
    try:
        found = start_of(people(video, QUIET), Following(), video)
    except FoundError as error:
        ((frame, marks),) = (error.suggested or {}).items()
        return frame, marks, str(error)
    return found.frame, found.marks, ""


def away(truth, found):
    """Mean distance of the joints from their marks, pixels."""
    return np.mean([np.hypot(found[name].x - mark.x, found[name].y - mark.y) for name, mark in truth.items()])


@pytest.mark.parametrize(
    ("clip", "first", "last"),
    [("video/gym_walk_rl", 36, 80), ("video/gym_walk_rl", 48, 92), ("video_hard/gym_backwalk_lr", 18, 62)],
)
def test_legs_in_the_same_black_trousers_are_named_rightly_by_the_arms(clip, first, last, data_dir):
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
