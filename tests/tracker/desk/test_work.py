"""Commands at work on a film: the words they are typed with, how they are stopped, and how they end."""

import os
import signal
import sys
import time

import pytest

from tests.tracker.desk.desks import state
from tracker.desk.work import Asked, Work, films, words_for


@pytest.mark.parametrize(
    ("asked", "typed"),
    [
        (Asked(film="", command="find"), "find a.mp4 --out a-people.csv --overwrite"),
        (Asked(film="", command="track"), "track a.mp4 --out a-track --overwrite"),
        (
            Asked(film="", command="track", person=2, near="ahead", height=1.7),
            "track a.mp4 --out a-track --overwrite --person 2 --near ahead --height 1.7",
        ),
        (
            Asked(film="", command="track", person=2, near="ahead", facing="left", marked=True),
            "track a.mp4 --out a-track --overwrite --keypoints a.keypoints.csv --facing left",
        ),
        (Asked(film="", command="annotate"), "annotate a.mp4 --out a.keypoints.csv --no-browser"),
        (
            Asked(film="", command="annotate", facing="right", person=2),
            "annotate a.mp4 --out a.keypoints.csv --facing right --no-browser",
        ),
        (Asked(film="", command="correct"), "correct a-track --no-browser"),
        (Asked(film="", command="export", to="mot"), "export a-track --to mot --overwrite"),
    ],
)
def test_what_is_done_is_what_would_be_typed(tmp_path, asked, typed):
    (tmp_path / "a.mp4").touch()
    (tmp_path / "-b.mp4").touch()
    there = films(tmp_path)
    assert " ".join(words_for(asked, there["a.mp4"], browser=False)) == f"{typed} --progress json"
    assert "--no-browser" not in words_for(asked, there["a.mp4"], browser=True)
    dashed = words_for(asked, there["-b.mp4"], browser=False)
    assert not any(word.startswith("-b") for word in dashed)


def test_every_marked_frame_is_passed_through(tmp_path):
    (tmp_path / "a.mp4").touch()
    film, asked = films(tmp_path)["a.mp4"], Asked(film="", command="track", marked=True)
    for rows, anchors in (("0,hip,1,1\n", False), ("0,hip,1,1\n9,hip,2,1\n", True), ("no table", False)):
        (tmp_path / "a.keypoints.csv").write_text(f"frame,keypoint,x,y\n{rows}")
        assert ("--anchors" in words_for(asked, film, browser=False)) == anchors


def test_a_film_has_one_command_at_work_which_can_be_stopped(client, folder):
    assert client.post("start", {"film": "walk.mp4", "command": "annotate"})[0] == 200
    status, told = client.post("start", {"film": "walk.mp4", "command": "find"})
    assert (status, told["error"]) == (
        409, "'annotate' is still at work on walk.mp4; stop it first",
    )  # fmt: skip
    assert client.post("stop", {"film": "walk.mp4"})[0] == 200
    work = state(client)["films"][0]["work"]
    assert work["status"] != 0
    assert work["status"] is not None
    assert not (folder / "walk.keypoints.csv").exists()


def test_why_a_command_failed_is_shown(client, folder):
    (folder / "walk.mp4").write_bytes(b"no film")
    client.post("start", {"film": "walk.mp4", "command": "find"})
    while (work := state(client)["films"][0]["work"])["status"] is None:
        time.sleep(0.05)
    assert work["status"] == 1
    assert work["said"][-1].startswith("error: ")


@pytest.fixture
def scripted(tmp_path, monkeypatch):
    """A command that does what a shell script says, in place of figtrack's."""

    def started(script):
        shell = tmp_path / "figtrack.sh"
        shell.write_text(f"#!/bin/sh\n{script}\n")
        shell.chmod(0o700)
        monkeypatch.setattr(sys, "executable", str(shell))
        return Work(["find"], tmp_path)

    return started


def ended_soon(work):
    """What is told of a command once it has ended."""
    end = time.monotonic() + 20.0
    while (told := work.told())["status"] is None and time.monotonic() < end:
        time.sleep(0.02)
    return told


def test_a_command_that_the_system_ended_says_so(scripted):
    told = ended_soon(scripted("kill -9 $$"))
    assert told["said"] == ["error: the system ended the command, perhaps for lack of memory"]
    stopped = scripted("echo begun; exec sleep 60")
    stopped.stop()
    assert not any(line.startswith("error") for line in stopped.told()["said"])


def test_a_command_knows_that_the_app_runs_it(scripted):
    assert ended_soon(scripted("echo $FIGTRACK_APP"))["said"] == ["1"]


def test_a_line_that_is_json_but_no_news_is_said(scripted):
    assert ended_soon(scripted("echo 42 >&2; echo null >&2; echo error: so >&2"))["said"] == [
        "42", "null", "error: so",
    ]  # fmt: skip


def test_a_command_has_ended_though_a_browser_that_it_started_goes_on(scripted, tmp_path):
    work = scripted("echo done; sleep 30 & echo $! > browser")
    try:
        began = time.monotonic()
        assert ended_soon(work) == {"command": "find", "task": None, "said": ["done"], "status": 0}
        assert time.monotonic() - began < 15.0
    finally:
        os.kill(int((tmp_path / "browser").read_text()), signal.SIGKILL)
