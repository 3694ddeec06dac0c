"""What the page's server refuses: strangers, paths to files, what is no request, and too many at once."""

import json
import socket
from contextlib import ExitStack, contextmanager

import pytest

from tests.tracker.annotate.marked import MARKS as GOOD
from tests.tracker.annotate.marked import told
from tests.tracker.clips import everything
from tracker.annotate import loopback
from tracker.annotate import server as module
from tracker.annotate.loopback import MOST_BYTES

NOWHERE = (
    "following nothing check page.html quick/-1 quick/ frame/-1 frame/1.5 frame/ frame/9999999999 frame/\xb3"
)
AWAY = "frame/0/.. ../../etc/passwd ..%2f..%2fetc/passwd frame/../../k.csv ?frame=../k.csv"


@pytest.mark.parametrize("what", [*NOWHERE.split(), *AWAY.split()])
def test_what_is_not_there_is_not_found_and_no_path_leads_to_a_file(client, what):
    status, reply = client.get(what)
    assert (status, reply.keys()) == (404, {"error"})


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
    assert client.post("check", {"frames": {"0": {}}}, Host=host, Origin=f"http://{host}")[0] == 200
    assert client.post("check", {"frames": {"0": {}}}, Host=host)[0] == 403


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
BARE = b"", b"{", b"\xff\xfe", b'{"frames": {"0": {"hip": {"x": NaN, "y": 1}}}}', b"[" * 50000, b"9" * 100000


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
        *BARE,  # no JSON
    ],
    ids=lambda body: str(body)[:60],
)
def test_what_is_no_set_of_marks_is_refused_whole(client, table, body):
    status, reply = client.post("save", body, raw=body if body in BARE else None)
    assert status == 400
    assert reply["error"]
    assert everything(table.parent) == {}
    assert client.thread.is_alive()


@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "HEAD", "TRACE"])
def test_no_other_way_of_asking_is_answered(client, method):
    assert client.ask(method, "")[0] == 501


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
