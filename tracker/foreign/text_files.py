"""Foreign text files opened for reading, with one line on what is wrong with them."""

import csv
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from tracker.tables.unreadable import why


class ForeignError(ValueError):
    """A file of another program that cannot be read, or one that it could not read."""


@contextmanager
def opened(path: Path) -> Iterator[TextIO]:
    """The file as UTF-8 text.

    Raises:
        ForeignError: no such file, one that cannot be read, or no text; also while it is read.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            yield file
    except FileNotFoundError as error:
        raise ForeignError(f"no file {path}; check its name") from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ForeignError(f"cannot read {path} as text ({why(error)}); export it again") from error


def load_json(path: Path) -> Any:
    """What a JSON file holds; ForeignError if it is none."""
    with opened(path) as file:
        try:
            return json.load(file)
        except (ValueError, RecursionError) as error:
            raise ForeignError(f"{path} is no JSON file ({error}); export it again") from error
