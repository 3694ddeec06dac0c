"""Text files as they are found on a disk: what may be opened, and why one cannot be read."""

import errno
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

SEPARATORS = {";": "semicolons", "\t": "tabs"}  # written by spreadsheets in locales with decimal commas


def ordinary(path: Path) -> Path:
    """The path unchanged; OSError for a pipe or device, which may have no end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError(errno.EINVAL, "no ordinary file", str(path))
    return path


def read_text(path: Path) -> str:
    """A UTF-8 file's text without a byte order mark; raises as `ordinary`, and UnicodeDecodeError."""
    return ordinary(path).read_text(encoding="utf-8-sig")


def read_json(path: Path) -> Any:
    """The content of a JSON file; raises as `ordinary`, and ValueError or RecursionError if it is none.

    Names of films may hold bytes that are no UTF-8, which pydantic's own reader refuses.
    """
    return json.loads(ordinary(path).read_bytes())


def without_commas(header: Sequence[str], path: str | Path) -> str | None:
    """One line if the cells of a table's first line show that its columns are not separated by commas."""
    words = [word for mark, word in SEPARATORS.items() if len(header) == 1 and mark in header[0]]
    if not words:
        return None
    return f"{path} has {words[0]} between its columns; write commas, and points within numbers"


def blanked(text: str) -> str:
    """The text with each stretch of white space as one blank, and none at its ends."""
    return " ".join(text.split())


def why(error: Exception) -> str:
    """Why a text file could not be read or parsed, without Python's additions."""
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start} is no UTF-8"
    if isinstance(error, RecursionError):
        return "nested too deeply"
    said = (error.strerror if isinstance(error, OSError) else None) or str(error)
    return said.partition("; use sys.")[0]  # what a programmer could do about a number that is too long
