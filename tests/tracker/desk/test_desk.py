"""The page of a folder of films: what it shows, what it lets be done, and whom it refuses."""

import json
import os
import re
import shutil
import signal
import sys
import threading
import time
from contextlib import contextmanager

import cv2
import numpy as np
import pytest

from tests.tracker.annotate.test_server import Client
from tests.tracker.clips import write_video
from tests.tracker.outline.films import a_walk
from tests.tracker.processes import ended, started
from tests.tracker.report.reports import chapter, write_clip
from tests.tracker.strolls import stroll
from tracker.desk import desk_page as module
from tracker.desk.desk_page import Desk, Server
from tracker.desk.work import Asked, Command, Work, films, words_for
from tracker.report import page
from tracker.report.page import write_report

FIRST = 5  # the film begins within a stride
CLIP = bytes(range(256)) * 40


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """A film of who walks to the right; not to be written to."""
    path = tmp_path_factory.mktemp("film") / "walk.mp4"
    write_video(path, a_walk().images[FIRST:])
    return path


@pytest.fixture
def folder(walk, tmp_path):
    """A folder with that film in it and something else."""
    place = tmp_path / "films"
    place.mkdir()
    shutil.copy(walk, place)
    (place / "notes.txt").write_text("not a film")
    return place


class DeskClient(Client):
    def shown(self, file, **headers):
        """Status, headers and body of a file of the film's run."""
        return self.ask("GET", f"run/walk.mp4/{file}", key=self.server.shown, **headers)


@contextmanager
def served(folder):
    """A client of a desk that runs."""
    with Server(Desk(folder, browser=False)) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield DeskClient(server)
        server.shutdown()
        server.desk.stop()


def a_run(folder, **news):
    """A run's folder as far as the desk reads it."""
    run = folder / "walk-track"
    run.mkdir()
    told = {"figtrack": "0", "video": "walk.mp4", "fps": 25, "frames": 27, "facing": "right"}
    (run / "run.json").write_text(json.dumps(told | news))
    (run / "report.html").write_text("<p>a report")
    (run / "film.mp4").write_bytes(CLIP)
    return run


def state(client):
    return client.get("state")[1]


@pytest.mark.parametrize(
    ("asked", "typed"),
    [
        (Asked(film="", command=Command.FIND), "find a.mp4 --out a-people.csv --overwrite"),
        (Asked(film="", command=Command.TRACK), "track a.mp4 --out a-track --overwrite"),
        (
            Asked(film="", command=Command.TRACK, person=2, near="ahead", height=1.7),
            "track a.mp4 --out a-track --overwrite --person 2 --near ahead --height 1.7",
        ),
        (
            Asked(film="", command=Command.TRACK, person=2, near="ahead", facing="left", marked=True),
            "track a.mp4 --out a-track --overwrite --keypoints a.keypoints.csv --facing left",
        ),
        (Asked(film="", command=Command.ANNOTATE), "annotate a.mp4 --out a.keypoints.csv --no-browser"),
        (Asked(film="", command=Command.CORRECT), "correct a-track --no-browser"),
        (Asked(film="", command=Command.EXPORT, to="mot"), "export a-track --to mot --overwrite"),
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
    film, asked = films(tmp_path)["a.mp4"], Asked(film="", command=Command.TRACK, marked=True)
    for rows, anchors in (("0,hip,1,1\n", False), ("0,hip,1,1\n9,hip,2,1\n", True), ("no table", False)):
        (tmp_path / "a.keypoints.csv").write_text(f"frame,keypoint,x,y\n{rows}")
        assert ("--anchors" in words_for(asked, film, browser=False)) == anchors


def test_a_film_is_shown_with_what_was_made_of_it(folder):
    with served(folder) as client:
        (bare,) = state(client)["films"]
        assert bare == {"name": "walk.mp4", "marked": False, "people": None, "run": None, "work": None}
        (folder / "walk.keypoints.csv").touch()
        (folder / "walk-people.csv").write_text("person,facing,score\n1,left,3\n")
        a_run(folder, headline="Walks.", warnings=["dark"])
        (film,) = state(client)["films"]
    assert film["marked"]
    assert [(one["person"], one["facing"], one["motion"]) for one in film["people"]] == [("1", "left", "")]
    assert film["run"] == {"headline": "Walks.", "warnings": ["dark"], "report": True}


def test_a_damaged_table_of_people_does_not_stop_the_page(folder):
    (folder / "walk-people.csv").write_bytes(b"person,facing\n1,l\0ft\n")
    with served(folder) as client:
        (film,) = state(client)["films"]
    assert film["people"] is None


def test_a_run_of_another_film_is_not_shown_and_not_replaced(folder):
    a_run(folder, video="walk.mov")
    (folder / "\udce4.mp4").write_bytes(b"")
    with served(folder) as client:
        (film,) = state(client)["films"]
    assert film["run"] is None
    words = words_for(Asked(film="walk.mp4", command=Command.TRACK), films(folder)["walk.mp4"], False)
    assert "--overwrite" not in words


def test_a_run_that_cannot_be_read_does_not_stop_the_page(folder):
    (folder / "walk-track" / "run.json").mkdir(parents=True)
    with served(folder) as client:
        status, told = client.get("state")
    assert (status, told["films"][0]["run"]) == (200, None)


def test_films_whose_results_would_have_the_same_names_are_refused(folder):
    shutil.copy(folder / "walk.mp4", folder / "walk.mov")
    with served(folder) as client:
        for name in ("walk.mov", "walk.mp4"):
            status, told = client.post("start", {"film": name, "command": "annotate"})
            assert (status, told["error"]) == (
                409, "walk.mov and walk.mp4 have the same out, walk-track; rename one of them",
            )  # fmt: skip
        assert [film["work"] for film in state(client)["films"]] == [None, None]


def test_its_picture_report_and_parts_of_its_film_are_shown(folder):
    a_run(folder)
    with served(folder) as client:
        status, headers, picture = client.ask("GET", "picture/walk.mp4")
        assert (status, headers["Content-Type"], picture[:2]) == (200, "image/jpeg", b"\xff\xd8")
        _, headers, page = client.shown("report.html")
        assert page == b"<p>a report"
        assert headers["Content-Security-Policy"].startswith("sandbox allow-scripts")
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert "allow-same-origin" not in headers["Content-Security-Policy"]


def test_the_key_of_what_a_run_shows_opens_nothing_else(folder):
    a_run(folder)
    with served(folder) as client:
        shown = client.server.shown
        assert client.ask("GET", "run/walk.mp4/report.html")[0] == 403
        for what in ("", "state", "picture/walk.mp4"):
            assert client.ask("GET", what, key=shown)[0] == 403
        assert client.post("start", {"film": "walk.mp4", "command": "find"}, key=shown)[0] == 403
        assert shown not in json.dumps(state(client))


@pytest.mark.parametrize(
    ("asked", "part"),
    [
        ("bytes=10-19", slice(10, 20)),
        ("bytes=10000-", slice(10000, None)),
        ("bytes=-30", slice(-30, None)),
        ("bytes=-99999", slice(0, None)),
        ("bytes=10-99999", slice(10, None)),
        ("bytes=0-1,5-6", None),  # several parts at once
        (None, None),
    ],
)
def test_a_player_gets_the_part_of_a_film_that_it_requests(folder, asked, part):
    a_run(folder)
    with served(folder) as client:
        status, headers, content = client.shown("film.mp4", Range=asked)
    assert (status, content) == (200 if part is None else 206, CLIP[part or slice(None)])
    if part is not None:
        first, last, size = map(int, re.findall(r"\d+", headers["Content-Range"]))
        assert (first, last + 1, size) == (*part.indices(size)[:2], len(CLIP))


@pytest.mark.parametrize("asked", [f"bytes={len(CLIP)}-", "bytes=2-0", "bytes=100-50", "bytes=-0"])
def test_a_part_that_a_film_has_not_is_refused(folder, asked):
    a_run(folder)
    with served(folder) as client:
        assert client.shown("film.mp4", Range=asked)[0] == 416


@pytest.mark.parametrize("largest", [10**9, 100], ids=["within", "beside"])
def test_the_film_of_a_report_plays(browser, folder, monkeypatch, largest):
    monkeypatch.setattr(page, "LARGEST", largest)
    run, track = a_run(folder), stroll(1.0)
    write_report(run / "report.html", chapter(track), write_clip(run / "film.mp4", track.times))
    with served(folder) as client:
        browser.open(f"http://{client.host}/{client.server.shown}/run/walk.mp4/report.html")
        browser.wait("document.querySelector('video').readyState >= 2")
        browser.press(" ")
        browser.wait("document.querySelector('.screen svg').dataset.frame > 10")
        browser.open("about:blank")


def test_a_long_clip_is_sent_in_parts(folder, monkeypatch):
    monkeypatch.setattr(module, "MOST_SENT", 100)
    a_run(folder)
    with served(folder) as client:
        _, headers, content = client.shown("film.mp4", Range="bytes=50-")
        assert client.shown("film.mp4")[2] == CLIP
    assert (content, headers["Content-Range"]) == (CLIP[50:150], f"bytes 50-149/{len(CLIP)}")


@pytest.mark.parametrize(
    "what",
    [
        "picture/notes.txt",
        "picture/..%2Fwalk.mp4",
        "run/walk.mp4/run.json",
        "run/walk.mp4/..%2Fnotes.txt",
        "run/walk.mp4/report.html",
        "people/walk.mp4",
        "elsewhere",
    ],
)
def test_nothing_else_is_shown(folder, what):
    with served(folder) as client:
        assert client.ask("GET", what, key=client.server.key_of(what))[0] == 404


@pytest.mark.parametrize(
    ("body", "status", "why"),
    [
        ({"film": "other.mp4", "command": "find"}, 404, "there is no film 'other.mp4'"),
        ({"film": "walk.mp4", "command": "correct"}, 409, "walk.mp4 was not followed yet"),
        ({"film": "walk.mp4", "command": "export", "to": "trc"}, 409, "walk.mp4 was not followed yet"),
        ({"film": "walk.mp4", "command": "settings"}, 400, "command"),
        ({"film": "walk.mp4", "command": "export", "to": "../x"}, 400, "to"),
        ({"film": "walk.mp4", "command": "track", "height": 20}, 400, "height"),
        ({"film": "walk.mp4", "command": "track", "person": 0}, 400, "person"),
    ],
)
def test_what_cannot_be_done_is_refused_and_starts_nothing(folder, body, status, why):
    with served(folder) as client:
        answer, told = client.post("start", body)
        assert (answer, why in told["error"]) == (status, True)
        assert state(client)["films"][0]["work"] is None
        assert client.ask("POST", "start", body, Origin="http://elsewhere")[0] == 403


def test_a_film_has_one_command_at_work_which_can_be_stopped(folder):
    with served(folder) as client:
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


def test_why_a_command_failed_is_shown(folder):
    (folder / "walk.mp4").write_bytes(b"no film")
    with served(folder) as client:
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


def test_a_folder_that_is_none_is_refused_in_one_line(tmp_path):
    assert ended("app", tmp_path / "none", "--no-browser") == (
        1, "", f"error: {tmp_path / 'none'} is no folder; give one with films in it\n",
    )  # fmt: skip


@pytest.mark.whole
def test_a_film_goes_all_the_way_on_the_page(browser, folder):
    process = started("app", folder, "--no-browser")
    try:
        address = next(found[0] for line in process.stdout if (found := re.search(r"http://\S+", line)))
        browser.open(address)
        browser.push("[data-command=find]")
        browser.wait("document.querySelector('.said').innerText.includes('person 1')")
        browser.wait("document.querySelector('.found').naturalWidth > 100")
        browser.value("document.querySelector('.person').value = '1'")
        browser.push("[data-command=track]")
        browser.wait("document.querySelector('.said').innerText.includes('27 frames of walk.mp4')")
        assert (folder / "walk-track" / "report.html").exists()
        browser.value("document.querySelector('.to').value = 'mot'")
        browser.push("[data-command=export]")
        browser.wait("document.querySelector('.said').innerText.includes('wrote')")
        assert (folder / "walk-track.mot").exists()
        browser.push("[data-command=correct]")
        browser.wait("document.querySelector('.task a')")
        link = browser.value("document.querySelector('.task a').href")
        browser.open(link)
        browser.wait("document.querySelector('#points circle')")
        browser.open(browser.value(f"{json.dumps(address)}"))
        browser.push(".stop")
        browser.wait("document.querySelector('.work .row').hidden")
        browser.wait("document.querySelector('.report').href.includes('/run/')")
        browser.open(browser.value("document.querySelector('.report').href"))
        browser.wait("document.querySelector('.plots svg')")
        browser.open("about:blank")
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize(("width", "dark"), [(390, False), (1280, True), (1920, False)])
def test_nothing_sticks_out_of_the_page(browser, folder, width, dark):
    a_run(folder, headline="Walks at 99 steps a minute.", warnings=["a warning " * 30])
    found = "person,first,last,facing,motion\n1,0,123,left,walk backwards\n"
    (folder / "walk-people.csv").write_text(found)
    cv2.imwrite(str(folder / "walk-people.png"), np.zeros((90, 160, 3), np.uint8))
    with served(folder) as client:
        browser.open(client.server.address, width=width, dark=dark)
        browser.wait("document.querySelector('.film img').complete")
        wide = "document.documentElement.scrollWidth <= window.innerWidth"
        assert browser.value(wide)
        right = "one.getBoundingClientRect().right"
        assert max(browser.each(".film *", right)) < max(browser.each(".film", right))
        assert browser.value("[...document.querySelectorAll('button, select, input')].every((one) => "
                             "one.innerText || one.labels.length || one.ariaLabel)")  # fmt: skip
        browser.open("about:blank")


def test_marks_that_appear_are_what_is_followed_from_and_then_no_nearer_leg_is_asked_for(browser, folder):
    with served(folder) as client:
        browser.open(client.server.address)
        assert browser.value("document.querySelector('.person').value") == ""
        (folder / "walk.keypoints.csv").write_text("frame,keypoint,x,y\n0,hip,1,1\n")
        browser.wait("document.querySelector('.person').value === 'marks'")
        browser.wait("document.querySelector('.near').disabled")
        browser.value("document.querySelector('.person').value = ''")
        browser.wait("!document.querySelector('.near').disabled")
        browser.open("about:blank")


def test_what_is_said_is_replaced_only_where_it_differs(browser, folder):
    a_run(folder, headline="Walks.", warnings=["dark"])
    (folder / "walk.mp4").write_bytes(b"no film")
    with served(folder) as client:
        browser.open(client.server.address)
        browser.push("[data-command=find]")
        browser.wait("document.querySelector('.said p.fault')")
        browser.value("window.kept = ['.said p', '.warnings li'].map((one) => document.querySelector(one));"
                      "window.kept.push(document.querySelector('.headline').firstChild); 0")  # fmt: skip
        (folder / "other.mp4").write_bytes(b"no film")
        browser.wait("document.querySelectorAll('.film').length === 2")
        assert browser.value("window.kept.every((one) => one.isConnected)")
        browser.open("about:blank")
        browser.errors.clear()  # there are no pictures of what is no film


def test_a_height_that_is_no_number_starts_nothing(browser, folder):
    with served(folder) as client:
        browser.open(client.server.address)
        browser.value("document.querySelector('.height').focus()")
        browser.press("-")
        browser.push("[data-command=track]")
        browser.wait("document.querySelector('.asks').innerText.startsWith('The height is no number')")
        assert state(client)["films"][0]["work"] is None
        browser.open("about:blank")


def test_the_program_has_ended_only_where_it_does_not_answer(browser, folder, monkeypatch):
    with served(folder) as client:
        browser.open(client.server.address)
        with monkeypatch.context() as broken:
            broken.setattr(client.server.desk, "told", lambda: (folder / "none").read_bytes())
            browser.wait("document.querySelector('#wrong').innerText.includes('No such file')")
        browser.wait("document.querySelector('#wrong').hidden")
        browser.value("window.fetch = () => Promise.reject(new TypeError()); 0")
        browser.wait("document.querySelector('#wrong').innerText.startsWith('figtrack app has ended')")
        browser.open("about:blank")
        browser.errors.clear()


@pytest.mark.whole
def test_a_page_that_is_open_is_linked_though_somebody_was_searched_before_it(browser, folder):
    with served(folder) as client:
        browser.open(client.server.address)
        browser.push("[data-command=annotate]")
        browser.wait("document.querySelector('.task a')")
        browser.push(".stop")
        browser.wait("document.querySelector('.said .fault')")
        assert "http" not in browser.text(".said")
        assert "Ctrl-C" not in browser.text(".said")
        browser.open("about:blank")
