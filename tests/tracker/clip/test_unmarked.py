"""Jobs of films in which nothing is marked."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.clip.filmed import QUIET, as_video
from tests.tracker.clips import write_table
from tests.tracker.outline.films import MIDDLE, UNIT, WALKER
from tracker import follow
from tracker.clip import found as found_module
from tracker.clip.asked import asked
from tracker.clip.job import Following
from tracker.clip.naming import nearer
from tracker.clip.plan import prepare


@pytest.fixture
def seen(monkeypatch, walk):
    """Who is found in whatever film, and how many films were looked through."""
    looked = []

    def people(video, progress, *how):
        looked.append(how)
        return [walk.person()]

    monkeypatch.setattr(found_module, "people", people)
    return looked


def test_a_job_without_marks_starts_from_who_is_found_as_it_faces(seen, video, walk):
    job = asked(Following(model="cv", from_=3, stop=25, facing="right"), video.path, None, None, QUIET)
    assert seen == [(3, 25, 1)]
    assert (list(job.marks), job.facing, job.found.frame) == ([MIDDLE], 1, MIDDLE)
    plan = prepare(job)
    assert plan.start.q == pytest.approx(walk.start().q, abs=0.05)


@pytest.mark.parametrize("options", [{"facing": "right"}, {"from_": 3}, {"stop": 25}])
def test_a_number_is_that_of_the_whole_film_searched_for_all(options, seen, video):
    asked(Following(model="cv", person=1, **options), video.path, None, None, QUIET)
    assert len(seen) == 2
    assert seen[1] == ()


def test_marks_win_and_nobody_is_looked_for(seen, video, walk, tmp_path):
    rows = [(3, name, *place, 1) for name, place in zip(WALKER.joints, walk.joints[3], strict=True)]
    write_table(tmp_path / "k.csv", rows)
    job = asked(Following(), video.path, tmp_path / "k.csv", None, QUIET)
    assert (seen, list(job.marks), job.found) == ([], [3], None)
    for options in ({"person": 1}, {"near": "ahead"}):
        with pytest.raises(ValueError, match="leave them or the keypoints out"):
            asked(Following(**options), video.path, tmp_path / "k.csv", None, QUIET)


def test_in_python_a_film_alone_is_followed_and_doubts_are_warnings(monkeypatch, video, walk):
    monkeypatch.setattr(found_module, "people", lambda *_: [walk.person(named=0.5)])
    other = nearer(walk.person()).other
    with pytest.warns(UserWarning, match=f"if it is the one {other} in frame {MIDDLE}, give near='{other}'"):
        track = follow(video.path, model="cv", stop=MIDDLE)
    ankles = [track.figure.joints.index(name) for name in ("near_ankle", "far_ankle")]
    off = np.hypot(*np.moveaxis(track.joints()[:, ankles] - walk.joints[: MIDDLE + 1, ankles], -1, 0))
    assert len(track) == MIDDLE + 1
    assert np.median(off) < 0.1 * UNIT


def test_a_facing_against_the_film_and_a_turn_are_warned_of(monkeypatch, walk, tmp_path):
    there_and_back = as_video(np.concatenate([walk.images, walk.images[::-1]]), tmp_path)
    monkeypatch.setattr(found_module, "people", lambda *_: [replace(walk.person(turned=-1.0), given=True)])
    with pytest.warns(UserWarning, match="the figure ") as said:
        follow(there_and_back.path, model="cv", facing="right")
    texts = "\n".join(str(each.message) for each in said)
    assert "facing says right, but in the film" in texts
    assert f"at frame {len(walk.q) - 1} the figure goes back where it came from" in texts
