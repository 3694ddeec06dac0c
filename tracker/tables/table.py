"""CSV tables with a header: one reader, with one-line errors, and one writer."""

import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from kinematics.text_file import ordinary, why, without_commas


@dataclass(frozen=True)
class Layout:
    """A kind of table: its columns, and the wording of its errors.

    error  : type of the exceptions
    name   : of such a table, as in "no pose table"
    header : the usual one
    needed : required columns
    known  : columns that are read; none may occur twice
    absent : message for a missing file, {path}
    misfit : message for a row with too many cells, {cells} for {columns}; "" to ignore surplus cells
    whole  : whether a row with too few cells is an error too; otherwise the missing ones are empty
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
        """The place of each row, as in "poses.csv line 2", and its cells by column, without empty rows.

        Raises `error`: no such file, another kind of table, or a row that does not fit the header.
        """
        try:
            lines = read_lines(path)
            _, header = next(lines, (0, []))
            self._check_header(header, path)
            for number, cells in lines:
                where = f"{path} line {number}"
                columns = len(header)
                short = self.whole and len(cells) < columns
                if self.misfit and (short or any(cells[columns:])):
                    raise self.error(f"{where} {self.misfit.format(cells=len(cells), columns=columns)}")
                yield where, by_column(header, cells)
        except FileNotFoundError as error:
            raise self.error(self.absent.format(path=path)) from error
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise self.error(
                f"cannot read {path} as a UTF-8 CSV table ({why(error)}); save it as one"
            ) from error

    def number(self, text: str, column: str, where: str, most: float, *, empty: bool = False) -> float:
        """The number in a cell, of magnitude `most` at most; NaN for an empty cell if `empty` allows it.
        Raises `error`."""
        value = finite(text)
        if math.isnan(value) and (text or not empty):
            wanted = "a finite number or empty" if empty else "a finite number"
            raise self.error(f"{where}: {column} must be {wanted}; got {text!r}")
        if abs(value) > most:
            advice = "correct or empty it" if empty else "correct it"
            raise self.error(f"{where}: {column} {text} is out of all range; {advice}")
        return value

    def frame(self, text: str, where: str, most: float) -> int:
        """The frame number in a cell; raises as `number`."""
        value = self.number(text, "frame", where, most)
        if value < 0 or value != int(value):
            raise self.error(f"{where}: frame must be a whole number from 0; got {text!r}")
        return int(value)

    def _check_header(self, header: Sequence[str], path: str | Path) -> None:
        if said := without_commas(header, path):
            raise self.error(said)
        for column in self.needed:
            if column not in header:
                raise self.error(
                    f"{path} is no {self.name}: column {column!r} is missing; the header is {self.header}"
                )
        for column in self.known:
            if header.count(column) > 1:
                raise self.error(f"{path} has two columns {column!r}; name one of them otherwise")


def read_lines(path: str | Path) -> Iterator[tuple[int, list[str]]]:
    """Line number and stripped cells of every row that is not empty, beginning with the header.

    OSError, UnicodeDecodeError, csv.Error: a file that cannot be read.
    """
    with ordinary(Path(path)).open(newline="", encoding="utf-8-sig") as file:
        reader = csv.reader(file)
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any("\0" in cell for cell in cells):
                raise csv.Error(f"line {reader.line_num} contains NUL")  # like older versions of Python
            if any(cells):
                yield reader.line_num, cells


def by_column(header: Sequence[str], cells: Sequence[str]) -> dict[str, str]:
    """A row's cells by the names of their columns; "" for missing ones."""
    return dict.fromkeys(header, "") | dict(zip(header, cells, strict=False))


def finite(text: str) -> float:
    """The number in a cell; NaN if it is no number or infinite."""
    try:
        value = float(text.replace("_", "?"))  # Python would read 1_0 as ten
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def write_table(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a UTF-8 table with commas; bytes of file names that are no UTF-8 are escaped."""
    with path.open("w", newline="", encoding="utf-8", errors="backslashreplace") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(rows)
