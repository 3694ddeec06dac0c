"""The annotate command: what it opens, what it prints, how it ends, and what it refuses in one line."""

import signal
import socket
import stat
import webbrowser
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote

import pytest

from tests.tracker import people
from tests.tracker.annotate.clients import running
from tests.tracker.annotate.marked import told
from tests.tracker.clips import figtrack
from tests.tracker.people import WALKER
from tracker.annotate import loopback as module
from tracker.tables.keypoints import Mark, read_keypoints


@pytest.mark.whole
def test_ctrl_c_before_a_save_leaves_nothing_and_says_so(clip, tmp_path):
    with running(clip.video, "--out", tmp_path / "k.csv", "--empty") as (process, _):
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
        assert (process.returncode, errors) == (1, "error: interrupted; nothing was written\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.whole
def test_ctrl_c_after_a_save_keeps_it_and_says_what_comes_next(clip, tmp_path):
    table = tmp_path / "k.csv"
    with running(clip.video, "--out", table, "--empty") as (process, client):
        assert client.post("save", {"frames": {"2": told({"hip": Mark(3, 4)})}})[1]["saved"] == str(table)
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=120)
    assert (process.returncode, errors) == (0, "")
    assert out.splitlines()[-3:] == [
        "stopped; what was not saved is gone",
        f"1 frame marked in {table}",
        f"next: figtrack track {clip.video} --keypoints {table}",
    ]


@pytest.mark.whole
def test_unless_told_the_table_is_called_after_the_video_and_lies_where_one_is(clip, tmp_path):
    with running(clip.video, "--frame", 3, "--empty", cwd=tmp_path) as (process, client):
        assert client.opening()["frame"]["index"] == 3
        frames = {"0": told({"hip": Mark(1, 2)}), "3": told({"hip": Mark(3, 4)})}
        client.post("save", {"frames": frames, "close": True, "anyway": True})
        out, _ = process.communicate(timeout=120)
    assert out.endswith(f"next: figtrack track {clip.video} --keypoints walk.keypoints.csv --anchors\n")
    assert sorted(read_keypoints(tmp_path / "walk.keypoints.csv")) == [0, 3]


@pytest.mark.whole
def test_marks_taken_from_another_program_open_their_frame(clip, tmp_path):
    source = people.dlc(tmp_path / "net.csv", {"4": WALKER})
    more = ("--from", source, "--facing", "left")
    with running(clip.video, "--out", tmp_path / "k.csv", *more) as (_, client):
        opening = client.opening()
    assert opening["frame"]["index"] == opening["taken"]["frame"] == 4
    assert opening["taken"]["marks"]["near_knee"]["x"] == WALKER["left_knee"][0]
    assert "faces left" in opening["taken"]["told"]


def test_the_browser_is_opened_unless_told_not_to_or_it_would_take_the_terminal(monkeypatch):
    opened = []
    monkeypatch.setattr(webbrowser, "get", lambda: SimpleNamespace(open=opened.append))
    module.show("http://here/")
    assert opened == ["http://here/"]

    class Text(webbrowser.GenericBrowser):
        def open(self, *_):
            raise AssertionError("a browser in the terminal was opened")

    monkeypatch.setattr(webbrowser, "get", lambda: Text("w3m"))
    module.show("http://here/")

    def none():
        raise webbrowser.Error("could not locate runnable browser")

    monkeypatch.setattr(webbrowser, "get", none)
    module.show("http://here/")


def test_the_browsers_command_line_does_not_tell_the_key(monkeypatch):
    opened = []
    monkeypatch.setattr(module, "show", opened.append)
    with module.LoopbackServer(module.LoopbackHandler, 0, "annotate") as server:
        server.show()
        (address,) = opened
        assert server.key not in address
        door = Path(unquote(address.removeprefix("file://")))
        assert server.address in door.read_text()
        assert [stat.S_IMODE(path.stat().st_mode) for path in (door.parent, door)] == [0o700, 0o600]
    assert not door.parent.exists()


def test_a_port_that_is_taken_is_said_in_one_line(clip, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        result = figtrack("annotate", clip.video, "--out", tmp_path / "k.csv", "--no-browser", "--port", port)
    assert (result.exit_code, result.stdout) == (1, "")
    (line,) = result.stderr.splitlines()
    assert "choose another --port" in line
