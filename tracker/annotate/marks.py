"""A keypoints table that is opened, extended and saved; untouched rows stay unchanged."""

import csv
import io
from collections.abc import Mapping
from pathlib import Path

from kinematics.figure import Figure
from kinematics.figure_file import WALKER
from tracker.run.folder import FolderError, fresh_file
from tracker.tables.keypoints import COLUMNS, KeypointsError, Mark, Marks, read_keypoints

VISIBLE = "visible"


class Table:
    """The table behind a marking session.

    A row with an unchanged mark keeps its text and its further columns. A row with a changed mark loses them,
    since they belong to the old mark.

    path   : of the file
    figure : whose joints are marked
    marks  : as last saved or read
    """

    def __init__(
        self, path: Path, *, overwrite: bool = False, begin: Marks | None = None, figure: Figure = WALKER
    ) -> None:
        """Open the table of a figure's joints; a new or replaced one is empty or begins with `begin`.

        KeypointsError: a file that is no keypoints table.
        """
        self.path, self.figure = path, figure
        self.marks: Marks = {}
        self._header, self._rows = [*COLUMNS, VISIBLE], list[list[str]]()
        self._found = path.read_bytes() if path.exists() else None
        if self._found is not None and not overwrite:
            try:
                self.marks = read_keypoints(path, figure.marks, figure.joints)
            except KeypointsError as error:
                raise KeypointsError(
                    f"{error}; repair it, give another --out, or start anew with --overwrite"
                ) from error
            lines = csv.reader(io.StringIO(self._found.decode("utf-8-sig"), newline=""))
            header, *self._rows = [row for row in lines if any(cell.strip() for cell in row)]
            self._header = [name.strip() for name in header]
            if VISIBLE not in self._header:  # cells beyond the header would come to stand below it
                self._rows = [row[: len(self._header)] for row in self._rows]
                self._header.append(VISIBLE)
        elif begin is not None:
            self.marks = begin
            self._rows = [self._row(t, name, of[name]) for t, of in sorted(begin.items()) for name in of]

    def save(self, changed: Mapping[int, Mapping[str, Mark]]) -> None:
        """Replace all marks of these frames in the table, and write it. FolderError: the file was changed by
        another program, cannot be written, or nothing is marked."""
        marks = {frame: dict(of) for frame, of in {**self.marks, **changed}.items() if of}
        if not marks:
            raise FolderError("no joint is marked in any frame; mark one at least")
        if self.path.exists() and self.path.read_bytes() != self._found:
            raise FolderError(
                f"{self.path} was changed by another program since it was opened here; nothing was "
                "written over it. Keep this page open, move that file away and save again"
            )
        rows = [row for row in self._rows if self._frame(row) not in changed]
        rows += [
            self._row(frame, name, of[name])
            for frame, of in changed.items()
            for name in self.figure.marks
            if name in of
        ]
        rows.sort(key=self._frame)
        text = io.StringIO(newline="")
        csv.writer(text, lineterminator="\n").writerows([self._header, *rows])
        content = text.getvalue().encode("utf-8")
        with fresh_file(self.path, overwrite=True) as aside:
            aside.write_bytes(content)
        self.marks, self._rows, self._found = marks, rows, content

    def _frame(self, row: list[str]) -> int:
        try:
            return int(float(self._cell(row, "frame")))
        except (ValueError, OverflowError):  # a row without a position may contain any text
            return -1

    def _cell(self, row: list[str], column: str) -> str:
        at = self._header.index(column)
        return row[at].strip() if at < len(row) else ""

    def _row(self, frame: int, name: str, mark: Mark) -> list[str]:
        if self.marks.get(frame, {}).get(name) == mark:
            for row in self._rows:
                if self._frame(row) == frame and self._cell(row, "keypoint") == name and self._cell(row, "x"):
                    return row
        cells = {
            "frame": str(frame),
            "keypoint": name,
            "x": _pixel(mark.x),
            "y": _pixel(mark.y),
            VISIBLE: str(int(mark.visible)),
        }
        return [cells.get(column, "") for column in self._header]


def _pixel(value: float) -> str:
    """A coordinate, so exactly that a mark nobody touches stays the same."""
    return f"{value + 0.0:.10g}"
