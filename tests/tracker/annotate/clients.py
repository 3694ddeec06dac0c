"""Clients of the page's server, in this process or in that of a command that is running."""

import json
import re
import threading
from contextlib import contextmanager
from http.client import HTTPConnection

from tests.tracker.processes import started


class Connection(HTTPConnection):
    """Sends whatever bytes it is given for a path."""

    def _encode_request(self, request):
        return request.encode("latin-1")


class Client:
    """Asks the server at an address; what it sends unless told is what the page would send."""

    def __init__(self, address):
        self.address = address
        self.host, self.key = address.removeprefix("http://").rstrip("/").split("/")

    def ask(self, method, what, body=None, *, key=None, raw=None, **headers):
        """Status, headers and body of the answer; a header given as None is left out."""
        usual = {"Host": self.host}
        if method == "POST":
            usual |= {"Origin": f"http://{self.host}", "Content-Type": "application/json"}
            raw = json.dumps(body).encode() if raw is None else raw
            usual["Content-Length"] = str(len(raw))
        sent = {name: text for name, text in {**usual, **headers}.items() if text is not None}
        connection = Connection(self.host, timeout=10)
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

    def opening(self):
        """What the page starts with."""
        page = self.ask("GET", "")[2].decode()
        return json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.DOTALL)[1])


@contextmanager
def serving(server):
    """A client of a `server` that runs; its `thread` ends with what is served."""
    with server:
        client = Client(server.address)
        client.server = server
        client.thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
        client.thread.start()
        try:
            yield client
        finally:
            server.shutdown()


@contextmanager
def running(*words, cwd=None, command="annotate"):
    """The command at work, all that it `said` so far, and a client of the address in it."""
    process = started(command, *words, "--no-browser", cwd=cwd)
    try:
        lines = iter(process.stdout.readline, "")
        process.said = next(lines)
        while not (found := re.search(r"http://\S+", process.said)):
            process.said += next(lines)
        yield process, Client(found[0])
    finally:
        process.kill()
        process.communicate()
