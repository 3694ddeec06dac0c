"""Text files of other programs, read with one-line errors, and written."""

import csv
import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from kinematics.text_file import ordinary, why


class ForeignError(ValueError):
    """Another program's file that cannot be read, or one that the program could not read."""


@contextmanager
def opened(path: Path) -> Iterator[TextIO]:
    """The file opened as UTF-8 text. ForeignError, also while it is read: no such file, an unreadable one, or
    no text."""
    try:
        with ordinary(path).open(newline="", encoding="utf-8-sig") as file:
            yield file
    except FileNotFoundError as error:
        raise ForeignError(f"no file {path}; check its name") from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ForeignError(f"cannot read {path} as text ({why(error)}); export it again") from error


@contextmanager
def laid_out(path: Path, kind: str, advice: str = "export it again") -> Iterator[None]:
    """In this block loaded data are unpacked; errors of a wrong layout become ForeignError."""
    try:
        yield
    except ForeignError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        raise ForeignError(f"{path} is no {kind} that can be read ({error}); {advice}") from error


def load_rows(path: Path, delimiter: str = ",") -> list[list[str]]:
    """The cells of every row that is not empty; ForeignError if it is no text."""
    with opened(path) as file:
        return [row for row in csv.reader(file, delimiter=delimiter) if row]


def write_rows(path: Path, rows: Iterable[Iterable[object]], delimiter: str = ",") -> None:
    """Write a text table as other programs do, with Unix line ends; bytes that are no UTF-8 are escaped."""
    with path.open("w", newline="", encoding="utf-8", errors="backslashreplace") as file:
        csv.writer(file, delimiter=delimiter, lineterminator="\n").writerows(rows)


def load_json(path: Path) -> Any:
    """The content of a JSON file; ForeignError if it is none."""
    with opened(path) as file:
        try:
            return json.load(file)
        except (ValueError, RecursionError) as error:
            raise ForeignError(f"{path} is no JSON file ({why(error)}); export it again") from error
