"""The page's server: the page and frames that it answers with, and the marks that it judges and saves."""

import base64
from pathlib import Path

import cv2
import numpy as np

from tests.tracker.annotate.marked import MARKS as GOOD
from tests.tracker.annotate.marked import told, without
from tests.tracker.clips import everything
from tracker.annotate import frames
from tracker.annotate.marks import Table
from tracker.annotate.server import PAGE, Server
from tracker.annotate.session import MarksRequest, Session
from tracker.tables.keypoints import KEYPOINTS, Mark, read_keypoints


def test_the_page_is_whole_in_itself_with_the_very_frame_in_it(client):
    status, headers, content = client.ask("GET", "")
    page = content.decode()
    assert status == 200
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    assert "{{" not in page
    assert '"image":"data:image/png;base64,iVBOR' in page
    assert "http" not in page
    assert headers["Content-Security-Policy"].startswith("default-src 'none'")
    assert "unsafe" not in headers["Content-Security-Policy"]


def test_no_two_pages_share_a_nonce_and_no_two_servers_a_key(client, clip, table):
    policies = {client.ask("GET", "")[1]["Content-Security-Policy"] for _ in range(2)}
    assert len(policies) == 2
    with Server(Session(clip.video, Table(table), 0)) as other:
        assert other.key != client.key
        assert len(other.key) >= 32


def test_a_name_with_markup_in_it_cannot_leave_its_place_in_the_page(clip, tmp_path):
    video = tmp_path / "</script><script>alert(1)</script>{{style}}.mp4".replace("/", "")
    video.write_bytes(clip.video.read_bytes())
    session = Session(video, Table(tmp_path / "k.csv"), 0)
    with Server(session) as server:
        page = "".join(PAGE.compose(session.opening(), "n", title="figtrack"))
    assert page.count("<script") == 2
    assert "{{style}}" in page
    assert server.address.startswith("http://127.0.0.1:")


def test_frames_come_by_number_and_one_beyond_the_end_is_said(client):
    status, frame = client.get("frame/9")
    assert (status, frame["index"], frame["count"], frame["width"], frame["height"]) == (200, 9, 10, 480, 270)
    assert frame["figure"] == {}
    status, reply = client.get("frame/10")
    assert status == 404
    assert "ends with frame 9" in reply["error"]


def test_a_frame_in_passing_comes_small(client, monkeypatch):
    monkeypatch.setattr(frames, "QUICK", 96)
    status, frame = client.get("quick/9")
    assert (status, frame["index"], frame["width"]) == (200, 9, 480)
    kind, _, data = frame["image"].partition(";base64,")
    assert kind == "data:image/jpeg"
    image = cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), cv2.IMREAD_COLOR)
    assert image.shape == (54, 96, 3)


def test_marks_are_judged_as_the_house_judges_them(client):
    status, reply = client.post("check", {"frames": {"0": told(without("neck"))}})
    assert (status, reply["missing"], reply["faults"]) == (200, ["neck"], [])
    wrong = GOOD | {"near_toe": Mark(-9.0, 3.0)}
    assert "near_toe lies outside" in client.post("check", {"frames": {"0": told(wrong)}})[1]["faults"][0]


def test_each_save_goes_on_from_the_last_and_says_what_comes_next(client, clip, table):
    status, reply = client.post("save", {"frames": {"3": told(GOOD)}})
    assert (status, reply["frames"], reply["wrong"], reply["closed"]) == (200, 1, [], False)
    assert read_keypoints(table) == {3: {name: GOOD[name] for name in KEYPOINTS}}
    assert reply["next"] == f"figtrack track {clip.video} --keypoints {table}"
    assert "--anchors" in client.post("save", {"frames": {"5": told(GOOD)}})[1]["next"]
    assert "--facing left" in client.post("save", {"frames": {}, "facing": "left"})[1]["next"]
    assert sorted(read_keypoints(table)) == [3, 5]
    assert client.thread.is_alive()


def test_save_and_close_ends_the_session(client, table):
    assert client.post("save", {"frames": {"0": told(GOOD)}, "close": True})[1]["closed"]
    client.thread.join(5.0)
    assert not client.thread.is_alive()
    assert table.exists()


def test_with_something_wrong_it_is_saved_but_stays_open_until_told_to_close_anyway(client, table):
    frames = {"0": told(without("hip")), "4": told(GOOD | {"far_toe": Mark(999, 9)})}
    reply = client.post("save", {"frames": frames, "close": True})[1]
    assert not reply["closed"]
    assert reply["wrong"][0] == "frame 0: lacks hip"
    assert reply["wrong"][1].startswith("frame 4: far_toe lies outside")
    assert sorted(read_keypoints(table)) == [0, 4]
    assert client.post("save", {"frames": {}, "close": True, "anyway": True})[1]["closed"]


def test_an_anchor_may_lack_joints_that_the_start_may_not(client):
    frames = {"0": told(GOOD), "4": told({"hip": GOOD["hip"]})}
    assert client.post("save", {"frames": frames})[1]["wrong"] == []


def test_a_save_that_cannot_be_done_says_why_and_the_session_goes_on(client, table):
    status, reply = client.post("save", {"frames": {}, "close": True})
    assert (status, table.exists()) == (409, False)
    assert "no joint is marked" in reply["error"]
    table.write_text("frame,keypoint,x,y\n0,hip,1,1\n")
    status, reply = client.post("save", {"frames": {"0": told(GOOD)}})
    assert status == 409
    assert "another program" in reply["error"]
    assert client.thread.is_alive()


def test_a_save_of_a_page_that_does_not_know_the_last_one_is_refused(client, table):
    assert client.opening()["revision"] == 0
    first = {"frames": {"0": told(GOOD)}, "revision": 0}
    assert client.post("save", first)[1]["revision"] == 1
    before = table.read_bytes()
    for late in ({"frames": {"0": told(without("hip"))}}, {"frames": {}, "facing": "left"}):
        status, reply = client.post("save", late | {"revision": 0})
        assert (status, "saved in another tab meanwhile; reload" in reply["error"]) == (409, True)
    assert table.read_bytes() == before
    assert client.post("save", {"frames": {}, "facing": "left", "revision": 1})[1]["revision"] == 2


def test_a_full_disk_is_said(client, monkeypatch, table):
    def full(self, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    status, reply = client.post("save", {"frames": {"0": told(GOOD)}})
    assert (status, reply["error"]) == (500, "No space left on device; nothing was written")
    assert everything(table.parent) == {}


def test_a_facing_that_was_told_is_judged_by_and_handed_on(clip, table):
    marks = MarksRequest(frames={0: told(GOOD)})
    for facing, faults in ((1, 0), (-1, 1), (None, 0)):
        session = Session(clip.video, Table(table), 0, facing=facing)
        assert bool(session.check(marks)["faults"]) == faults
        words = session.next_command().split()
        way = words[words.index("--facing") + 1] if "--facing" in words else None
        assert way == {1: "right", -1: "left", None: None}[facing]


def test_in_the_app_the_next_step_is_a_button(clip, table, monkeypatch):
    monkeypatch.setenv("FIGTRACK_APP", "1")
    for facing, told_next in ((None, "Follow"), (-1, "Follow, with Faces left")):
        assert Session(clip.video, Table(table), 0, facing=facing).next_command() == told_next


def test_marks_however_wild_are_judged_and_nothing_is_printed_of_them(client, rng, capfd):
    for _ in range(200):
        scale = 10.0 ** rng.integers(-3, 6)
        places = np.clip(np.round(rng.normal(scale=scale, size=(len(KEYPOINTS), 2)), 2), -1e5, 1e5)
        kept = rng.random(len(KEYPOINTS)) < 0.8
        marks = {
            n: {"x": x, "y": y}
            for n, (x, y), keep in zip(KEYPOINTS, places.tolist(), kept, strict=True)
            if keep
        }
        assert client.post("check", {"frames": {"0": marks}})[0] == 200
    assert capfd.readouterr().err == ""
