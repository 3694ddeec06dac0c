"""The page of a folder of films: its content, running commands, and the page's requests.

Films, marks and runs are looked up by the names of the films in the folder; no path comes from a request.
"""

import re
import secrets
from http import HTTPStatus
from pathlib import Path
from threading import Lock
from typing import Any
from urllib.parse import unquote

from pydantic import BaseModel

from tracker.annotate.loopback import LoopbackHandler, LoopbackServer, RefusalError, nothing_here
from tracker.desk.work import EXPORTS, Asked, Film, Work, check_apart, films, words_for
from tracker.report.document import POLICY, Document
from tracker.report.thumbnail import thumbnail
from tracker.run.folder import FolderError
from tracker.run.read import FILM, REPORT

POLL = 0.1  # seconds between checks for an interrupt
WIDTH = 800  # pixels of a film's picture, at most
MOST_SENT = 8 * 2**20  # largest part of a clip sent at a time, bytes
STYLES, SCRIPTS = ("annotate/base.css", "desk/desk.css"), ("annotate/asking.js", "desk/desk.js")
PAGE = Document("desk/desk.html", STYLES, SCRIPTS)
NEEDS_RUN = ("correct", "export")


class StopAsked(BaseModel):
    """A request to stop the command on a film."""

    film: str


class Desk:
    """A folder of films and the running commands, one a film."""

    def __init__(self, folder: Path, browser: bool) -> None:
        """Args: browser: whether the commands may open pages. Raises FolderError if there is no folder."""
        if not folder.is_dir():
            raise FolderError(f"{folder} is no folder; give one with films in it")
        self.folder, self._browser = folder.absolute(), browser
        self._works: dict[str, Work] = {}
        self._pictures: dict[tuple[Path, float], bytes] = {}
        self._lock = Lock()

    def told(self) -> dict[str, Any]:
        """Every film with its results and its running command."""
        rows = []
        for name, film in films(self.folder).items():
            work = self._works.get(name)
            rows.append(film.told() | {"work": None if work is None else work.told()})
        return {"folder": str(self.folder), "films": rows, "formats": list(EXPORTS)}

    def film(self, name: str) -> Film:
        """The film with this name; raises RefusalError if there is none."""
        found = films(self.folder).get(name)
        if found is None:
            raise RefusalError(HTTPStatus.NOT_FOUND, f"there is no film {name!r} in {self.folder}")
        return found

    def start(self, asked: Asked) -> None:
        """Start a command.

        Raises:
            RefusalError: one is already running on the film, or a needed run is missing.
            FolderError: another film has the same places for its results.
        """
        film = self.film(asked.film)
        check_apart(film)
        if asked.command in NEEDS_RUN and film.told()["run"] is None:
            raise RefusalError(HTTPStatus.CONFLICT, f"{film.name} was not followed yet; follow it first")
        with self._lock:
            work = self._works.get(film.name)
            if work is not None and work.running:
                raise RefusalError(
                    HTTPStatus.CONFLICT, f"'{work.words[0]}' is still at work on {film.name}; stop it first"
                )
            self._works[film.name] = Work(words_for(asked, film, self._browser), self.folder)

    def stop(self, name: str | None = None) -> None:
        """Stop the running command on a film, or on all films."""
        for of, work in list(self._works.items()):
            if name in (None, of) and work.running:
                work.stop()

    def picture(self, film: Film) -> bytes:
        """A frame of a film as a small JPEG; raises VideoError if it cannot be read."""
        key = film.path, film.path.stat().st_mtime
        if key not in self._pictures:
            self._pictures[key] = thumbnail(film.path, WIDTH)
        return self._pictures[key]


class Server(LoopbackServer):
    """Serves a desk."""

    def __init__(self, desk: Desk, port: int = 0) -> None:
        super().__init__(Handler, port, "app")
        self.desk = desk
        self.shown = secrets.token_urlsafe(24)

    def key_of(self, what: str) -> str:
        """The key of a run's files is another one: they may come from anywhere, and scripts see addresses."""
        return self.shown if what.startswith("run/") else self.key


class Handler(LoopbackHandler):
    """Answers one request of the page of a folder of films."""

    server: Server

    def get(self, what: str) -> None:
        """Send the page, the state of the folder, or a picture, report or clip by the name of its film."""
        desk = self.server.desk
        kind, _, rest = what.partition("?")[0].partition("/")  # a query only avoids the browser's cache
        if what == "":
            self.answer_page(PAGE, desk.told() | {"shown": self.server.shown})
        elif what == "state":
            self.answer(desk.told())
        elif kind in ("picture", "people", "run"):
            name, _, file = rest.partition("/")
            self._show(desk.film(unquote(name)), kind, file)
        else:
            raise nothing_here()

    def post(self, what: str) -> None:
        if what == "start":
            self.server.desk.start(self.body(Asked))
        elif what == "stop":
            self.server.desk.stop(self.body(StopAsked).film)
        else:
            raise nothing_here()
        self.answer(self.server.desk.told())

    def _show(self, film: Film, kind: str, file: str) -> None:
        if kind == "picture":
            self.send(HTTPStatus.OK, self.server.desk.picture(film), "image/jpeg", {})
        elif kind == "people":
            self.send(HTTPStatus.OK, film.people.with_suffix(".png").read_bytes(), "image/png", {})
        elif file == REPORT:
            # A folder may come from anywhere, so its report is isolated from this page and all others.
            alone = {
                "Content-Security-Policy": f"sandbox allow-scripts allow-downloads allow-modals; {POLICY}"
            }
            self.send(HTTPStatus.OK, (film.run / file).read_bytes(), "text/html; charset=utf-8", alone)
        elif file == FILM:
            self._send_part(film.run / file)
        else:
            raise nothing_here()

    def _send_part(self, path: Path) -> None:
        """Send the part of a film that a player requests, or all of it."""
        size, asked = path.stat().st_size, self.headers.get("Range")
        part = asked and _part(asked, size)
        first, last = part or (0, size - 1)
        about = {
            "Accept-Ranges": "bytes",
            "Cross-Origin-Resource-Policy": "cross-origin",  # the report is an origin of its own
        }
        if part:
            about["Content-Range"] = f"bytes {first}-{last}/{size}"
        status = HTTPStatus.PARTIAL_CONTENT if part else HTTPStatus.OK
        with path.open("rb") as clip:
            clip.seek(first)
            pieces = (clip.read(min(MOST_SENT, last + 1 - at)) for at in range(first, last + 1, MOST_SENT))
            self.stream(status, pieces, last + 1 - first, "video/mp4", about)


def _part(asked: str, size: int) -> tuple[int, int] | None:
    """The first and last byte of the requested part of a file, at most MOST_SENT; None for another kind of
    request, which all of it answers (RFC 9110, section 14.2). RefusalError: the file has no such part."""
    named = re.fullmatch(r"bytes=(\d{0,15})-(\d{0,15})", asked)
    if named is None or named[0] == "bytes=-":
        return None
    start, end = named.groups()
    first = int(start) if start else max(size - int(end), 0)
    last = min(int(end) if start and end else size - 1, size - 1, first + MOST_SENT - 1)
    if first > last:
        raise RefusalError(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, f"the clip has {size} bytes")
    return first, last


def open_desk(folder: Path, port: int, browser: bool) -> None:
    """Serve the page of a folder until Ctrl-C, which also stops running commands. FolderError: no such
    folder, or the port is taken."""
    desk = Desk(folder, browser)
    with Server(desk, port) as server:
        print(f"the films of {folder} at {server.address}")
        print("this ends with Ctrl-C here", flush=True)
        if browser:
            server.show()
        try:
            server.serve_forever(poll_interval=POLL)
        except KeyboardInterrupt:
            print("stopped")
        finally:
            desk.stop()
