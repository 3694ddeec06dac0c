"""What is wrong with a text table that cannot be read at all, in words for whoever made it."""

from collections.abc import Sequence
from pathlib import Path

SEPARATORS = {";": "semicolons", "\t": "tabs"}  # what spreadsheets write where commas are for decimals


def unreadable(path: str | Path, error: Exception) -> str:
    """One line on a table that `OSError`, `UnicodeDecodeError` or `csv.Error` keeps from being read."""
    return f"cannot read {path} as a UTF-8 CSV table ({why(error)}); save it as one"


def why(error: Exception) -> str:
    """What kept a text file from being read, without what Python adds."""
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start} is no UTF-8"
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def misread(path: str | Path, header: Sequence[str]) -> str | None:
    """One line on a header in which something else than commas stands between the columns, else None."""
    for mark, word in SEPARATORS.items():
        if len(header) == 1 and mark in header[0]:
            return f"{path} has {word} between its columns; write commas, and points within numbers"
    return None
