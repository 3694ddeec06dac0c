"""A finished run read back to be followed again, and what stays of it where marks were corrected."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kinematics.figure_file import WALKER
from kinematics.recover import Start
from tests.tracker.clips import QUIET, read_json
from tests.tracker.tracks import random_track
from tracker.clip.again import Kept, read_finished
from tracker.clip.follow import follow
from tracker.clip.job import Following, Found, Job, Nearer
from tracker.progress import Progress
from tracker.report.results import write_run
from tracker.run.read import RunError, read_track
from tracker.settings import Settings
from tracker.tables.keypoints import Mark, read_keypoints

TUNED = Settings(hypotheses=4, blend=0.2)
HERE, THERE = {"hip": Mark(1.0, 2.0)}, {"hip": Mark(3.0, 4.0)}
T, START = 20, 8


@pytest.fixture(scope="module")
def ran(clip, tmp_path_factory):
    """A job with options of every kind, its run, and the run's folder; not to be written to."""
    folder = tmp_path_factory.mktemp("again")
    film = folder / "walk.mp4"
    shutil.copy(clip.video, film)
    how = Following(model="cv", start=4, stop=7, rate=0.5, smooth=False)
    job = how.job(film, read_keypoints(clip.keypoints), TUNED)
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
    assert_allclose(follow(again.job, QUIET).track.joints(), run.track.joints(), atol=1e-6)


def test_with_anchors_every_marked_frame_is_read_back(ran, tmp_path):
    job, _, _ = ran
    job = replace(job, anchors=True, stop=5)
    write_run(follow(job, QUIET), tmp_path, QUIET, overlay=False, report=False)
    assert read_finished(tmp_path).job.marks.keys() == job.marks.keys()


def test_a_leg_that_is_not_sure_is_told(moved):
    start = {"frame": 4, "marks": "found", "near_leg": "unsure"}
    again = read_finished(changed(moved, start=start))
    assert again.unsure
    marks = again.job.marks[4]
    facing = {"right": 1, "left": -1}[read_json(moved / "run.json")["facing"]]
    ahead = facing * (marks["near_ankle"].x - marks["far_ankle"].x) > 0.0
    nearer = Nearer.AHEAD if ahead else Nearer.BEHIND
    assert again.job.found == Found(4, marks, facing, nearer, "unsure")


@pytest.mark.parametrize(
    ("news", "words"),
    [
        ({"film": {"path": "/nowhere/walk.mp4", "bytes": 1}}, "no longer at /nowhere/walk.mp4"),
        ({"options": None}, "options input should be"),
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


def test_a_film_that_moved_together_with_its_run_is_taken_where_it_is_the_same(ran, moved, monkeypatch):
    film = shutil.copy(ran[0].video, moved.parent / "walk.mp4")
    changed(moved, film={"path": "/nowhere/walk.mp4", "bytes": film.stat().st_size})
    monkeypatch.chdir(moved)
    assert read_finished(Path()).job.video == film
    film.write_bytes(b"another")
    with pytest.raises(RunError, match=f"no longer at /nowhere/walk.mp4, nor unaltered at {film}"):
        read_finished(Path())


def kept(before, now, rng):
    """Of frames that are marked HERE, and what corrections make of them; None takes marks away."""
    marks = dict.fromkeys((START, *before), HERE)
    corrected = {t: names for t, names in (marks | now).items() if names}
    return Kept.of(random_track(rng, T), marks, corrected, START)


@pytest.mark.parametrize(
    ("before", "now", "anew", "span"),
    [
        ((), {12: THERE}, (9, 19), (8, 19)),
        ((), {3: THERE}, (0, 7), (0, 8)),
        ((), {3: THERE, 12: THERE}, (0, 19), (0, 19)),
        ((15,), {12: THERE}, (9, 14), (8, 15)),
        ((11, 15), {12: THERE}, (12, 14), (8, 15)),
        ((2, 5), {3: THERE}, (3, 4), (2, 8)),
        ((15,), {15: THERE}, (9, 19), (8, 19)),
        ((12, 15), {12: THERE}, (9, 14), (8, 15)),
        ((12, 15), {12: None}, (9, 14), (8, 15)),
        ((15,), {19: THERE}, (16, 19), (8, 19)),
        # Marks outside the part that was followed:
        ((-6, -3), {-6: THERE}, (0, -1), (8, 8)),
        ((-3,), {12: THERE}, (9, 19), (8, 19)),
        ((-6,), {3: THERE}, (0, 7), (0, 8)),
        ((24,), {12: THERE}, (9, 19), (8, 19)),
        ((24, 27), {27: THERE}, (20, 19), (8, 8)),
    ],
)
def test_what_lies_beyond_the_next_marks_that_stay_is_kept(rng, before, now, anew, span):
    found = kept(before, now, rng)
    assert (found.anew, found.span) == (anew, span)


def test_where_the_start_or_nothing_changed_all_is_followed_again(rng):
    assert kept((12,), {START: THERE}, rng) is None
    assert kept((12,), {}, rng) is None


def test_a_track_is_replaced_in_these_frames_and_no_others(rng):
    old, new = random_track(rng, T), random_track(rng, 8, first=8)
    joined = Kept(old, (9, 14), (8, 15)).joined(new)
    for name in ("q", "cov", "s", "moved", "outcome"):
        one, before, after = (np.array(getattr(each, name)) for each in (joined, old, new))
        assert_array_equal(one[:9], before[:9])
        assert_array_equal(one[9:15], after[1:7])
        assert_array_equal(one[15:], before[15:])


@pytest.mark.parametrize("anew", [(0, -1), (20, 19)])
def test_of_a_correction_outside_the_track_nothing_is_replaced(rng, anew):
    old = random_track(rng, T)
    joined = Kept(old, anew, (8, 8)).joined(random_track(rng, 1, first=8))
    assert_array_equal(joined.q, old.q)
    assert joined.outcome == old.outcome


def test_another_figure_or_place_does_not_fit(rng):
    track = random_track(rng, T)
    start = Start(track.figure, track.view, track.q[0], np.ones(len(track.q[0]), dtype=bool))
    whole = Kept(track, (9, 19), (8, 19))
    labels = track.labels
    assert whole.fits(start, labels)
    assert not whole.fits(start, labels[:2])
    assert not whole.fits(replace(start, view=replace(track.view, facing=-1)), labels)
    longer = track.figure.with_lengths([1.1 * link.length for link in track.figure.links])
    assert not whole.fits(replace(start, figure=longer), labels)


@pytest.fixture(scope="module")
def anchored(clip, tmp_path_factory):
    """A job with anchors, its run, and its track read back."""
    marks = read_keypoints(clip.keypoints)
    job = Job(clip.video, {t: marks[t] for t in (4, 7)}, model="cv", start=4, anchors=True, smooth=False)
    run, folder = follow(job, QUIET), tmp_path_factory.mktemp("run")
    write_run(run, folder, QUIET, overlay=False, report=False)
    return job, run, read_track(folder, run.track.mark, WALKER)


def test_a_track_is_read_back_as_it_was_written(anchored, tmp_path):
    _, run, _ = anchored
    run = replace(run, track=replace(run.track, misnamed=0.25))
    write_run(run, tmp_path, QUIET, overlay=False, report=False)
    track = read_track(tmp_path, run.track.mark, WALKER)
    for name in ("figure", "view", "misnamed", "first", "model", "labels", "motions", "outcome"):
        assert getattr(track, name) == getattr(run.track, name)
    for name in ("q", "cov", "s", "moved", "times"):
        assert_array_equal(getattr(track, name), getattr(run.track, name))


@pytest.mark.parametrize(("frame", "follows"), [(2, range(4)), (5, range(5, 7)), (9, range(8, 10))])
def test_what_is_followed_again_is_as_if_all_were_and_the_rest_is_not_touched(
    anchored, clip, frame, follows, capsys
):
    job, _, track = anchored
    now = job.marks | {frame: read_keypoints(clip.keypoints)[frame]}
    again = replace(job, marks=now)
    whole = follow(again, QUIET).track
    part = follow(again, Progress("plain"), Kept.of(track, job.marks, now, 4)).track
    rest = sorted(set(range(10)) - set(follows))
    assert_array_equal(part.q[rest], track.q[rest])
    assert len(part) == len(whole) == 10
    # Ahead of the start what was learned of its belief going back is not had again: a hair's breadth.
    assert_allclose(part.joints()[follows], whole.joints()[follows], atol=0.5)
    assert not np.array_equal(part.q[follows], track.q[follows])
    count = {2: 5, 5: 4, 9: 6}[frame]
    assert f"walk.mp4 with cv: {count} of {count} in" in capsys.readouterr().err
