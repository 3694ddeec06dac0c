"""Results appear whole or not at all, and replace nothing that they should not."""

import os
import shutil
import tempfile
from functools import partial
from pathlib import Path

import pytest

from tests.tracker.clips import everything
from tests.tracker.run.folders import complete_run, names, write_run_into
from tracker.run.folder import FolderError, fresh_file, fresh_folder, swept


def write_file_into(path, *, overwrite=False, failure=None):
    with fresh_file(path, overwrite=overwrite) as aside:
        aside.write_text("new")
        if failure is not None:
            raise failure


def test_a_folder_has_its_name_only_when_it_is_complete(tmp_path):
    out = tmp_path / "out"
    with fresh_folder(out, overwrite=False) as aside:
        (aside / "half").write_text("")
        assert not out.exists()
    assert names(tmp_path) == ["out"]
    assert names(out) == ["half"]


def test_a_new_folder_has_the_permissions_of_any_other(tmp_path):
    write_run_into(tmp_path / "out")
    (tmp_path / "other").mkdir()
    assert (tmp_path / "out").stat().st_mode == (tmp_path / "other").stat().st_mode


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_a_failure_leaves_nothing_behind_not_even_parents(tmp_path, failure):
    with pytest.raises(failure):
        write_run_into(tmp_path / "a" / "b" / "out", failure=failure)
    assert names(tmp_path) == []


def test_an_empty_folder_is_filled(tmp_path):
    (tmp_path / "out").mkdir()
    write_run_into(tmp_path / "out")
    assert names(tmp_path / "out") == ["pose.csv", "run.json"]


def test_a_complete_run_is_kept_unless_overwrite_says_otherwise(tmp_path):
    complete_run(tmp_path / "out")
    with pytest.raises(FolderError, match=r"out holds a complete run; .*--overwrite"):
        write_run_into(tmp_path / "out")
    assert (tmp_path / "out" / "pose.csv").read_text() == "old"
    write_run_into(tmp_path / "out", overwrite=True)
    assert (tmp_path / "out" / "pose.csv").read_text() == "new"
    assert names(tmp_path) == ["out"]


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_a_failing_run_keeps_the_old_one_byte_for_byte(tmp_path, failure):
    complete_run(tmp_path / "out")
    before = everything(tmp_path)
    with pytest.raises(failure):
        write_run_into(tmp_path / "out", overwrite=True, failure=failure)
    assert everything(tmp_path) == before
    assert names(tmp_path) == ["out"]


def test_the_old_run_comes_back_when_the_new_one_cannot_take_its_place(tmp_path, monkeypatch):
    complete_run(tmp_path / "out")
    before, rename = everything(tmp_path), Path.rename

    def fails_for_the_new_one(self, target):
        if self.name == "new":
            raise PermissionError(13, "Permission denied")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", fails_for_the_new_one)
    with pytest.raises(FolderError, match=r"cannot put the results at .*out \(Permission denied\)"):
        write_run_into(tmp_path / "out", overwrite=True)
    assert everything(tmp_path) == before
    assert names(tmp_path) == ["out"]


@pytest.mark.parametrize("inner", ["", "walk-run"], ids=["of a run", "of a run in a comparison"])
def test_corrections_that_were_not_followed_are_never_replaced(inner, tmp_path):
    write_run_into(tmp_path / "out")
    run = tmp_path / "out" / inner
    run.mkdir(exist_ok=True)
    (run / "corrected.keypoints.csv").write_text("by hand")
    with pytest.raises(
        FolderError, match=f"{run} holds corrections that were not followed yet; follow on in"
    ):
        write_run_into(tmp_path / "out", overwrite=True)
    assert (run / "corrected.keypoints.csv").read_text() == "by hand"


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("content", [None, "not json", "[" * 100_000, '{"script": "go"}', '["figtrack"]'])
def test_a_foreign_folder_is_never_replaced(tmp_path, overwrite, content):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("years of work")
    if content is not None:
        (tmp_path / "out" / "run.json").write_text(content)
    before = everything(tmp_path)
    with pytest.raises(FolderError, match="holds files that are no run of figtrack; choose another --out"):
        write_run_into(tmp_path / "out", overwrite=overwrite)
    assert everything(tmp_path) == before


@pytest.mark.parametrize(
    ("marker", "text"),
    [
        ("run.json", '{"figtrack": "0"}'),
        ("compare.json", '{"models": {}}'),
        ("demo.json", '{"figtrack": "0"}'),
    ],
)
def test_runs_comparisons_and_demos_are_ours_to_replace(tmp_path, marker, text):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / marker).write_text(text)
    write_run_into(tmp_path / "out", overwrite=True)
    assert "pose.csv" in names(tmp_path / "out")


def test_a_place_that_cannot_be_written_is_said_before_the_work(tmp_path):
    (tmp_path / "file").write_text("")
    for out in (tmp_path / "file" / "out", tmp_path / "file" / "deeper" / "out", tmp_path / ("x" * 250)):
        with pytest.raises(FolderError, match=r"cannot write into .*; choose another --out"):
            write_run_into(out)
    assert names(tmp_path) == ["file"]


def test_the_folder_one_is_in_is_not_replaced(tmp_path, monkeypatch):
    complete_run(tmp_path / "out")
    monkeypatch.chdir(tmp_path / "out")
    with pytest.raises(FolderError, match="and with it the folder you are in"):
        write_run_into(Path(), overwrite=True)
    assert (tmp_path / "out" / "pose.csv").read_text() == "old"


def test_a_folder_with_an_input_in_it_is_not_replaced(tmp_path):
    complete_run(tmp_path / "demo")
    video = tmp_path / "demo" / "walk.mp4"
    video.write_text("the only copy")
    with pytest.raises(FolderError, match=r"demo would be replaced, and with it .*walk\.mp4"):
        write_run_into(tmp_path / "demo", overwrite=True, inputs=[video])
    assert video.read_text() == "the only copy"


def test_a_disk_that_is_mounted_is_not_renamed():
    with pytest.raises(FolderError, match="where a disk is mounted"):
        write_run_into(Path("/"), overwrite=True)


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="no links here")
def test_a_link_still_leads_to_the_run_after_it_was_replaced(tmp_path):
    complete_run(tmp_path / "far" / "run")
    (tmp_path / "link").symlink_to(tmp_path / "far" / "run")
    write_run_into(tmp_path / "link", overwrite=True)
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "far" / "run" / "pose.csv").read_text() == "new"


def test_of_two_runs_at_once_the_second_to_finish_is_refused_and_the_first_stays_whole(tmp_path):
    out = tmp_path / "out"
    with pytest.raises(FolderError, match="complete run"):
        write_run_into(out, text="slow", meanwhile=lambda: write_run_into(out, text="quick"))
    assert (out / "pose.csv").read_text() == "quick"
    assert names(tmp_path) == ["out"]


def test_of_two_that_overwrite_at_once_the_last_to_finish_stays_whole(tmp_path):
    out = tmp_path / "out"
    complete_run(out)
    quick = partial(write_run_into, out, overwrite=True, text="quick")
    write_run_into(out, overwrite=True, text="slow", meanwhile=quick)
    assert (out / "pose.csv").read_text() == "slow"
    assert names(tmp_path) == ["out"]


def test_a_file_has_its_name_only_when_it_is_complete(tmp_path):
    out = tmp_path / "models" / "gait.npz"
    with fresh_file(out, overwrite=False) as aside:
        aside.write_text("new")
        assert not out.exists()
    assert out.read_text() == "new"
    assert names(tmp_path / "models") == ["gait.npz"]


def test_a_file_is_kept_unless_overwrite_says_otherwise(tmp_path):
    out = tmp_path / "gait.npz"
    out.write_text("old")
    with pytest.raises(FolderError, match=r"gait\.npz exists; .*--overwrite"):
        write_file_into(out)
    with pytest.raises(KeyboardInterrupt):
        write_file_into(out, overwrite=True, failure=KeyboardInterrupt)
    assert out.read_text() == "old"
    write_file_into(out, overwrite=True)
    assert out.read_text() == "new"
    assert names(tmp_path) == ["gait.npz"]


def test_a_file_replaces_neither_what_the_work_reads_nor_what_is_no_file(tmp_path):
    read, pipe = tmp_path / "poses.csv", tmp_path / "pipe"
    read.write_text("mine")
    (tmp_path / "link").symlink_to(read)
    os.mkfifo(pipe)
    reads = "is what the work reads"
    for out, words in ((read, reads), (tmp_path / "link", reads), (pipe, "no ordinary")):
        with pytest.raises(FolderError, match=words), fresh_file(out, overwrite=True, inputs=[read]):
            pytest.fail("it was about to be replaced")
    assert read.read_text() == "mine"
    assert pipe.is_fifo()


def test_ctrl_c_at_the_very_moment_when_the_folder_aside_is_made_leaves_nothing(tmp_path, monkeypatch):
    make = Path.mkdir

    def interrupted(path, *how, **more):
        make(path, *how, **more)
        if path.suffix == ".part":
            raise KeyboardInterrupt

    monkeypatch.setattr(Path, "mkdir", interrupted)
    with pytest.raises(KeyboardInterrupt), fresh_folder(tmp_path / "a" / "run", overwrite=False):
        pytest.fail("it went on")
    assert names(tmp_path) == []


def test_ctrl_c_while_the_folder_aside_is_removed_leaves_nothing_but_the_result(tmp_path, monkeypatch):
    remove = shutil.rmtree

    def interrupted(path, **how):
        monkeypatch.setattr(shutil, "rmtree", remove)
        remove(path / "new", **how)
        raise KeyboardInterrupt

    monkeypatch.setattr(shutil, "rmtree", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_file_into(tmp_path / "gait.npz")
    assert names(tmp_path) == ["gait.npz"]


def stop_between_the_renames(place):
    """What a process leaves that is killed when the old run is aside and the new one not in place."""
    workshop = Path(tempfile.mkdtemp(prefix=f".{place.name}.", suffix=".part", dir=place.parent))
    (workshop / "new").mkdir()
    place.rename(workshop / "old")


def test_what_killed_processes_leave_is_swept_up_and_what_they_put_aside_comes_back(tmp_path):
    out = tmp_path / "out [a] *"
    complete_run(out)
    before = everything(tmp_path)
    with swept([out]):
        stop_between_the_renames(out)
        assert not out.exists()
    assert everything(tmp_path) == before
    assert names(tmp_path) == [out.name]


@pytest.mark.parametrize("write", [write_run_into, write_file_into])
def test_what_was_killed_is_swept_up_by_the_next_that_writes_there(tmp_path, write):
    left = tmp_path / ".out.deadbeef.part"
    (left / "new").mkdir(parents=True)
    (left / "new" / "half").write_text("half")
    write(tmp_path / "out")
    assert names(tmp_path) == ["out"]


def test_the_run_that_a_killed_one_was_replacing_is_there_for_the_next(tmp_path):
    out = tmp_path / "out"
    complete_run(out)
    stop_between_the_renames(out)
    with pytest.raises(FolderError, match="holds a complete run"):
        write_run_into(out)
    assert (out / "pose.csv").read_text() == "old"
    assert names(tmp_path) == ["out"]


def test_what_others_make_is_not_swept_up(tmp_path):
    others = [".out.b.during00.part", "out.txt", ".out.short.part"]
    for other in others:
        (tmp_path / other).mkdir()
    with swept([tmp_path / "out"]):
        pass
    assert names(tmp_path) == sorted(others)


def test_a_folder_aside_that_is_swept_before_it_is_locked_is_made_again(tmp_path, monkeypatch):
    make, taken = Path.mkdir, []

    def swept_at_once(path, *how, **more):
        make(path, *how, **more)
        if path.suffix == ".part" and not taken:
            taken.append(path)
            path.rmdir()

    monkeypatch.setattr(Path, "mkdir", swept_at_once)
    write_run_into(tmp_path / "out")
    assert taken
    assert names(tmp_path) == ["out"]


def test_a_folder_that_may_be_replaced_is_told_by_the_caller(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine.json").write_text("old")
    for ours, overwrite in ((lambda path: False, True), (lambda path: True, False)):
        with pytest.raises(FolderError), fresh_folder(out, overwrite=overwrite, replaceable=ours) as aside:
            (aside / "new").write_text("")
    assert names(out) == ["mine.json"]
    with fresh_folder(out, overwrite=True, replaceable=lambda path: True) as aside:
        (aside / "new").write_text("")
    assert names(out) == ["new"]


@pytest.mark.skipif(os.name == "nt", reason="there are no modes there")
def test_what_is_replaced_stays_as_private_as_it_was(tmp_path):
    table, run = tmp_path / "marks.csv", tmp_path / "run"
    table.write_text("old")
    table.chmod(0o600)
    run.mkdir(0o700)
    with fresh_file(table, overwrite=True) as aside:
        aside.write_text("new")
    with fresh_folder(run, overwrite=True) as aside:
        (aside / "run.json").write_text("{}")
    assert [path.stat().st_mode & 0o777 for path in (table, run)] == [0o600, 0o700]
    assert (table.read_text(), (run / "run.json").read_text()) == ("new", "{}")
