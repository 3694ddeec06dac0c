"""Standard streams that are there and, for what is only told on the way, that never fail."""

import io
import os
import sys
from typing import Any

from tracker.progress import plain


class _Unfailing(io.FileIO):
    """Drops what cannot be written: a disk that is full or a reader that hung up."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError:
            return len(data)


class _Plain(io.TextIOWrapper):
    """Writes what moves a terminal's cursor, which names of files may hold, the way Python writes it."""

    def write(self, text: str) -> int:
        super().write("\n".join(map(plain, text.split("\n"))))
        return len(text)


def open_streams() -> None:
    """Make the standard streams usable, however the command was started.

    What is written to a stream that was closed goes nowhere; left closed, its number would be given to the
    next file, and a library that prints would write into that. Progress and warnings never keep the work from
    being done, so nothing that stderr cannot take is an error. Results that stdout cannot take are.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            try:
                os.fstat(number)
            except OSError:
                os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
            setattr(sys, name, open(os.devnull, "r+" if number == 0 else "w", encoding="utf-8"))  # noqa: SIM115
    # A file's name may have letters that this terminal has not, which is no reason to fail.
    if isinstance(sys.stdout, io.TextIOWrapper):
        encoding, terminal = sys.stdout.encoding, sys.stdout.isatty()
        sys.stdout = _Plain(
            sys.stdout.detach(), encoding=encoding, errors="backslashreplace", line_buffering=terminal
        )
    if isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr = io.TextIOWrapper(
            io.BufferedWriter(_Unfailing(sys.stderr.fileno(), "w", closefd=False)),
            encoding=sys.stderr.encoding,
            errors="backslashreplace",
            line_buffering=True,
        )
