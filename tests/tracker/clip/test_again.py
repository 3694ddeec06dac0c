"""A finished run read back to be followed again."""

import json
import shutil
from dataclasses import replace

import pytest
from numpy.testing import assert_allclose

from tests.tracker.clips import read_json
from tracker.clip.again import read_finished
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.progress import Progress
from tracker.report.results import write_run
from tracker.run.read import RunError
from tracker.settings import Settings
from tracker.tables.keypoints import read_keypoints

QUIET = Progress("quiet")
TUNED = Settings(hypotheses=4, blend=0.2)


@pytest.fixture(scope="module")
def ran(clip, tmp_path_factory):
    """A job with options of every kind, its run, and the run's folder; not to be written to."""
    folder = tmp_path_factory.mktemp("again")
    film = folder / "walk.mp4"
    shutil.copy(clip.video, film)
    job = Job(film, read_keypoints(clip.keypoints), "cv", TUNED, start=4, stop=7, rate=0.5, smooth=False)
    run = follow(job, QUIET)
    (folder / "run").mkdir()
    write_run(run, folder / "run", QUIET, "a key", overlay=False, report=False)
    return job, run, folder / "run"


@pytest.fixture
def moved(ran, tmp_path):
    """A copy of the folder, whose run.json may be changed."""
    shutil.copytree(ran[2], tmp_path / "run")
    return tmp_path / "run"


def changed(folder, **news):
    path = folder / "run.json"
    path.write_text(json.dumps(read_json(path) | news))
    return folder


def test_the_job_that_is_read_back_follows_the_very_same_way(ran):
    job, run, folder = ran
    again = read_finished(folder)
    assert (again.key, again.unsure) == ("a key", False)
    assert again.job.marks.keys() == {4}
    same = ("start", "stop", "rate", "smooth", "model", "measure")
    assert {name: getattr(again.job, name) for name in same} == {name: getattr(job, name) for name in same}
    # Marks are written in hundredths of pixels.
    assert_allclose(follow(again.job, QUIET).track.joints(), run.track.joints(), atol=0.2)


def test_with_anchors_every_marked_frame_is_read_back(ran, tmp_path):
    job, _, _ = ran
    job = replace(job, anchors=True, stop=5)
    write_run(follow(job, QUIET), tmp_path, QUIET, overlay=False, report=False)
    assert read_finished(tmp_path).job.marks.keys() == job.marks.keys()


def test_a_leg_that_is_not_sure_is_told(moved):
    start = {"frame": 4, "marks": "found", "near_leg": "unsure"}
    assert read_finished(changed(moved, start=start)).unsure


@pytest.mark.parametrize(
    ("news", "words"),
    [
        ({"film": {"path": "/nowhere/walk.mp4", "bytes": 1}}, "no longer at /nowhere/walk.mp4"),
        ({"options": None}, "does not say how it was made"),
        ({"options": {"blur": 1}}, "does not say how it was made"),
        ({"options": {"rate": 99.0}}, "does not say how it was made"),
        ({"start": {}}, "does not say how it was made"),
    ],
)
def test_what_cannot_be_followed_again_is_said(moved, news, words):
    with pytest.raises(RunError, match=words):
        read_finished(changed(moved, **news))


def test_a_film_that_was_altered_is_said(ran, moved, tmp_path):
    film = tmp_path / "walk.mp4"
    film.write_bytes(ran[0].video.read_bytes() + b"more")
    with pytest.raises(RunError, match="was altered since"):
        read_finished(changed(moved, film={"path": str(film), "bytes": film.stat().st_size - 4}))


def test_without_the_marks_that_it_passes_through_there_is_nothing_to_go_on_from(moved):
    (moved / "start.keypoints.csv").unlink()
    with pytest.raises(RunError, match="does not say how it was made"):
        read_finished(moved)
