"""The server of a folder of films: what it tells of them, which files it shows, and what it refuses."""

import json
import re
import shutil

import pytest

from tests.tracker.desk.desks import CLIP, a_run, shown, state
from tests.tracker.processes import ended
from tracker.desk import desk_page as module
from tracker.desk.work import Asked, films, words_for


def test_a_film_is_shown_with_what_was_made_of_it(client, folder):
    (bare,) = state(client)["films"]
    assert bare == {"name": "walk.mp4", "marked": False, "people": None, "run": None, "work": None}
    (folder / "walk.keypoints.csv").touch()
    (folder / "walk-people.csv").write_text("person,facing,score\n1,left,3\n")
    a_run(folder, headline="Walks.", warnings=["dark"])
    (film,) = state(client)["films"]
    assert film["marked"]
    assert [(one["person"], one["facing"], one["motion"]) for one in film["people"]] == [("1", "left", "")]
    run = {"headline": "Walks.", "warnings": ["dark"], "report": True}
    assert film["run"] == run | {"facing": "right", "height": None, "corrected": 0}


@pytest.mark.parametrize(("marks", "corrected"), [("given", 2), ("found", 1)])
def test_a_run_tells_in_how_many_frames_it_was_corrected_by_hand(client, folder, marks, corrected):
    run = a_run(folder, options={"anchors": True}, start={"frame": 3, "marks": marks})
    beside, row = folder / "walk.keypoints.csv", "{},hip,1,{},1\n".format
    (run / "start.keypoints.csv").write_text("frame,keypoint,x,y,visible\n" + row(3, 1) + row(7, 2))

    def told():
        return state(client)["films"][0]["run"]["corrected"]

    assert told() == corrected
    beside.write_text("frame,keypoint,y,x\n3,hip,1.0,1\n7,hip,2,1\n9,hip,2,1\n")
    assert told() == 0
    beside.write_text("frame,keypoint,y,x\n3,hip,1,1\n7,hip,2,1\n7,neck,2,1\n")
    assert told() == 1
    a_run(folder, options={"anchors": True}, start=3)  # as before version 0.2
    assert told() == 1
    a_run(folder, options={"anchors": False})
    assert told() == 0


def test_a_damaged_table_of_people_does_not_stop_the_page(client, folder):
    (folder / "walk-people.csv").write_bytes(b"person,facing\n1,l\0ft\n")
    (film,) = state(client)["films"]
    assert film["people"] is None


def test_a_run_of_another_film_is_not_shown_and_not_replaced(client, folder):
    a_run(folder, video="walk.mov")
    (folder / "\udce4.mp4").write_bytes(b"")
    (film,) = state(client)["films"]
    assert film["run"] is None
    words = words_for(Asked(film="walk.mp4", command="track"), films(folder)["walk.mp4"], False)
    assert "--overwrite" not in words


def test_a_run_that_cannot_be_read_does_not_stop_the_page(client, folder):
    (folder / "walk-track" / "run.json").mkdir(parents=True)
    status, told = client.get("state")
    assert (status, told["films"][0]["run"]) == (200, None)


def test_films_whose_results_would_have_the_same_names_are_refused(client, folder):
    shutil.copy(folder / "walk.mp4", folder / "walk.mov")
    for name in ("walk.mov", "walk.mp4"):
        status, told = client.post("start", {"film": name, "command": "annotate"})
        assert (status, told["error"]) == (
            409, "walk.mov and walk.mp4 have the same out, walk-track; rename one of them",
        )  # fmt: skip
    assert [film["work"] for film in state(client)["films"]] == [None, None]


def test_its_picture_report_and_parts_of_its_film_are_shown(client, folder):
    a_run(folder)
    status, headers, picture = client.ask("GET", "picture/walk.mp4")
    assert (status, headers["Content-Type"], picture[:2]) == (200, "image/jpeg", b"\xff\xd8")
    _, headers, page = shown(client, "report.html")
    assert page == b"<p>a report"
    assert headers["Content-Security-Policy"].startswith("sandbox allow-scripts")
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "allow-same-origin" not in headers["Content-Security-Policy"]


def test_the_key_of_what_a_run_shows_opens_nothing_else(client, folder):
    a_run(folder)
    key = client.server.shown
    assert client.ask("GET", "run/walk.mp4/report.html")[0] == 403
    for what in ("", "state", "picture/walk.mp4"):
        assert client.ask("GET", what, key=key)[0] == 403
    assert client.post("start", {"film": "walk.mp4", "command": "find"}, key=key)[0] == 403
    assert key not in json.dumps(state(client))


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
def test_a_player_gets_the_part_of_a_film_that_it_requests(client, folder, asked, part):
    a_run(folder)
    status, headers, content = shown(client, "film.mp4", Range=asked)
    assert (status, content) == (200 if part is None else 206, CLIP[part or slice(None)])
    if part is not None:
        first, last, size = map(int, re.findall(r"\d+", headers["Content-Range"]))
        assert (first, last + 1, size) == (*part.indices(size)[:2], len(CLIP))


@pytest.mark.parametrize("asked", [f"bytes={len(CLIP)}-", "bytes=2-0", "bytes=100-50", "bytes=-0"])
def test_a_part_that_a_film_has_not_is_refused(client, folder, asked):
    a_run(folder)
    assert shown(client, "film.mp4", Range=asked)[0] == 416


def test_a_long_clip_is_sent_in_parts(client, folder, monkeypatch):
    monkeypatch.setattr(module, "MOST_SENT", 100)
    a_run(folder)
    _, headers, content = shown(client, "film.mp4", Range="bytes=50-")
    assert shown(client, "film.mp4")[2] == CLIP
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
def test_nothing_else_is_shown(client, what):
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
def test_what_cannot_be_done_is_refused_and_starts_nothing(client, body, status, why):
    answer, told = client.post("start", body)
    assert (answer, why in told["error"]) == (status, True)
    assert state(client)["films"][0]["work"] is None
    assert client.ask("POST", "start", body, Origin="http://elsewhere")[0] == 403


def test_a_folder_that_is_none_is_refused_in_one_line(tmp_path):
    assert ended("app", tmp_path / "none", "--no-browser") == (
        1, "", f"error: {tmp_path / 'none'} is no folder; give one with films in it\n",
    )  # fmt: skip
