"""One command run, perhaps killed, and what is wrong with how it ended."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np

from tests.tracker.clips import everything

MOST_MEMORY = 2**30  # bytes resident, of the command or any process that it started
MOST_SECONDS = 300.0
GRACE = 15.0  # seconds in which processes that it started end after it
ROOT = Path(__file__).parents[3]
FIGTRACK = (sys.executable, "-m", "tracker")
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL)
# What Python, its libraries or FFmpeg say of themselves.
JARGON = re.compile(r"Traceback|Exception ignored|Segmentation|core dumped|@ 0x|Warning:|Fatal Python")
OURS = re.compile(r'__main__\.py", line \d+, in (main|__call__)$', re.MULTILINE)
KEPT = re.compile(r"\.suggested\.keypoints\.csv$")  # a refusal leaves it on purpose


@dataclass(frozen=True)
class Kill:
    """A signal, and after how many seconds it comes."""

    number: signal.Signals
    after: float


@dataclass(frozen=True)
class Ending:
    """How a command ended.

    status  : exit status, or the negative number of the signal that ended it
    memory  : bytes resident at most, of it or of any process that it waited for
    late    : whether it had to be stopped after MOST_SECONDS
    orphans : processes that it started and left running
    """

    words: Sequence[str]
    kill: Kill | None
    status: int
    out: str
    errors: str
    seconds: float
    memory: int
    late: bool
    orphans: int


def run(words: Sequence[str], folder: Path, kill: Kill | None, program: Sequence[str] = FIGTRACK) -> Ending:
    """Run a command in a folder, in a session of its own."""
    began = time.monotonic()
    with (folder.parent / "out").open("w+b") as out, (folder.parent / "errors").open("w+b") as errors:
        process = subprocess.Popen(
            [*program, *words],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=errors,
            start_new_session=True,
            # A shell that starts this in the background hides Ctrl-C from it.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler) and None,
        )
        status, used, late = _awaited(process.pid, began, kill)
        seconds = time.monotonic() - began
        process.returncode = status  # it is waited for already
        orphans = _orphans(process.pid)
        text = [_read(out), _read(errors)]
    return Ending(words, kill, status, *text, seconds, used, late, orphans)


def faults(ending: Ending, folder: Path, before: dict[Path, bytes]) -> Iterator[str]:
    """What is wrong with the end of a command in a folder that held `before`, as `everything` tells it."""
    yield from _of_process(ending)
    if ending.status in (0, 1, 2) and not _of_python(ending):
        yield from _of_words(ending)
    if ending.status != -signal.SIGKILL:
        yield from (f"{path} is left over" for path in leftovers(folder))
    yield from _of_files(folder, before)
    if ending.kill is None and ending.status and ending.words[0] != "batch":
        after = everything(folder)
        changed = [path for path in sorted(before | after) if before.get(path) != after.get(path)]
        yield from (f"{path} is changed by a refusal" for path in changed if not KEPT.search(path.name))


def leftovers(folder: Path) -> list[Path]:
    """What is made aside, under names that end in .part."""
    return [path.relative_to(folder) for path in sorted(folder.rglob("*.part"))]


def _awaited(pid: int, began: float, kill: Kill | None) -> tuple[int, int, bool]:
    """Status, bytes resident, and whether it had to be stopped."""
    late = sent = False
    while True:
        ended, status, usage = os.wait4(pid, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status), usage.ru_maxrss * 1024, late
        seconds = time.monotonic() - began
        if kill is not None and not sent and seconds >= kill.after:
            os.kill(pid, kill.number)
            sent = True
        if seconds > MOST_SECONDS and not late:
            os.killpg(pid, signal.SIGKILL)
            late = True
        time.sleep(0.01)


def _orphans(session: int) -> int:
    """How many processes of a session are there still; they are ended."""
    until = time.monotonic() + GRACE
    while _members(session) and time.monotonic() < until:
        time.sleep(0.1)
    left = _members(session)
    for pid in left:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return len(left)


def _members(session: int) -> list[int]:
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with suppress(OSError, IndexError, ValueError):
            state, _, _, of = (place / "stat").read_text().rpartition(")")[2].split()[:4]
            if int(of) == session and state != "Z":
                found.append(int(place.name))
    return found


def _read(file: object) -> str:
    file.seek(0)  # type: ignore[attr-defined]
    return file.read().decode("utf-8", "replace")  # type: ignore[attr-defined]


def _of_process(ending: Ending) -> Iterator[str]:
    # An interrupted Python may end itself by SIGINT after it has told so.
    allowed = {0, 1, 2} | (set() if ending.kill is None else {-ending.kill.number, -signal.SIGINT})
    if ending.late:
        yield f"it had not ended after {MOST_SECONDS:g} s"
    elif ending.status not in allowed:
        yield f"exit status {ending.status}"
    if ending.memory > MOST_MEMORY:
        yield f"it took {ending.memory / 2**20:.0f} MiB"
    if ending.orphans:
        yield f"{ending.orphans} processes that it started did not end"
    found = JARGON.search(ending.out + ending.errors)
    if found and ending.status != -signal.SIGKILL and not _of_python(ending):
        yield f"it says {found.group()!r}"


def _of_python(ending: Ending) -> bool:
    """Whether Python itself was interrupted, before `main` began and took signals into its own hands."""
    interrupted = ending.kill is not None and "KeyboardInterrupt" in ending.errors
    return interrupted and not OURS.search(ending.errors)


def _of_words(ending: Ending) -> Iterator[str]:
    lines = ending.errors.splitlines()
    said = [text for text in lines if text.startswith("error: ")]
    table = ending.words[0] == "batch" and "failed" in ending.out
    wanted = int(ending.status == 1 and not table)
    if len(said) != wanted:
        yield f"{len(said)} lines of error with status {ending.status}"
    if ending.status == 2 and not ending.errors.startswith("Usage:"):
        yield "status 2 without its usage"
    if "--quiet" in ending.words and ending.status != 2:
        others = [text for text in lines if not text.startswith(("error: ", "warning: "))]
        yield from (f"a quiet command says {text[:80]!r}" for text in others[:1])


def _of_files(folder: Path, before: dict[Path, bytes]) -> Iterator[str]:
    """Files under their final names that were not there before and cannot be read."""
    for path, content in everything(folder).items():
        aside = any(part.endswith(".part") for part in path.parts)
        if aside or before.get(path) == content:
            continue
        try:
            _check(folder / path)
        except Exception as error:
            yield f"{path} is not whole ({type(error).__name__}: {error})"


def _check(path: Path) -> None:
    """Read a file to its end; any exception where that fails."""
    read = READERS.get(path.suffix, lambda path: path.read_bytes())
    read(path)
    if not path.stat().st_size:
        raise ValueError("it is empty")


def _table(path: Path) -> None:
    header, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
    if not path.read_text(encoding="utf-8").endswith("\n"):
        raise ValueError("its last line has no end")
    if any(len(row) != len(header) for row in rows):
        raise ValueError("its rows are not equally long")


def _archive(path: Path) -> None:
    with np.load(path) as arrays:
        for name in arrays.files:
            arrays[name]


def _film(path: Path) -> None:
    with av.open(str(path)) as container:
        count = sum(1 for _ in container.decode(video=0))
        if count < container.streams.video[0].frames:
            raise ValueError("frames are missing")


def _page(path: Path) -> None:
    if not path.read_text(encoding="utf-8").rstrip().endswith("</html>"):
        raise ValueError("it has no end")


READERS = {
    ".csv": _table,
    ".json": lambda path: json.loads(path.read_text(encoding="utf-8")),
    ".toml": lambda path: tomllib.loads(path.read_text(encoding="utf-8")),
    ".npz": _archive,
    ".mp4": _film,
    ".png": _film,
    ".html": _page,
}
