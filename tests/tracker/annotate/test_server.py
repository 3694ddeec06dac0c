"""The page's server: what it answers, whom it refuses, and that it writes the one file and no other."""

import base64
import json
import socket
import threading
from contextlib import ExitStack, contextmanager
from http.client import HTTPConnection
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.tracker.annotate.test_advice import MARKS as GOOD
from tests.tracker.annotate.test_advice import without
from tests.tracker.clips import everything
from tracker.annotate import frames, loopback
from tracker.annotate import server as module
from tracker.annotate.loopback import MOST_BYTES
from tracker.annotate.marks import Table
from tracker.annotate.server import PAGE, Server
from tracker.annotate.session import CheckRequest, Session
from tracker.tables.keypoints import KEYPOINTS, Mark, read_keypoints


def told(marks):
    return {name: {"x": mark.x, "y": mark.y, "visible": mark.visible} for name, mark in marks.items()}


class Connection(HTTPConnection):
    """Sends whatever bytes it is given for a path."""

    def _encode_request(self, request):
        return request.encode("latin-1")


class Client:
    """Asks one server; what it sends unless told is what the page would send."""

    def __init__(self, server):
        self.server, self.host = server, f"127.0.0.1:{server.server_port}"
        self.key = server.key

    def ask(self, method, what, body=None, *, key=None, raw=None, **headers):
        """Status, headers and body of the answer; a header given as None is left out."""
        usual = {"Host": self.host}
        if method == "POST":
            usual |= {"Origin": f"http://{self.host}", "Content-Type": "application/json"}
            raw = json.dumps(body).encode() if raw is None else raw
            usual["Content-Length"] = str(len(raw))
        sent = {name: text for name, text in {**usual, **headers}.items() if text is not None}
        connection = Connection("127.0.0.1", self.server.server_port, timeout=10)
        path = what if what.startswith(("/", "http", "*")) else f"/{self.key if key is None else key}/{what}"
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        for name, text in sent.items():
            connection.putheader(name, text)
        connection.endheaders(raw)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, answer.headers, content

    def get(self, what, **more):
        status, _, content = self.ask("GET", what, **more)
        return status, json.loads(content)

    def post(self, what, body=None, **more):
        status, _, content = self.ask("POST", what, body, **more)
        return status, json.loads(content)


@pytest.fixture
def table(tmp_path):
    return tmp_path / "out" / "k.csv"


@pytest.fixture
def client(clip, table):
    """A client of a server that runs; its `thread` ends with the session."""
    table.parent.mkdir()
    with Server(Session(clip.video, Table(table), 0)) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        client = Client(server)
        client.thread = thread
        yield client
        server.shutdown()


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


@pytest.mark.parametrize(
    "what",
    [
        "following",
        "quick/-1",
        "quick/",
        "frame/-1",
        "frame/1.5",
        "frame/",
        "frame/9999999999",
        "frame/\xb3",
        "frame/0/..",
        "nothing",
        "check",
        "../../etc/passwd",
        "..%2f..%2fetc/passwd",
        "frame/../../k.csv",
        "page.html",
        "?frame=../k.csv",
    ],
)
def test_what_is_not_there_is_not_found_and_no_path_leads_to_a_file(client, what):
    status, reply = client.get(what)
    assert (status, reply.keys()) == (404, {"error"})


def test_marks_are_judged_as_the_house_judges_them(client):
    status, reply = client.post("check", {"frame": 0, "marks": told(without("neck"))})
    assert (status, reply["missing"], reply["faults"]) == (200, ["neck"], [])
    wrong = GOOD | {"near_toe": Mark(-9.0, 3.0)}
    assert "near_toe lies outside" in client.post("check", {"frame": 0, "marks": told(wrong)})[1]["faults"][0]


def test_saving_writes_the_table_and_says_what_comes_next(client, clip, table):
    status, reply = client.post("save", {"frames": {"3": told(GOOD)}})
    assert (status, reply["frames"], reply["wrong"], reply["closed"]) == (200, 1, [], False)
    assert read_keypoints(table) == {3: {name: GOOD[name] for name in KEYPOINTS}}
    assert reply["next"] == f"figtrack track {clip.video} --keypoints {table}"
    assert "--anchors" in client.post("save", {"frames": {"5": told(GOOD)}})[1]["next"]
    assert "--facing left" in client.post("save", {"frames": {}, "facing": "left"})[1]["next"]
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


def test_a_full_disk_is_said(client, monkeypatch, table):
    def full(self, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    status, reply = client.post("save", {"frames": {"0": told(GOOD)}})
    assert (status, reply["error"]) == (500, "No space left on device; nothing was written")
    assert everything(table.parent) == {}


STRANGERS = {
    "a foreign host": {"Host": "evil.example"},
    "this host at another port": {"Host": "127.0.0.1:1"},
    "no host": {"Host": None},
    "a foreign origin": {"Origin": "http://evil.example"},
    "no known origin": {"Origin": "null"},
    "an https origin": {"Origin": "https://127.0.0.1"},
    "a wrong key": {"key": "a" * 32},
    "an empty key": {"key": ""},
    "a key that is no text": {"key": "\xff"},
}


@pytest.mark.parametrize("who", STRANGERS)
@pytest.mark.parametrize(
    ("method", "what"),
    [("GET", ""), ("GET", "frame/0"), ("GET", "quick/0"), ("POST", "check"), ("POST", "save")],
)
def test_strangers_get_nothing_and_change_nothing(client, table, who, method, what):
    body = {"frames": {"0": told(GOOD)}} if what == "save" else {"marks": {}}
    status, _, content = client.ask(method, what, body, **STRANGERS[who])
    assert status == 403
    assert set(json.loads(content)) == {"error"}
    assert not table.exists()


def test_what_changes_something_must_say_where_it_comes_from(client, table):
    assert client.post("save", {"frames": {"0": told(GOOD)}}, Origin=None)[0] == 403
    assert not table.exists()


def test_the_key_in_another_place_opens_nothing(client):
    assert client.ask("GET", f"/?key={client.key}")[0] == 403
    assert client.ask("GET", f"http://{client.host}/{client.key}/")[0] == 403
    assert client.ask("GET", f"/{client.key}")[0] == 403


def test_localhost_is_this_machine_too(client):
    host = f"localhost:{client.server.server_port}"
    assert client.post("check", {"frame": 0, "marks": {}}, Host=host, Origin=f"http://{host}")[0] == 200
    assert client.post("check", {"frame": 0, "marks": {}}, Host=host)[0] == 403


def test_only_the_loopback_address_is_listened_on(client):
    assert client.server.socket.getsockname()[0] == "127.0.0.1"
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", client.server.server_port), timeout=5.0)


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Content-Length": None}, 411),
        ({"Content-Length": "-1"}, 411),
        ({"Content-Length": "1e3"}, 411),
        ({"Content-Length": None, "Transfer-Encoding": "chunked"}, 411),
        ({"Transfer-Encoding": "chunked"}, 411),
        ({"Content-Length": str(MOST_BYTES + 1)}, 413),
        ({"Content-Length": "9" * 5000}, 413),
        ({"Content-Type": "text/plain"}, 415),
        ({"Content-Type": "application/x-www-form-urlencoded"}, 415),
        ({"Content-Type": None}, 415),
    ],
)
def test_requests_of_unknown_or_undue_length_or_kind_are_not_read(client, table, headers, status):
    assert client.post("save", {"frames": {"0": told(GOOD)}}, **headers)[0] == status
    assert not table.exists()


def test_a_request_that_never_comes_whole_is_given_up(client, table, monkeypatch):
    monkeypatch.setattr(module.Handler, "timeout", 0.2)
    body = json.dumps({"frames": {"0": told(GOOD)}}).encode()
    status, reply = client.post("save", raw=body[:-5], **{"Content-Length": str(len(body))})
    assert status == 500
    assert "nothing was written" in reply["error"]
    assert not table.exists()


HIP = {"x": 1.0, "y": 2.0, "visible": True}


@pytest.mark.parametrize(
    "body",
    [
        None,
        [],
        {},
        {"frames": []},
        {"frames": {"-1": {"hip": HIP}}},
        {"frames": {"1.5": {"hip": HIP}}},
        {"frames": {"999999999": {"hip": HIP}}},
        {"frames": {"../../etc/passwd": {"hip": HIP}}},
        {"frames": {"0": {"elbow": HIP}}},
        {"frames": {"0": {"hip": {"x": 1.0}}}},
        {"frames": {"0": {"hip": HIP | {"x": "=1+1"}}}},
        {"frames": {"0": {"hip": HIP | {"x": 1e6}}}},
        {"frames": {"0": {"hip": HIP | {"y": None}}}},
        {"frames": {"0": {"hip": HIP | {"visible": 7}}}},
        {"frames": {"0": {"hip": HIP | {"path": "/tmp/x"}}}},
        {"frames": {"0": {"hip": HIP}}, "facing": "up"},
        {"frames": {"0": {"hip": HIP}}, "out": "/tmp/x.csv"},
    ],
    ids=str,
)
def test_what_is_no_set_of_marks_is_refused_whole(client, table, body):
    status, reply = client.post("save", body)
    assert status == 400
    assert reply["error"]
    assert everything(table.parent) == {}


@pytest.mark.parametrize(
    "raw",
    [b"", b"{", b"\xff\xfe", b'{"frames": {"0": {"hip": {"x": NaN, "y": 1}}}}', b"[" * 50000, b"9" * 100000],
)
def test_what_is_no_json_is_refused(client, table, raw):
    assert client.post("save", raw=raw)[0] == 400
    assert everything(table.parent) == {}
    assert client.thread.is_alive()


@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "HEAD", "TRACE"])
def test_no_other_way_of_asking_is_answered(client, method):
    assert client.ask(method, "")[0] == 501


def test_a_facing_that_was_told_is_judged_by_and_handed_on(clip, table):
    marks = CheckRequest(frame=0, marks=told(GOOD))
    for facing, faults in ((1, 0), (-1, 1), (None, 0)):
        session = Session(clip.video, Table(table), 0, facing=facing)
        assert bool(session.check(marks)["faults"]) == faults
        words = session.next_command().split()
        way = words[words.index("--facing") + 1] if "--facing" in words else None
        assert way == {1: "right", -1: "left", None: None}[facing]


def test_the_joints_come_in_order_with_the_limb_they_end(client, clip):
    joints = client.server.session.opening()["joints"]
    assert [joint["name"] for joint in joints] == list(KEYPOINTS)
    before = {joint["name"]: joint["before"] for joint in joints}
    assert (before["hip"], before["neck"], before["head_top"]) == (None, "hip", "neck")
    assert (before["far_knee"], before["far_ankle"], before["far_toe"]) == ("hip", "far_knee", "far_ankle")
    needed = {joint["name"] for joint in joints if joint["needed"]}
    assert needed == {"head_top", "neck", "hip", "near_knee", "far_knee"}
    assert {joint["side"] for joint in joints} == {"near", "far", "trunk"}


@pytest.mark.parametrize(
    "what", ["follow", "../save", "save/../../k2.csv", "save?out=/tmp/k.csv", "%2e%2e/save", "Save", "save/"]
)
def test_no_path_leads_to_another_file_to_write(client, table, what):
    assert client.post(what, {"frames": {"0": told(GOOD)}})[0] == 404
    assert everything(table.parent.parent) == {}


def test_a_request_with_two_hosts_is_judged_by_the_first(client):
    request = f"GET /{client.key}/ HTTP/1.1\r\nHost: evil.example\r\nHost: {client.host}\r\n\r\n"
    assert answer(client, request.encode()).startswith(b"HTTP/1.0 403 ")


@contextmanager
def connected(client, count):
    """So many connections to the server of a client."""
    address = ("127.0.0.1", client.server.server_port)
    with ExitStack() as stack:
        yield [stack.enter_context(socket.create_connection(address, timeout=10.0)) for _ in range(count)]


def answer(client, request):
    """What comes back for raw bytes."""
    with connected(client, 1) as (connection,):
        connection.sendall(request)
        connection.shutdown(socket.SHUT_WR)
        parts = iter(lambda: connection.recv(65536), b"")
        return b"".join(parts)


@pytest.mark.parametrize(
    ("request_line", "status"),
    [
        (b"GET /" + b"a" * 70_000 + b" HTTP/1.1", b"414"),
        (b"GET / HTTP/1.1\r\n" + b"\r\n".join(b"X-%d: 1" % i for i in range(200)), b"431"),
        (b"GET / HTTP/1.1\r\nX: " + b"a" * 70_000, b"431"),
        (b"<script>alert(1)</script>", b"400"),
        (b"GET / HTTP/9.9", b"505"),
    ],
    ids=["long path", "many headers", "long header", "no request", "another version"],
)
def test_what_is_no_request_of_bounded_size_is_refused_and_the_page_goes_on(client, request_line, status):
    reply = answer(client, request_line + b"\r\n\r\n")
    assert status in reply[:900]
    assert b"<script>" not in reply
    assert client.key.encode() not in reply
    assert client.ask("GET", "")[0] == 200


def test_a_hundred_connections_that_say_nothing_do_not_keep_the_page_from_answering(client, monkeypatch):
    assert module.Handler.timeout <= 60.0
    monkeypatch.setattr(module.Handler, "timeout", 0.5)
    with connected(client, 100) as silent:
        silent[0].sendall(b"GET /")
        assert client.ask("GET", "")[0] == 200
        assert [connection.recv(1) for connection in silent] == [b""] * len(silent)  # hung up on


def test_of_more_requests_than_are_waited_for_at_once_the_oldest_are_given_up(client, monkeypatch):
    monkeypatch.setattr(loopback, "MOST_AT_ONCE", 10)
    with connected(client, 40) as silent:
        assert client.ask("GET", "")[0] == 200
        assert [connection.recv(1) for connection in silent[:31]] == [b""] * 31  # one for the page
        silent[-1].settimeout(0.05)
        with pytest.raises(TimeoutError):
            silent[-1].recv(1)
        assert len(client.server.waiting) <= 10


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
        assert client.post("check", {"frame": 0, "marks": marks})[0] == 200
    assert capfd.readouterr().err == ""
