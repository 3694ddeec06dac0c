"""The page's server: this machine only, one address, one key, what it answers is listed here.

A page of another site that is open in the same browser can send requests here, too. It cannot know the key
in the address, cannot send a foreign `Host` past the check (which defeats DNS rebinding), and a request that
changes something must come from this very `Origin` as JSON of bounded length. No answer depends on a path
given by the client: files are read and written only where the command said.
"""

import hmac
import json
import secrets
import sys
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import TCPServer
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from tracker.annotate.correction import Correction
from tracker.annotate.marking_page import compose
from tracker.annotate.session import CheckRequest, SaveRequest, Session
from tracker.run.folder import FolderError
from videos.frames import VideoError

LOOPBACK = "127.0.0.1"
MOST_BYTES = 2**20  # of a request: the marks of two thousand frames
MOST_SECONDS = 30.0  # for a request to arrive

Request = TypeVar("Request", bound=BaseModel)


class RefusalError(Exception):
    """A request that is not done.

    status : the answer's
    """

    def __init__(self, status: HTTPStatus, text: str) -> None:
        super().__init__(text)
        self.status = status


class Server(ThreadingHTTPServer):
    """Serves one session until it is closed or interrupted.

    address : the page's, key included
    """

    # Connections that wait to be let in; one beyond them is tried again by the browser, seconds later.
    request_queue_size = 128

    def __init__(self, session: Session, port: int = 0) -> None:
        """Args: port: 0 for any that is free. Raises OSError where the port is taken."""
        super().__init__((LOOPBACK, port), Handler)
        self.session = session
        self.key = secrets.token_urlsafe(24)
        self.hosts = {f"{name}:{self.server_port}" for name in (LOOPBACK, "localhost")}
        self.address = f"http://{LOOPBACK}:{self.server_port}/{self.key}/"

    def server_bind(self) -> None:
        """As a TCP server does: an HTTP server would ask for this machine's name, which may take long."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = LOOPBACK, self.server_address[1]

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that hangs up is no error."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class Handler(BaseHTTPRequestHandler):
    """Answers one request."""

    server: Server
    timeout = MOST_SECONDS
    server_version, sys_version = "figtrack", ""

    def do_GET(self) -> None:
        """The page, its frames, and how far following has come."""
        session = self.server.session
        try:
            what = self._admitted(changes=False)
            if what == "":
                self._answer_page()
            elif what.startswith("frame/"):
                self._answer(session.frame(_index(what.removeprefix("frame/"))))
            elif what.startswith("quick/"):
                self._answer(session.frame(_index(what.removeprefix("quick/")), quick=True))
            elif what == "following" and isinstance(session, Correction):
                self._answer(session.following())
            else:
                raise RefusalError(HTTPStatus.NOT_FOUND, "there is nothing here by this name")
        except RefusalError as refusal:
            self._refuse(refusal.status, str(refusal))
        except (VideoError, OSError) as error:
            self._refuse(HTTPStatus.NOT_FOUND, str(error))

    def do_POST(self) -> None:
        """Judge marks, save them, follow on from them."""
        session, closed = self.server.session, False
        try:
            what = self._admitted(changes=True)
            if what == "check":
                self._answer(session.check(self._body(CheckRequest)))
            elif what == "save":
                reply = session.save(self._body(SaveRequest))
                closed = reply["closed"]
                self._answer(reply)
            elif what == "follow" and isinstance(session, Correction):
                self._answer(session.follow(self._body(SaveRequest)))
            else:
                raise RefusalError(HTTPStatus.NOT_FOUND, "there is nothing here by this name")
        except RefusalError as refusal:
            self._refuse(refusal.status, str(refusal))
        except FolderError as error:
            self._refuse(HTTPStatus.CONFLICT, str(error))
        except OSError as error:
            self._refuse(HTTPStatus.INTERNAL_SERVER_ERROR, f"{error.strerror or error}; nothing was written")
        if closed:
            self.server.shutdown()

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the terminal is for what the user needs to know."""

    def _admitted(self, *, changes: bool) -> str:
        """What is asked for, once the request has shown that it comes from our own page."""
        host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
        if host not in self.server.hosts:
            raise RefusalError(HTTPStatus.FORBIDDEN, "this server answers to its own address only")
        if (changes or origin is not None) and origin != f"http://{host}":
            raise RefusalError(HTTPStatus.FORBIDDEN, "this server answers to its own page only")
        key, slash, what = self.path.removeprefix("/").partition("/")
        if not slash or not hmac.compare_digest(key.encode(), self.server.key.encode()):
            raise RefusalError(
                HTTPStatus.FORBIDDEN,
                f"open the very address that figtrack {self.server.session.command} printed",
            )
        return what

    def _body(self, kind: type[Request]) -> Request:
        if self.headers.get_content_type() != "application/json":
            raise RefusalError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "send JSON")
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdecimal()) or "Transfer-Encoding" in self.headers:
            raise RefusalError(HTTPStatus.LENGTH_REQUIRED, "say how long the request is")
        if len(length) > 12 or int(length) > MOST_BYTES:
            raise RefusalError(
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
                f"a request may have {MOST_BYTES} bytes, this has {length}",
            )
        try:
            return kind.model_validate_json(self.rfile.read(int(length)))
        except ValidationError as error:
            first = error.errors(include_url=False, include_context=False)[0]
            where = ".".join(str(part) for part in first["loc"])
            raise RefusalError(HTTPStatus.BAD_REQUEST, f"{where}: {first['msg']}") from error

    def _answer_page(self) -> None:
        nonce = secrets.token_urlsafe(16)
        page = compose(self.server.session.opening(), nonce).encode("utf-8")
        policy = (
            f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; img-src data:; "
            "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        self._send(HTTPStatus.OK, page, "text/html; charset=utf-8", {"Content-Security-Policy": policy})

    def _answer(self, reply: Any, status: HTTPStatus = HTTPStatus.OK) -> None:
        self._send(status, json.dumps(reply).encode("ascii"), "application/json", {})

    def _refuse(self, status: HTTPStatus, text: str) -> None:
        self._answer({"error": text}, status)

    def _send(self, status: HTTPStatus, body: bytes, kind: str, more: dict[str, str]) -> None:
        headers = {
            "Content-Type": kind,
            "Content-Length": str(len(body)),
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            "Cross-Origin-Resource-Policy": "same-origin",
            **more,
        }
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        with suppress(ConnectionError):  # the page may have been closed meanwhile
            self.end_headers()
            self.wfile.write(body)


def _index(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 10):
        raise RefusalError(HTTPStatus.NOT_FOUND, f"a frame is a whole number from 0; got {text!r}")
    return int(text)
