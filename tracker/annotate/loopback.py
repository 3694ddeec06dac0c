"""A server for the program's pages, on the loopback address and with a key.

A page of another site in the same browser can send requests here, too. It does not know the key in the
address and cannot pass the check of `Host` (which prevents DNS rebinding); requests that change something
must come from the page's own `Origin` as JSON of bounded length.
"""

import hmac
import json
import secrets
import socket
import sys
import webbrowser
from collections import deque
from collections.abc import Iterable
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from socketserver import TCPServer
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from tracker.report.document import Document
from tracker.run.folder import FolderError
from videos.container import VideoError

LOOPBACK = "127.0.0.1"
FORWARD = '<!DOCTYPE html><meta http-equiv="refresh" content="0; url={address}"><a href="{address}">open</a>'
MOST_BYTES = 2**20  # largest request, the marks of two thousand frames
MOST_SECONDS = 30.0  # longest time for a request to arrive
MOST_AT_ONCE = 128  # largest number of requests; beyond it the oldest are dropped, as the page's are short

Request = TypeVar("Request", bound=BaseModel)


class RefusalError(Exception):
    """A request that is refused.

    status : HTTP status of the answer
    """

    def __init__(self, status: HTTPStatus, text: str) -> None:
        super().__init__(text)
        self.status = status


class LoopbackServer(ThreadingHTTPServer):
    """Serves one page until it is closed or interrupted.

    command : name of the command that prints the address
    address : of the page, including the key
    """

    doorway: TemporaryDirectory[str] | None = None

    # Length of the queue of connections; beyond it the browser tries again seconds later.
    request_queue_size = 128

    def __init__(self, handler: type["LoopbackHandler"], port: int, command: str) -> None:
        """Args: port: 0 for any free one. Raises FolderError if the port cannot be used."""
        try:
            super().__init__((LOOPBACK, port), handler)
        except OSError as error:
            raise FolderError(
                f"port {port} of {LOOPBACK} cannot be had ({error.strerror}); choose another --port"
            ) from error
        self.command = command
        self.waiting: deque[socket.socket] = deque()
        self.key = secrets.token_urlsafe(24)
        self.hosts = {f"{name}:{self.server_port}" for name in (LOOPBACK, "localhost")}
        self.address = f"http://{LOOPBACK}:{self.server_port}/{self.key}/"

    def key_of(self, what: str) -> str:
        """The key for this part after it in an address."""
        return self.key

    def server_bind(self) -> None:
        """Bind as a TCP server: an HTTP server would look up this machine's name, which may take long."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = LOOPBACK, self.server_address[1]

    def show(self) -> None:
        """Open the page through a forwarding file that only its owner can read.

        A browser's command line, which everybody on this machine can read, then does not contain the key.
        """
        self.doorway = TemporaryDirectory(prefix="figtrack-")
        door = Path(self.doorway.name) / "open.html"
        door.touch(0o600)
        door.write_text(FORWARD.format(address=self.address), encoding="ascii")
        show(door.as_uri())

    def process_request(self, request: Any, client_address: Any) -> None:
        """Process a request in a thread, with a bounded number of threads."""
        self.waiting.append(request)
        if len(self.waiting) > MOST_AT_ONCE:
            with suppress(OSError):  # it has just ended
                self.waiting.popleft().shutdown(socket.SHUT_RDWR)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        with suppress(ValueError):  # it was dropped as the oldest
            self.waiting.remove(request)
        super().shutdown_request(request)

    def server_close(self) -> None:
        """Release the port, and remove the forwarding file."""
        super().server_close()
        if self.doorway is not None:
            self.doorway.cleanup()

    def handle_error(self, request: Any, client_address: Any) -> None:
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class LoopbackHandler(BaseHTTPRequestHandler):
    """Checks a request and has it answered by `get` or `post`, given what follows the key in the address."""

    server: LoopbackServer
    timeout = MOST_SECONDS
    server_version, sys_version = "figtrack", ""

    def get(self, what: str) -> None:
        """Answer a request that changes nothing; raises RefusalError, VideoError or OSError."""
        raise NotImplementedError

    def post(self, what: str) -> None:
        """Answer a request that changes something; raises RefusalError, FolderError or OSError."""
        raise NotImplementedError

    def do_GET(self) -> None:
        try:
            self.get(self._admitted(changes=False))
        except RefusalError as refusal:
            self.answer({"error": str(refusal)}, refusal.status)
        except (VideoError, OSError) as error:
            self.answer({"error": str(error)}, HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        try:
            self.post(self._admitted(changes=True))
        except RefusalError as refusal:
            self.answer({"error": str(refusal)}, refusal.status)
        except FolderError as error:
            self.answer({"error": str(error)}, HTTPStatus.CONFLICT)
        except OSError as error:
            said = f"{error.strerror or error}; nothing was written"
            self.answer({"error": said}, HTTPStatus.INTERNAL_SERVER_ERROR)

    def log_message(self, format: str, *args: Any) -> None:
        """Print nothing: the terminal is for the user's messages."""

    def body(self, kind: type[Request]) -> Request:
        """The body of a request as this type; raises RefusalError if it is no such JSON or too long."""
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

    def answer(self, reply: Any, status: HTTPStatus = HTTPStatus.OK) -> None:
        self.send(status, json.dumps(reply).encode("ascii"), "application/json", {})

    def answer_page(self, page: Document, opening: object) -> None:
        """Send a page whose style and scripts have a nonce, and which loads nothing from elsewhere."""
        nonce = secrets.token_urlsafe(16)
        policy = (
            f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; "
            "img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
            "frame-ancestors 'none'"
        )
        text = "".join(page.compose(opening, nonce, title="figtrack"))
        kind = "text/html; charset=utf-8"
        self.send(HTTPStatus.OK, text.encode("utf-8"), kind, {"Content-Security-Policy": policy})

    def send(self, status: HTTPStatus, body: bytes, kind: str, more: dict[str, str]) -> None:
        """Send a whole answer with the common headers."""
        self.stream(status, [body], len(body), kind, more)

    def stream(
        self, status: HTTPStatus, parts: Iterable[bytes], length: int, kind: str, more: dict[str, str]
    ) -> None:
        """Send an answer of so many bytes in parts, with the common headers."""
        headers = {
            "Content-Type": kind,
            "Content-Length": str(length),
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
            for part in parts:
                self.wfile.write(part)

    def _admitted(self, *, changes: bool) -> str:
        """The path of a request; raises RefusalError unless it comes from the page and has its key."""
        host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
        if host not in self.server.hosts:
            raise RefusalError(HTTPStatus.FORBIDDEN, "this server answers to its own address only")
        if (changes or origin is not None) and origin != f"http://{host}":
            raise RefusalError(HTTPStatus.FORBIDDEN, "this server answers to its own page only")
        key, slash, what = self.path.removeprefix("/").partition("/")
        if not slash or not hmac.compare_digest(key.encode(), self.server.key_of(what).encode()):
            raise RefusalError(
                HTTPStatus.FORBIDDEN, f"open the very address that figtrack {self.server.command} printed"
            )
        return what


def nothing_here() -> RefusalError:
    """The refusal of a request for something that does not exist."""
    return RefusalError(HTTPStatus.NOT_FOUND, "there is nothing here by this name")


def show(address: str) -> None:
    """Open a page, unless the only browser would run in the terminal."""
    try:
        browser = webbrowser.get()
    except webbrowser.Error:
        return
    in_terminal = isinstance(browser, webbrowser.GenericBrowser)
    if not in_terminal or isinstance(browser, webbrowser.BackgroundBrowser):
        browser.open(address)
