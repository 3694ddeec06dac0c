"""The films of a folder with their results, and a running figtrack command on one of them.

The command runs in its own process and is the same as typed in a terminal.
"""

import csv
import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import IO, Any, Literal

from pydantic import BaseModel, Field

from tracker.annotate.session import IN_APP
from tracker.foreign.export import FORMATS
from tracker.run.folder import FolderError
from tracker.run.read import REPORT, START, News, RunError, read_news
from tracker.tables.keypoints import number_marked
from tracker.tables.table import by_column, read_lines
from videos.frames import films_in

EXPORTS = ("all", *FORMATS)
PATIENCE = 10.0  # seconds that a command has to stop
REST = 0.5  # seconds to read the rest of each output of a command that has ended
KILLED = "error: the system ended the command, perhaps for lack of memory"
TOLD = ("person", "first", "last", "facing", "motion")


@dataclass(frozen=True)
class Film:
    """A film and the places of its results: beside it, under the commands' default names."""

    path: Path

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def marks(self) -> Path:
        """The table that `annotate` writes."""
        return self._beside(".keypoints.csv")

    @property
    def people(self) -> Path:
        """The table that `find` writes; its picture has the same name with .png."""
        return self._beside("-people.csv")

    @property
    def run(self) -> Path:
        """Folder of the run of this film."""
        return self._beside("-track")

    def told(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "marked": self.marks.exists(),
            "people": _people(self.people),
            "run": self._told_run(),
        }

    @property
    def taken(self) -> bool:
        """Whether the run's folder has a run of another film whose name differs only in its ending."""
        news = self._news()
        return news is not None and Path(news.video).name != self.name

    def _told_run(self) -> dict[str, Any] | None:
        """The summary of its complete run, None without one."""
        news = None if self.taken else self._news()
        if news is None:
            return None
        report = (self.run / REPORT).exists()
        how = {"facing": news.facing, "height": news.height, "corrected": self._corrected(news)}
        return {"headline": news.headline, "warnings": news.warnings, "report": report} | how

    def _corrected(self, news: News) -> int:
        """In how many frames the run passes through marks that are neither found nor beside the film."""
        ours = _places(self.run / START) if news.options.get("anchors") else set()
        frames = {mark[0] for mark in ours} & {mark[0] for mark in ours ^ _places(self.marks)}
        began = news.start if isinstance(news.start, dict) and news.start.get("marks") == "found" else {}
        return sum(frame != began.get("frame") for frame in frames)

    def _news(self) -> News | None:
        with suppress(RunError, OSError):
            return read_news(self.run)
        return None

    def _beside(self, ending: str) -> Path:
        return self.path.with_name(self.path.stem + ending)


def films(folder: Path) -> dict[str, Film]:
    """The films now in a folder, by name; names that are no valid text are left out."""
    return {path.name: Film(path) for path in films_in(folder) if path.name.isprintable()}


def check_apart(film: Film) -> None:
    """FolderError if another film of the folder has the same places for its results."""
    same = [name for name, other in films(film.path.parent).items() if other.run == film.run]
    if len(same) > 1:
        raise FolderError(f"{' and '.join(same)} have the same out, {film.run.name}; rename one of them")


class Asked(BaseModel):
    """A command that the page requests.

    film   : its name
    person : number of the person to follow, None for the only one
    near   : the nearer leg in the start frame, None to find it
    facing : of the person, None to find it
    height : of the person, metres
    marked : whether to start from the marks beside the film
    to     : format of an export
    """

    film: str
    command: Literal["find", "track", "annotate", "correct", "export"]
    person: int | None = Field(None, ge=1)
    near: Literal["ahead", "behind"] | None = None
    facing: Literal["left", "right"] | None = None
    height: float | None = Field(None, ge=0.3, le=3.0)
    marked: bool = False
    to: Literal[EXPORTS] | None = None  # type: ignore[valid-type]


def words_for(asked: Asked, film: Film, browser: bool) -> list[str]:
    """The words of the requested command line, as typed in the folder of the film."""
    words: list[str] = [asked.command]
    match asked.command:
        case "find":
            words += [_here(film.path), "--out", _here(film.people), "--overwrite"]
        case "track":
            again = [] if film.taken else ["--overwrite"]
            words += [_here(film.path), "--out", _here(film.run), *again, *_how(asked, film)]
        case "annotate":
            words += [_here(film.path), "--out", _here(film.marks), *_given({"--facing": asked.facing})]
        case "correct":
            words += [_here(film.run)]
        case "export":
            words += [_here(film.run), "--to", asked.to or EXPORTS[0], "--overwrite"]
    page = asked.command in ("annotate", "correct")
    words += ["--no-browser"] * (page and not browser)
    return [*words, "--progress", "json"]


class Work:
    """A running or finished command.

    words : as typed after `figtrack`
    """

    def __init__(self, words: Sequence[str], folder: Path) -> None:
        self.words = list(words)
        self._task: dict[str, Any] | None = None
        self._said: list[str] = []
        self._stopped = False
        command = [sys.executable, "-P", "-m", "tracker", *words]  # -P: the folder holds films, not modules
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            command,
            cwd=folder,
            env=os.environ | {IN_APP: "1"},
            stdin=subprocess.DEVNULL,
            stdout=pipe,
            stderr=pipe,
            text=True,
            errors="replace",
        )
        self._readers = [
            Thread(target=_read, args=heard, daemon=True)
            for heard in ((self._process.stdout, self._said.append), (self._process.stderr, self._hear))
        ]
        for reader in self._readers:
            reader.start()

    @property
    def running(self) -> bool:
        if self._process.poll() is None:
            return True
        self._read_rest()
        return False

    def told(self) -> dict[str, Any]:
        """Command, progress, messages and, once it has ended, exit status."""
        running = self.running
        status = None if running else self._process.returncode
        killed = status is not None and status < 0 and not self._stopped
        return {
            "command": self.words[0],
            "task": self._task if running else None,
            "said": [*self._said, *[KILLED] * killed],
            "status": status,
        }

    def stop(self) -> None:
        """Interrupt the command like Ctrl-C, so that no partial result stays."""
        self._stopped = True
        self._process.terminate()
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._read_rest()

    def _read_rest(self) -> None:
        """Wait once, for a limited time: a browser that the command started may keep its outputs open."""
        readers, self._readers = self._readers, []
        for reader in readers:
            reader.join(REST)

    def _hear(self, line: str) -> None:
        """Process a line: progress as JSON, or plain text that says why the command ended."""
        news = None
        with suppress(ValueError, RecursionError):
            news = json.loads(line)
        if not isinstance(news, dict):
            self._said.append(line)
        elif "task" in news:
            self._task = news
        else:
            self._said += (f"warning: {text}" if kind == "warning" else text for kind, text in news.items())


def _people(table: Path) -> list[dict[str, str]] | None:
    """The people found, None before a search."""
    rows = _rows(table)
    return rows and [{name: row.get(name, "") for name in TOLD} for row in rows]


def _places(table: Path) -> set[tuple[float | str, ...]]:
    """Frame, place, joint and visibility of each mark in a table; none if it cannot be read."""
    with suppress(LookupError, ValueError):
        rows = [row for row in _rows(table) or () if row["x"]]
        numbers = [[float(row[name]) for name in ("frame", "x", "y")] for row in rows]
        return {
            (*n, row["keypoint"], row.get("visible") or "1") for n, row in zip(numbers, rows, strict=True)
        }
    return set()


def _rows(table: Path) -> list[dict[str, str]] | None:
    """The rows of a table by column, None if it cannot be read."""
    with suppress(OSError, ValueError, csv.Error):
        (_, header), *rows = read_lines(table)
        return [by_column(header, cells) for _, cells in rows]
    return None


def _read(stream: IO[str], hear: Callable[[str], object]) -> None:
    with stream:
        for line in stream:
            hear(line.rstrip())


def _how(asked: Asked, film: Film) -> list[str]:
    given: dict[str, object] = {"--person": asked.person, "--near": asked.near}
    if asked.marked:
        given = {"--keypoints": _here(film.marks)}
    given |= {"--facing": asked.facing, "--height": asked.height}
    return _given(given) + ["--anchors"] * (asked.marked and number_marked(film.marks) > 1)


def _given(options: Mapping[str, object]) -> list[str]:
    """The words of those options that have a value."""
    return [str(word) for option, value in options.items() if value is not None for word in (option, value)]


def _here(path: Path) -> str:
    """A file in the command's folder, written so that a leading dash is not taken for an option."""
    return f"./{path.name}" if path.name.startswith("-") else path.name
