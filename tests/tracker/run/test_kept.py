"""What lies beside the results in a folder is there still when they are replaced."""

import os
import shutil
from pathlib import Path

import pytest

from tests.tracker.clips import everything
from tests.tracker.run.folders import complete_run, names, write_run_into
from tracker.run.folder import FolderError, fresh_folder, swept


@pytest.fixture
def mixed(tmp_path):
    """A run with an overlay, and beside its results notes, an export, a run and a link."""
    complete_run(tmp_path / "out")
    complete_run(tmp_path / "out" / "first" / "try")
    for name in ("overlay.mp4", "notes.txt", "a.mot"):
        (tmp_path / "out" / name).write_text(name)
    (tmp_path / "out" / "link").symlink_to("nowhere")
    return tmp_path / "out"


def beside(folder):
    """The contents of what is no result in that folder."""
    results = {"run.json", "pose.csv", "overlay.mp4"}
    return {path: data for path, data in everything(folder).items() if str(path) not in results}


@pytest.mark.parametrize("links", [True, False])
def test_what_lies_beside_the_results_is_kept_and_results_that_are_not_written_again_are_not(
    mixed, monkeypatch, links
):
    def refuses(*_):
        raise PermissionError

    if not links:
        monkeypatch.setattr(os, "link", refuses)
    before = beside(mixed)
    write_run_into(mixed, overwrite=True)
    assert beside(mixed) == before
    assert names(mixed) == ["a.mot", "first", "link", "notes.txt", "pose.csv", "run.json"]
    assert (mixed / "pose.csv").read_text() == "new"


@pytest.mark.parametrize("after", [0, 1])
def test_a_replacement_that_is_killed_between_its_steps_loses_nothing(mixed, monkeypatch, after):
    before, rename, renames = beside(mixed), Path.rename, []

    def killed(self, target):
        renames.append(target)
        if len(renames) > after:
            raise KeyboardInterrupt
        return rename(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "rename", killed)
        patch.setattr(shutil, "rmtree", lambda *_, **how: None)
        with pytest.raises(KeyboardInterrupt):
            write_run_into(mixed, overwrite=True)
    with swept([mixed]):
        pass
    assert beside(mixed) == before
    assert names(mixed.parent) == ["out"]


def test_what_cannot_be_kept_beside_the_new_results_leaves_the_old_ones(mixed):
    before = everything(mixed)
    with (
        pytest.raises(FolderError, match=r"notes\.txt cannot be kept beside the new results .*move it away"),
        fresh_folder(mixed, overwrite=True) as aside,
    ):
        (aside / "notes.txt").write_text("another")
    assert everything(mixed) == before


def test_of_a_comparison_the_runs_of_its_models_are_results_and_other_runs_are_not(tmp_path):
    out = tmp_path / "out"
    for name in ("cv", "gait", "mine"):
        complete_run(out / name)
    (out / "compare.json").write_text('{"models": {"cv": 1, "gait": 2, "gone": 3}}')
    (out / "gait" / "notes.txt").write_text("")
    write_run_into(out, overwrite=True)
    assert names(out) == ["gait", "mine", "pose.csv", "run.json"]
    assert (names(out / "gait"), names(out / "mine")) == (["notes.txt"], ["pose.csv", "run.json"])
