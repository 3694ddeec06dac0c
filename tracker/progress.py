"""Progress on stderr: a bar on a terminal, plain lines elsewhere, JSON lines for programs, or nothing."""

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Advance = Callable[[], None]
PLAIN_EVERY = 5.0  # seconds between plain or JSON lines


class Progress:
    """How progress is shown: "bar", "plain", "json" or "quiet"; "auto" is a bar on a terminal, else plain."""

    def __init__(self, style: str = "auto") -> None:
        self.style = ("bar" if sys.stderr.isatty() else "plain") if style == "auto" else style

    @contextmanager
    def task(self, name: str, total: int | None) -> Iterator[Advance]:
        """Call what is given once a step; total None where the number of steps is not known."""
        if self.style == "bar":
            with _bar(name, total) as advance:
                yield advance
        elif self.style == "quiet":
            yield lambda: None
        else:
            lines = _Lines(name, total, self.style == "json")
            yield lines.advance
            lines.write()

    def say(self, text: str) -> None:
        """One line of news."""
        if self.style == "json":
            print(json.dumps({"message": text}), file=sys.stderr, flush=True)
        elif self.style != "quiet":
            print(text, file=sys.stderr, flush=True)


class _Lines:
    def __init__(self, name: str, total: int | None, as_json: bool) -> None:
        self.name, self.total, self.as_json = name, total, as_json
        self.done, self.began = 0, time.monotonic()
        self.written = self.began

    def advance(self) -> None:
        self.done += 1
        if time.monotonic() - self.written > PLAIN_EVERY:
            self.write()

    def write(self) -> None:
        self.written = time.monotonic()
        seconds = self.written - self.began
        left = (
            None
            if self.total is None or not self.done
            else seconds / self.done * max(self.total - self.done, 0)
        )
        if self.as_json:
            news = {"task": self.name, "done": self.done, "total": self.total, "seconds": round(seconds, 2)}
            print(json.dumps(news | {"seconds_left": left and round(left, 1)}), file=sys.stderr, flush=True)
        else:
            of = "" if self.total is None else f" of {self.total}"
            more = f", {left:.0f} s left" if left and left > 1.0 else ""
            print(f"{self.name}: {self.done}{of} in {seconds:.0f} s{more}", file=sys.stderr, flush=True)


@contextmanager
def _bar(name: str, total: int | None) -> Iterator[Advance]:
    from rich import progress
    from rich.console import Console

    columns = (
        progress.TextColumn("{task.description}"),
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TimeRemainingColumn(),
    )
    with progress.Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(name, total=total)
        yield lambda: bar.advance(task)
