"""Progress on stderr: a bar on a terminal, plain lines elsewhere, JSON lines for programs, or nothing.

`counted` and `tally` put counts into words, here and in summaries.
"""

import json
import math
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import TypeVar

Item = TypeVar("Item")
Advance = Callable[[], None]
EVERY = {"plain": 5.0, "json": 1.0, "quiet": math.inf}  # seconds between lines


class Progress:
    """How progress is shown: "bar", "plain", "json" or "quiet"; "auto" is a bar on a terminal, else plain.

    name, done, total : of the last task, and its steps; total None if unknown
    """

    def __init__(self, style: str = "auto") -> None:
        terminal = sys.stderr is not None and sys.stderr.isatty()
        self.style = ("bar" if terminal else "plain") if style == "auto" else style
        self.name, self.done = "", 0
        self.total: int | None = None

    @contextmanager
    def task(self, name: str, total: int | None) -> Iterator[Advance]:
        """A task whose yielded function is to be called once a step; total None if it is unknown."""
        self.name, self.done, self.total = name, 0, total
        with _bar(name, total) if self.style == "bar" else self._lines() as show:

            def step() -> None:
                self.done += 1
                show()

            yield step

    def through(self, name: str, items: Iterable[Item], total: int | None) -> Iterator[Item]:
        """The items, each of them a step of a task."""
        with self.task(name, total) as advance:
            for item in items:
                yield item
                advance()

    def warn(self, text: str) -> None:
        """Print one line, even in a quiet run."""
        self.line({"warning": text}, f"warning: {text}")

    def note(self, text: str) -> None:
        """Print one line, except in a quiet run."""
        if self.style != "quiet":
            self.line({"note": text}, text)

    def line(self, news: Mapping[str, object], text: str) -> None:
        """Print one line, `news` for programs or `text` for people; errors of writing are ignored."""
        if sys.stderr is not None:
            with suppress(OSError):
                print(json.dumps(news) if self.style == "json" else plain(text), file=sys.stderr, flush=True)

    @contextmanager
    def _lines(self) -> Iterator[Advance]:
        """A line every few seconds and one at the end; for programs also one at the start."""
        began = written = time.monotonic()

        def show() -> None:
            nonlocal written
            # The last step is printed at the end.
            if self.done != self.total and time.monotonic() - written > EVERY[self.style]:
                written = self._write(began)

        if self.style == "json":
            self._write(began)
        yield show
        if self.style != "quiet":
            self._write(began)

    def _write(self, began: float) -> float:
        """Print how far the task is, which began at this time; returns the present one."""
        now = time.monotonic()
        seconds, left = now - began, None
        # The first step gives no estimate: it may wait for a compiler or for processes.
        if self.total is not None and self.done > 1:
            left = seconds / self.done * max(self.total - self.done, 0)
        news = {
            "task": self.name,
            "done": self.done,
            "total": self.total,
            "seconds": round(seconds, 2),
            "seconds_left": None if left is None else round(left, 1),
        }
        of = "" if self.total is None else f" of {self.total}"
        more = f", {left:.0f} s left" if left and left > 1.0 else ""
        self.line(news, f"{self.name}: {self.done}{of} in {seconds:.0f} s{more}")
        return now


def plain(text: str) -> str:
    """The text as one line without control characters, which names of files may contain."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def counted(n: int, what: str) -> str:
    """A number of things in words: 1 frame, 2 frames."""
    return f"{n} {what}" + "s" * (n != 1)


def tally(kinds: Iterable[str]) -> str:
    """How many there are of each kind, in words: 118 ok, 2 lost."""
    return ", ".join(f"{n} {kind}" for kind, n in Counter(kinds).items())


@contextmanager
def _bar(name: str, total: int | None) -> Iterator[Advance]:
    from rich import progress
    from rich.console import Console

    columns = (
        progress.TextColumn("{task.description}", markup=False),
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TimeRemainingColumn(),
    )
    with progress.Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(name, total=total)
        yield lambda: bar.advance(task)
