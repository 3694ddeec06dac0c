"""figtrack batch: every clip by itself, what is done stays, and nothing is lost with a process that dies."""

import json
import os
import signal
import threading
import time
from collections import Counter
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path

import pytest

from tests.tracker.clips import (
    QUIET,
    RUN_FILES,
    everything,
    figtrack,
    read_csv,
    read_json,
    refused,
    succeeds,
    write_table,
    write_video,
)
from tests.tracker.strolls import stroll
from tracker.batch import run_all as batch
from tracker.batch.jobs import read_jobs
from tracker.batch.run_all import COLUMNS, GAIT, _gait, job_key, run_batch, run_row, summary_cells
from tracker.clip.job import Job
from tracker.gait.figures import gait_of
from tracker.gait.lengths import Known
from tracker.models.cluster import local_cluster
from tracker.progress import Progress
from tracker.settings import Settings
from tracker.tables.keypoints import Mark

pytestmark = pytest.mark.whole

HEADER = ("video", "keypoints", "start", "model", "out")


@pytest.fixture
def table(clip, tmp_path):
    """A table beside a clip whose name has a space and a letter beyond ASCII."""
    folder = tmp_path / "späte Läufe"
    folder.mkdir()
    (folder / "走る 1.mp4").write_bytes(clip.video.read_bytes())
    (folder / "k 1.csv").write_bytes(clip.keypoints.read_bytes())

    def write(*rows, header=HEADER):
        write_table(folder / "jobs.csv", rows, header)
        return folder / "jobs.csv"

    return write


CLIP = ("走る 1.mp4", "k 1.csv")
ROW = (*CLIP, "", "cv", "a")


def rows_of(path):
    return [(row["status"], row["frames"], row["error"]) for row in read_csv(path)]


def test_a_failed_clip_does_not_stop_the_others_and_a_second_run_skips_what_is_done(table, cluster):
    path = table(
        (*CLIP, "", "cv", "été #1"), ("absent.mp4", "k 1.csv", "", "cv", "b"), (*CLIP, 99, "cv", "c"),
        ("走る 1.mp4", "jobs.csv", "", "cv", "d"), (*CLIP, "", "nobody", "e"), (*CLIP, 3, "walk-run", ""),
    )  # fmt: skip
    begun = ["batch", path, "--scheduler", cluster.scheduler.address]
    first = figtrack(*begun, "--quiet")
    assert first.exit_code == 1
    (told,) = first.stderr.splitlines()
    assert told.endswith("absent.mp4; absent.mp4 will fail")
    assert "2 done, 4 failed" in first.stdout
    wanted = ["", "no video at", "frame 99 is not marked", "no keypoints table", "nobody", ""]
    summary = path.with_name("summary.csv")
    for said, (status, frames, error) in zip(wanted, rows_of(summary), strict=True):
        assert said in error
        assert "\n" not in error
        assert (status, frames) == (("failed", "") if said else ("done", "10"))
    for name in ("été #1", "走る 1-track"):
        assert {inner.name for inner in (path.parent / name).iterdir()} == RUN_FILES
    before = everything(path.parent)

    (path.parent / "absent.mp4").write_bytes((path.parent / CLIP[0]).read_bytes())
    again = figtrack(*begun, "--progress", "json")
    assert again.exit_code == 1
    assert "2 skipped, 1 done, 3 failed" in again.stdout
    assert [status for status, _, _ in rows_of(summary)] == ["skipped", "done"] + ["failed"] * 3 + ["skipped"]
    assert '"task": "batch jobs.csv", "done": 6, "total": 6' in again.stderr
    after = everything(path.parent)
    changed = {name for name in before if before[name] != after[name]}
    assert changed == {Path("summary.csv"), Path("summary.html")}


def test_the_summary_has_the_gait_of_a_run_and_empty_cells_where_there_is_none(table, tmp_path):
    row = read_jobs(table(ROW), tmp_path, QUIET)[0]
    row.out.mkdir()
    walked = gait_of(stroll(), known=Known(height=1.75))
    (row.out / "gait.json").write_text(json.dumps(walked.summary()))
    told = dict(zip(COLUMNS, summary_cells(row, _gait(row.out)), strict=True))
    assert (told["motion"], told["length_unit"], told["flight_time_s"]) == ("walk", "m", "")
    for column, (name, legs) in GAIT.items():
        if column != "flight_time_s":
            value = getattr(walked.named(name), legs).mean
            assert float(told[column]) == pytest.approx(value, rel=1e-3, abs=1e-3)
    bare = dict(zip(COLUMNS, summary_cells(row, {"error": "why"}), strict=True))
    assert bare["error"] == "why"
    assert not any(bare[column] for column in ("motion", *GAIT, "length_unit"))


def test_results_go_where_told_and_all_done_is_exit_status_0(table, tmp_path):
    path = table(ROW, header=HEADER)
    place = tmp_path / "new" / "place"
    result = succeeds("batch", path, "--out", place, "--workers", 1)
    assert {inner.name for inner in place.iterdir()} == {"a", "summary.csv", "summary.html"}
    assert "batch jobs.csv: 1 of 1" in result.stderr
    (row,) = read_csv(place / "summary.csv")
    counts = Counter(pose["outcome"] for pose in read_csv(place / "a" / "pose.csv"))
    said = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
    rate = read_json(place / "a" / "run.json")["rate"]
    assert (row["outcomes"], row["rate"], row["model"]) == (said, f"{rate:g}", "cv")
    assert counts.total() == 10


def test_a_row_is_tracked_as_track_does_it(table, clip, tmp_path):
    (row,) = read_jobs(table(ROW), tmp_path, QUIET)
    assert run_row(row, overwrite=False)["status"] == "done"
    words = ["--keypoints", clip.keypoints, "--model", "cv", "--out", tmp_path / "b", "--quiet"]
    succeeds("track", clip.video, *words)
    for name in ("keypoints.csv", "pose.csv"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_a_run_of_another_job_is_replaced_only_when_asked(table, tmp_path):
    row, other = (
        read_jobs(table((*ROW, stop), header=(*HEADER, "stop")), tmp_path, QUIET)[0] for stop in (2, 1)
    )
    assert run_row(row, overwrite=False)["frames"] == "3"
    kept = everything(tmp_path / "a")
    ended = run_row(other, overwrite=False)
    assert ended["status"] == "failed"
    assert "holds a complete run" in ended["error"]
    assert everything(tmp_path / "a") == kept
    # The same job is never done again, asked or not.
    assert run_row(row, overwrite=True)["status"] == "skipped"
    assert everything(tmp_path / "a") == kept
    assert run_row(other, overwrite=True)["frames"] == "2"
    # What is damaged is done again if asked.
    (tmp_path / "a" / "track.npz").write_bytes(b"")
    assert run_row(other, overwrite=False)["status"] == "failed"
    assert run_row(other, overwrite=True)["status"] == "done"
    # A run that is not whole is no run that is done.
    (tmp_path / "a" / "run.json").write_text("{")
    assert run_row(other, overwrite=True)["status"] == "failed"


def test_a_job_is_another_when_anything_it_comes_from_is(clip, tmp_path):
    mark = {"hip": Mark(1.0, 2.0)}
    job = Job(clip.video, {0: mark}, model="cv")
    others = {
        "video": clip.keypoints,
        "marks": {0: {"hip": Mark(1.0, 2.0, visible=False)}},
        "model": "walk-run",
        "settings": Settings(iterations=3),
        "start": 0,
        "from_": 1,
        "stop": 5,
        "facing": 1,
        "rate": 1.0,
        "height": 1.75,
        "scale": 80.0,
        "smooth": False,
        "anchors": True,
        "measure": clip.keypoints,
        "figure": "horse",
    }
    keys = {job_key(replace(job, **{name: value})) for name, value in others.items()} | {job_key(job)}
    assert len(keys) == len(others) + 1
    # A new field of Job must make another job too, or be named here.
    assert {field.name for field in fields(Job)} - {"called", "found"} == others.keys()
    copy = tmp_path / "copy.mp4"
    copy.write_bytes(clip.video.read_bytes())
    assert job_key(replace(job, video=copy, called="so")) == job_key(job)


def test_a_job_is_another_when_the_file_of_its_model_or_figure_or_an_image_is(tmp_path):
    (tmp_path / "m.npz").write_bytes(b"one")
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "0.png").write_bytes(b"one")
    (tmp_path / "f.toml").write_text("one")
    job = Job(tmp_path / "images", {}, model=str(tmp_path / "m.npz"), figure=str(tmp_path / "f.toml"))
    keys = [job_key(job)]
    (tmp_path / "images" / "0.json").write_text("no picture")
    assert job_key(job) == keys[0]
    (tmp_path / "m.npz").write_bytes(b"two")
    keys.append(job_key(job))
    (tmp_path / "f.toml").write_text("two")
    keys.append(job_key(job))
    (tmp_path / "images" / "0.png").write_bytes(b"two")
    keys.append(job_key(job))
    assert len(set(keys)) == 4


def test_a_job_is_another_when_the_points_of_a_folder_are_of_other_frames(tmp_path):
    points = tmp_path / "points"
    points.mkdir()
    first = points / "walk_000000000001_keypoints.json"
    first.write_text("{}")
    job = Job(tmp_path / "walk.mp4", {}, measure=points)
    before = job_key(job)
    second = first.rename(points / "walk_000000000002_keypoints.json")
    assert job_key(job) != before
    second.rename(points / os.fsdecode(b"L\xe4ufe_000000000001_keypoints.json"))  # no UTF-8
    assert job_key(job) != before


def broken(row, overwrite):
    """A mistake of ours in one row of two."""
    if row.how.model == "cv":
        raise RuntimeError("a mistake\nof ours")
    return {"status": "done", "frames": "1"}


def test_a_mistake_of_ours_fails_its_own_row(table, tmp_path, cluster, monkeypatch):
    monkeypatch.setattr(batch, "run_row", broken)
    path = table((*CLIP, "", "cv", "a"), (*CLIP, "", "walk-run", "b"))
    address = cluster.scheduler.address
    ended = run_batch(path, tmp_path, workers=None, scheduler=address, overwrite=False, progress=QUIET)
    found = [(cells["status"], cells.get("error", "")) for _, cells in ended]
    assert found == [("failed", "RuntimeError: a mistake of ours"), ("done", "")]


def test_a_process_killed_in_the_middle_loses_nothing(table, clip, tmp_path, cluster):
    write_video(tmp_path / "späte Läufe" / "long.mp4", clip.images * 3)
    long = ("long.mp4", "k 1.csv", "", "cv", "a")
    path = table(long, (*CLIP, "", "cv", "b"), (*CLIP, 2, "cv", "c"))
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "run.json").write_text('{"figtrack": "0"}')
    killed = []

    def kill():
        """The process that is at the long clip, once it has begun to write."""
        while not list(tmp_path.glob(".a.*.part")):
            time.sleep(0.01)
        at_work = {worker for worker, tasks in cluster.processing().items() if tasks}
        for worker, pid in cluster.run(os.getpid).items():
            if worker in at_work:
                os.kill(pid, signal.SIGKILL)
                killed.append(list(tmp_path.glob(".a.*.part")))
                return

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    address = cluster.scheduler.address
    ended = run_batch(path, tmp_path, workers=None, scheduler=address, overwrite=True, progress=QUIET)
    killer.join(timeout=60)
    assert len(killed) == 1
    found = [(cells["status"], cells.get("frames")) for _, cells in ended]
    assert found == [("done", "30"), ("done", "10"), ("done", "10")]
    for name in "abc":
        assert {inner.name for inner in (tmp_path / name).iterdir()} == RUN_FILES
    assert not list(tmp_path.rglob("*.part"))
    cluster.wait_for_workers(2, timeout=60)


def noted(row, overwrite):
    """Says that it has begun; the second row ends once the first one's process is dead."""
    with (row.out.parent / "begun.txt").open("a") as file:
        file.write(f"{row.out.name} {os.getpid()}\n")
    while row.out.name == "b" and not (row.out.parent / "killed").exists():
        time.sleep(0.01)
    return {"status": "done", "frames": "1"}


def test_what_is_done_is_not_done_again_when_its_process_dies_later(table, tmp_path, cluster, monkeypatch):
    monkeypatch.setattr(batch, "run_row", noted)
    tasks = cluster.cluster.scheduler.tasks

    class Killing(Progress):
        @contextmanager
        def task(self, name, total):
            yield self.advance

        def advance(self):
            """Kill the process of the row that ended first, once the scheduler may have forgotten the row."""
            if (tmp_path / "killed").exists():
                return
            for _ in range(50):
                if len(tasks) > 1:
                    time.sleep(0.01)
            begun = dict(line.split() for line in (tmp_path / "begun.txt").read_text().splitlines())
            os.kill(int(begun["a"]), signal.SIGKILL)
            (tmp_path / "killed").touch()

    path, address = table((*CLIP, "", "cv", "a"), (*CLIP, "", "cv", "b")), cluster.scheduler.address
    run_batch(path, tmp_path, workers=None, scheduler=address, overwrite=False, progress=Killing("quiet"))
    begun = [line.split()[0] for line in (tmp_path / "begun.txt").read_text().splitlines()]
    assert sorted(begun) == ["a", "b"]
    cluster.wait_for_workers(2, timeout=60)


@contextmanager
def deserted(workers):
    """A cluster that has lost its processes."""
    with local_cluster(1) as client:
        client.cluster.scale(0)
        while client.cluster.scheduler.workers:
            time.sleep(0.01)
        yield client


def test_without_any_process_the_rows_fail_instead_of_waiting_for_ever(table, tmp_path, monkeypatch):
    monkeypatch.setattr("tracker.models.cluster.STALLED", "0.5s")
    monkeypatch.setattr(batch, "local_cluster", deserted)
    path = table((*CLIP, "", "cv", "a"), (*CLIP, "", "cv", "b"))
    ended = run_batch(path, tmp_path, workers=1, scheduler=None, overwrite=False, progress=QUIET)
    assert [cells["status"] for _, cells in ended] == ["failed"] * 2
    assert {cells["error"] for _, cells in ended} == {
        "no process was left to do it; the same batch again goes on here"
    }


def interrupted(futures, **_):
    """Ctrl-C as soon as the first clip is done."""
    while not any(future.done() for future in futures):
        time.sleep(0.01)
    raise KeyboardInterrupt


def test_a_batch_that_is_stopped_keeps_what_is_done(table, tmp_path, cluster, monkeypatch):
    path = table(ROW, ("k 1.csv", "k 1.csv", "", "cv", "b"))
    words = ["batch", path, "--out", tmp_path / "out", "--scheduler", cluster.scheduler.address]
    with monkeypatch.context() as patch:
        patch.setattr("distributed.as_completed", interrupted)
        assert refused(*words).endswith("the same batch again goes on there")
    assert not (tmp_path / "out" / "summary.csv").exists()
    # What was being done may have ended all the same; again, all ends.
    assert figtrack(*words, "--quiet").exit_code == 1
    statuses = [status for status, _, _ in rows_of(tmp_path / "out" / "summary.csv")]
    assert statuses in (["done", "failed"], ["skipped", "failed"])
    assert not list(tmp_path.rglob("*.part"))


def test_a_summary_that_is_the_table_of_clips_is_never_replaced(table, tmp_path):
    (tmp_path / "out").mkdir()
    clips = table(ROW).rename(tmp_path / "out" / "summary.csv")
    clips.write_text(",".join(COLUMNS) + "\n" + "walk.mp4" + "," * (len(COLUMNS) - 1) + "\n")
    before = clips.read_text()
    result = figtrack("batch", clips, "--out", tmp_path / "out", "--overwrite", "--quiet")
    assert result.exit_code == 1
    assert "is what the work reads; choose another --out" in result.stderr.splitlines()[-1]
    assert clips.read_text() == before


@pytest.mark.parametrize("name", ["summary.csv", "summary.html"])
def test_a_summary_of_something_else_is_never_replaced(table, tmp_path, name):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).write_text("my,own\n1,2\n")
    said = refused("batch", table(ROW), "--out", tmp_path / "out", "--overwrite")
    assert "is of something else" in said
    assert everything(tmp_path / "out") == {Path(name): b"my,own\n1,2\n"}
    (tmp_path / "place").write_text("")
    said = refused("batch", table(ROW), "--out", tmp_path / "place")
    assert "cannot write into" in said
