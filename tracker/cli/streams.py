"""Standard streams that always exist; stderr never fails."""

import io
import os
import sys
from typing import Any

from tracker.progress import plain


class _Unfailing(io.FileIO):
    """Discards output that cannot be written, on a full disk or to a closed pipe."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError:
            return len(data)


class _Plain(io.TextIOWrapper):
    """Writes control characters, which names of files may contain, as Python escapes."""

    def write(self, text: str) -> int:
        super().write("\n".join(map(plain, text.split("\n"))))
        return len(text)


def open_streams() -> None:
    """Make the standard streams usable, however the command was started.

    Output to a closed stream is discarded; otherwise the next opened file would get its number, and a library
    that prints would write into that file. Progress and warnings must not stop the work, so errors of stderr
    are ignored. Errors of stdout, which takes results, are not.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            try:
                os.fstat(number)
            except OSError:
                os.open(os.devnull, os.O_RDWR)  # gets the lowest free number
            setattr(sys, name, open(os.devnull, "r+" if number == 0 else "w", encoding="utf-8"))  # noqa: SIM115
    # A file's name may have letters that the terminal's encoding lacks, which must not be an error.
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
