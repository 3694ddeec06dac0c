"""figtrack find, and commands that start without a mark."""

import numpy as np
import pytest

from tests.tracker.clips import (
    RUN_FILES,
    everything,
    figtrack,
    read_csv,
    read_json,
    refused,
    succeeds,
    write_images,
    write_table,
    write_video,
)
from tests.tracker.outline.films import MIDDLE, UNIT, WALKER, a_walk, film
from tracker.batch.jobs import read_jobs
from tracker.batch.run_all import DONE, run_row
from tracker.clip import found
from tracker.clip.asked import asked
from tracker.clip.found import TURNED
from tracker.clip.job import Following
from tracker.clip.naming import nearer
from tracker.progress import Progress
from tracker.tables.keypoints import points, read_keypoints

STOP = 19  # the last frame that is followed, for speed


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "walk.mp4"
    write_video(path, a_walk().images)
    return path


@pytest.fixture
def seen(monkeypatch, tmp_path):
    """Have these people found in every film; results go into an empty folder."""
    monkeypatch.chdir(tmp_path)

    def see(*people):
        monkeypatch.setattr(found, "people", lambda *_: list(people))

    return see


@pytest.fixture
def unseen(monkeypatch, tmp_path):
    """Nobody may be looked for."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(found, "people", None)


def test_a_film_alone_is_followed_and_the_run_has_what_it_started_from(video, tmp_path):
    out = tmp_path / "out"
    result = succeeds("track", video, "--model", "cv", "--stop", STOP, "--out", out, "--progress", "plain")
    assert {path.name for path in out.iterdir()} == RUN_FILES
    news = read_json(out / "run.json")
    frame = news["start"]["frame"]
    assert news["start"] == {"frame": frame, "marks": "found", "near_leg": "sure"}
    assert (news["facing"], news["frames"], news["warnings"]) == ("right", STOP + 1, [])
    marks = read_keypoints(out / "start.keypoints.csv")
    assert list(marks) == [frame]
    for table in (marks, read_keypoints(out / "keypoints.csv")):
        for name, place in zip(WALKER.joints, a_walk().joints[frame], strict=True):
            x, y = points(table[frame])[name]
            assert (x - place[0]) ** 2 + (y - place[1]) ** 2 < (0.15 * UNIT) ** 2
    assert f"walk.mp4 with cv: {STOP + 1} of {STOP + 1} in" in result.stderr


def test_find_writes_table_and_picture_and_says_a_line_a_person(seen, video, tmp_path):
    seen(a_walk().person())
    result = figtrack("find", video)
    assert (result.exit_code, result.stdout.count("\n")) == (0, 1)
    assert result.stdout.startswith("person 1: frames 0 to ")
    assert {path.name for path in tmp_path.iterdir()} == {"walk-people.csv", "walk-people.png"}
    assert len(read_csv(tmp_path / "walk-people.csv")) == 1


def test_nobody_is_an_answer_of_find_and_no_start_for_track(tmp_path, rng, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_video(tmp_path / "empty.mp4", film(rng, frames=20, walker=False).images)
    result = figtrack("find", "empty.mp4", "--quiet")
    assert (result.exit_code, result.output) == (0, "nobody walks through empty.mp4\n")
    assert read_csv(tmp_path / "empty-people.csv") == []
    monkeypatch.setattr(found, "people", lambda *_: [])
    assert "nobody was found who walks through the film" in refused("track", "empty.mp4")
    assert "empty.mp4 ends before frame 20; choose an" in refused("track", "empty.mp4", "--from", 20)
    assert {path.name for path in tmp_path.iterdir()} == {"empty.mp4", "empty-people.csv"}


def test_a_start_that_is_refused_leaves_its_marks_beside_where_the_run_would_lie(seen, video, tmp_path):
    one = a_walk().person(turned=0.5 * TURNED)
    seen(one)
    out = tmp_path / "runs" / "out"
    assert "not sure which way the figure faces" in refused("track", video, "--out", out)
    suggested = tmp_path / "runs" / "walk.suggested.keypoints.csv"
    assert [path.name for path in out.parent.iterdir()] == [suggested.name]
    marks = read_keypoints(suggested)[MIDDLE]
    assert [(mark.x, mark.y) for mark in marks.values()] == pytest.approx(one.joints, abs=0.01)


def test_a_nearer_leg_that_is_given_is_the_one_that_is_followed_as_near(seen, video, tmp_path):
    one = a_walk().person(named=0.5)
    seen(one)
    words = ("--near", nearer(one).other, "--model", "cv", "--stop", STOP, "--quiet")
    result = succeeds("track", video, *words)
    assert result.stderr.startswith("warning: the leg that is called far looks like the nearer one")
    assert result.stderr.endswith(f"give --near {nearer(one)}\n")
    assert read_json(tmp_path / "walk-track" / "run.json")["start"]["near_leg"] == "given"
    marks = read_keypoints(tmp_path / "walk-track" / "start.keypoints.csv")[MIDDLE]
    knee = WALKER.joints.index("far_knee")
    assert marks["near_knee"].x == pytest.approx(one.joints[knee, 0], abs=0.01)


def test_of_a_part_of_the_film_the_person_is_followed_whom_find_lists_by_this_number(video, monkeypatch):
    one, other = a_walk().person(), a_walk().shifted(44).person()
    monkeypatch.setattr(
        found, "people", lambda film, progress, first=0, *_: [one, other] if first else [other, one]
    )
    job = asked(Following(person=1, from_=1), video, None, None, Progress("quiet"))
    assert job.marks[MIDDLE]["hip"].x == pytest.approx(other.joints[0, 0], abs=0.01)


def test_results_that_are_there_are_refused_before_anybody_is_looked_for(unseen, video, tmp_path):
    (tmp_path / "walk-track").mkdir()
    (tmp_path / "walk-track" / "run.json").write_text('{"figtrack": "0"}')
    (tmp_path / "walk-compare").mkdir()
    (tmp_path / "walk-compare" / "compare.json").write_text('{"models": []}')
    for name in ("walk-people.csv", "p.png"):
        (tmp_path / name).write_text("mine")
    write_table(tmp_path / "k.csv", [(MIDDLE, "hip", 120, 100, 1)])
    before = everything(tmp_path)
    assert "walk-track holds a complete run" in refused("track", video)
    assert "walk-compare holds a complete run" in refused("compare", video, "--truth", "k.csv")
    assert "walk-people.csv exists" in refused("find", video)
    assert "p.png exists" in refused("find", video, "--out", "p.csv")
    assert "would be one file" in refused("find", video, "--out", "p.png", "--overwrite")
    assert everything(tmp_path) == before


def test_a_model_or_settings_that_cannot_be_are_told_before_anybody_is_looked_for(unseen, video, tmp_path):
    (tmp_path / "wrong.toml").write_text("blur = 1\n")
    assert "nosuch" in refused("track", video, "--model", "nosuch")
    assert "blur" in refused("track", video, "--settings", "wrong.toml")


def test_an_image_of_the_film_is_no_place_for_the_picture(tmp_path, unseen):
    write_images(tmp_path / "images", [np.full((40, 60, 3), 99, np.uint8)] * 3)
    before = everything(tmp_path)
    said = refused("find", tmp_path / "images", "--out", tmp_path / "images" / "1.csv", "--overwrite")
    assert "1.png is what the work reads" in said
    assert everything(tmp_path) == before


def test_a_picture_of_people_who_are_no_longer_found_goes(seen, video, tmp_path):
    seen(a_walk().person())
    figtrack("find", video)
    seen()
    assert "walk-people.csv exists" in refused("find", video)
    assert (tmp_path / "walk-people.png").exists()
    assert figtrack("find", video, "--overwrite").stdout == "nobody walks through walk.mp4\n"
    assert {path.name for path in tmp_path.iterdir()} == {"walk-people.csv"}


def test_models_are_compared_by_marks_that_they_do_not_start_from(seen, video, tmp_path):
    walk = a_walk()
    seen(walk.person(frame=3))
    rows = [(9, name, *place, 1) for name, place in zip(WALKER.joints, walk.joints[9], strict=True)]
    write_table(tmp_path / "truth.csv", rows)
    words = ("--truth", "truth.csv", "--model", "cv", "--stop", 9, "--quiet")
    result = succeeds("compare", video, *words)
    assert "1 of 1" in result.stdout  # frame 9, which is not the start
    assert figtrack("compare", video, "--model", "cv").exit_code == 2


def test_a_row_of_a_batch_needs_no_marks_and_its_folder_says_what_is_not_sure(seen, video, tmp_path):
    one = a_walk().person(named=0.5)
    seen(one)
    write_table(tmp_path / "jobs.csv", [(video, "", "cv", STOP)], ("video", "keypoints", "model", "stop"))
    (row,) = read_jobs(tmp_path / "jobs.csv", tmp_path, Progress("quiet"))
    assert row.keypoints is None
    ending = run_row(row, overwrite=False)
    assert (ending["status"], ending["frames"]) == (DONE, str(STOP + 1))
    other = nearer(one).other
    assert ending["warnings"].startswith("it is not sure which leg is the nearer one")
    assert ending["warnings"].endswith(f"in frame {MIDDLE}, give --near {other}")
    start = read_json(row.out / "run.json")["start"]
    assert start == {"frame": MIDDLE, "marks": "found", "near_leg": "unsure"}
