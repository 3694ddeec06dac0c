"""How a clip is followed, as it is asked for: spelt once, read by command line, table of clips and API."""

from dataclasses import fields
from pathlib import Path

import pytest

from tests.tracker.clips import QUIET, figtrack, write_table
from tracker.batch.jobs import COLUMNS, read_jobs
from tracker.clip.job import Facing, Following, Job, Nearer, Options, options
from tracker.settings import Settings
from tracker.tables.keypoints import read_keypoints

# Of each option another value than the default, and the cell that says so.
OTHERS = {
    "start": (3, "3"),
    "from_": (2, "2"),
    "stop": (7, "7"),
    "model": ("cv", "cv"),
    "facing": (Facing.LEFT, "left"),
    "person": (2, "2"),
    "near": (Nearer.BEHIND, "behind"),
    "anchors": (True, "1"),
    "measure": (Path("net.csv"), "net.csv"),
    "templates": (False, "0"),
    "rate": (0.5, "0.5"),
    "height": (1.75, "1.75"),
    "scale": (55.0, "55"),
    "smooth": (False, "0"),
    "settings": (Path("s.toml"), "s.toml"),
    "figure": ("horse", "horse"),
}


def test_command_line_and_table_have_every_option_with_its_words_and_range():
    names = {option.name for option in options()}
    assert names == OTHERS.keys() == {field.name for field in fields(Following)}
    assert {option.shown for option in options()} | {"video", "keypoints", "out"} == set(COLUMNS)
    shown = "".join(figtrack("track", "--help").stdout.split())  # lines end anywhere
    for option in options():
        least, most = option.about.least, option.about.most
        bounds = "" if least is None else f"[{least}<=x<={most}]" if most else f"[x>={least}]"
        assert "".join(option.about.text.split()) + bounds in shown, option


def test_a_job_keeps_what_the_marks_and_settings_that_were_read_do_not_hold():
    kept = {field.name for field in fields(Options)}
    assert OTHERS.keys() - kept == {"facing", "person", "near", "templates", "settings"}
    own = {"video", "marks", "settings", "facing", "called", "found"}
    assert {field.name for field in fields(Job)} == kept | own
    asked = Following(**{name: OTHERS[name][0] for name in kept - {"scale"}})
    assert asked.job(Path("a.mp4"), {}, Settings()).kept() == asked.kept()


@pytest.mark.parametrize("name", OTHERS)
def test_a_cell_of_the_table_asks_for_the_same_as_the_keyword(tmp_path, name):
    value, cell = OTHERS[name]
    write_table(tmp_path / "jobs.csv", [("a.mp4", "k.csv", cell)], ("video", "keypoints", name.rstrip("_")))
    (row,) = read_jobs(tmp_path / "jobs.csv", tmp_path, QUIET)
    wanted = tmp_path / value if isinstance(value, Path) else value
    assert row.how == Following(**{name: wanted}) != Following()


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"start": -1}, "start must be at least 0; got -1"),
        ({"from_": -1}, "from must be at least 0; got -1"),
        ({"stop": 10**10}, "stop must be at most 1000000000; got 10000000000"),
        ({"rate": 0.2}, "rate must be at least 0.25; got 0.2"),
        ({"rate": float("nan")}, "rate must be at least 0.25; got nan"),
        ({"rate": 5}, "rate must be at most 4; got 5"),
        ({"height": 3.5}, "height must be at most 3; got 3.5"),
        ({"height": 1.75, "scale": 80.0}, "give either height or scale, not both"),
        ({"from_": 9, "stop": 2}, "from 9 comes after stop 2"),
        ({"facing": "north"}, "facing must be 'left', 'right' or None; got 'north'"),
    ],
)
def test_what_is_out_of_range_is_refused(asked, said):
    with pytest.raises(ValueError, match=said):
        Following(**asked)


def test_words_and_names_of_files_become_what_they_stand_for():
    asked = Following(facing="right", measure="net.csv", model=Path("mine.npz"))
    assert (asked.facing, asked.measure, asked.model) == (Facing.RIGHT, Path("net.csv"), "mine.npz")


def test_a_job_has_the_settings_of_the_file_or_those_given_and_templates_are_one_of_them(clip, tmp_path):
    (tmp_path / "s.toml").write_text("iterations = 3\n")
    asked = Following(settings=tmp_path / "s.toml", facing="left", start=2)
    marks = read_keypoints(clip.keypoints)
    job = asked.job(clip.video, marks)
    assert (job.settings, job.facing, job.start) == (Settings(iterations=3), -1, 2)
    given = Following(templates=False).job(clip.video, marks, Settings(iterations=4))
    assert given.settings == Settings(iterations=4, templates=False)
    assert Following().job(clip.video, marks) == Job(clip.video, marks)


def test_the_files_that_are_read_are_told_and_a_shipped_model_is_none(tmp_path):
    (tmp_path / "m.npz").write_bytes(b"")
    asked = Following(model=tmp_path / "m.npz", measure="net.csv", settings="s.toml")
    assert set(asked.inputs) == {None, tmp_path / "m.npz", Path("net.csv"), Path("s.toml")}
    (tmp_path / "cow.toml").write_text("")
    assert tmp_path / "cow.toml" in Following(figure=tmp_path / "cow.toml").inputs
    assert not any(Following().inputs)
