"""CSV tables with a header: one reader, which says in one line what is wrong with a table, and one writer."""

import csv
import errno
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

SEPARATORS = {";": "semicolons", "\t": "tabs"}  # what spreadsheets write where commas are for decimals


@dataclass(frozen=True)
class Layout:
    """A kind of table: what it must have, and the words for one that has not.

    error  : raised of whatever is wrong
    name   : of such a table, as in "no pose table"
    header : the usual one
    needed : columns without which it is no such table
    known  : columns that are read; none may stand there twice
    absent : what is said of a file that is not there, {path}
    misfit : what is said of a row with too many cells, {cells} for {columns}; "" to leave those unread
    whole  : whether a row with too few cells is a misfit too; if not, the missing ones are empty
    """

    error: type[ValueError]
    name: str
    header: str
    needed: Sequence[str]
    known: Sequence[str]
    absent: str
    misfit: str = ""
    whole: bool = False

    def rows(self, path: str | Path) -> Iterator[tuple[str, dict[str, str]]]:
        """Where each row stands, as in "poses.csv line 2", and its cells by column; rows of empty cells are
        left out.

        Raises:
            ValueError, as `error`: no such file, not such a table, or a row that does not fit its header.
        """
        try:
            lines = read_lines(path)
            _, header = next(lines, (0, []))
            self._check_header(header, path)
            for number, cells in lines:
                where = f"{path} line {number}"
                self._check_cells(cells, len(header), where)
                yield where, by_column(header, cells)
        except FileNotFoundError as error:
            raise self.error(self.absent.format(path=path)) from error
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise self.error(
                f"cannot read {path} as a UTF-8 CSV table ({why(error)}); save it as one"
            ) from error

    def number(self, text: str, column: str, where: str, most: float, *, empty: bool = False) -> float:
        """The number in a cell, at most so large either way; NaN in one that may be and is `empty`. Raises
        `error`."""
        value = finite(text)
        if math.isnan(value) and (text or not empty):
            wanted = "a finite number or empty" if empty else "a finite number"
            raise self.error(f"{where}: {column} must be {wanted}; got {text!r}")
        if abs(value) > most:
            advice = "correct or empty it" if empty else "correct it"
            raise self.error(f"{where}: {column} {text} is out of all range; {advice}")
        return value

    def frame(self, text: str, where: str, most: float) -> int:
        """The number of a frame; raises as `number`."""
        value = self.number(text, "frame", where, most)
        if value < 0 or value != int(value):
            raise self.error(f"{where}: frame must be a whole number from 0; got {text!r}")
        return int(value)

    def _check_header(self, header: Sequence[str], path: str | Path) -> None:
        for mark, word in SEPARATORS.items():
            if len(header) == 1 and mark in header[0]:
                raise self.error(
                    f"{path} has {word} between its columns; write commas, and points within numbers"
                )
        for column in self.needed:
            if column not in header:
                raise self.error(
                    f"{path} is no {self.name}: column {column!r} is missing; the header is {self.header}"
                )
        for column in self.known:
            if header.count(column) > 1:
                raise self.error(f"{path} has two columns {column!r}; name one of them otherwise")

    def _check_cells(self, cells: Sequence[str], columns: int, where: str) -> None:
        short = self.whole and len(cells) < columns
        if self.misfit and (short or any(cells[columns:])):
            raise self.error(f"{where} {self.misfit.format(cells=len(cells), columns=columns)}")


def read_lines(path: str | Path) -> Iterator[tuple[int, list[str]]]:
    """Line number and cells, without spaces around them, of every row that is not empty, the header's first.
    OSError, UnicodeDecodeError, csv.Error: what cannot be read."""
    with ordinary(Path(path)).open(newline="", encoding="utf-8-sig") as file:
        reader = csv.reader(file)
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any("\0" in cell for cell in cells):
                raise csv.Error(f"line {reader.line_num} contains NUL")  # as Python's older readers say
            if any(cells):
                yield reader.line_num, cells


def read_text(path: Path) -> str:
    """A UTF-8 file's text, without the mark that some editors put first; raises as `ordinary`."""
    return ordinary(path).read_text(encoding="utf-8-sig")


def ordinary(path: Path) -> Path:
    """The path itself; OSError for a pipe or device, which may have no end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError(errno.EINVAL, "no ordinary file", str(path))
    return path


def by_column(header: Sequence[str], cells: Sequence[str]) -> dict[str, str]:
    """A row's cells by the names of their columns; "" where the row has ended."""
    return dict.fromkeys(header, "") | dict(zip(header, cells, strict=False))


def finite(text: str) -> float:
    """The number in a cell; NaN where it is none, or infinite."""
    try:
        value = float(text.replace("_", "?"))  # Python reads 1_0 as ten
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def write_table(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """A UTF-8 table with commas; of a file's name what is no text is written out."""
    with path.open("w", newline="", encoding="utf-8", errors="backslashreplace") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(rows)


def why(error: Exception) -> str:
    """What kept a text file from being read, without what Python adds."""
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start} is no UTF-8"
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
