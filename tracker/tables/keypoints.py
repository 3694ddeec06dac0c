"""The keypoints table of marked joints. Pixels, (0, 0) the centre of the top-left one."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from kinematics.figure_file import WALKER
from tracker.tables.table import Layout, finite, write_table

KEYPOINTS = WALKER.marks
COLUMNS = ("frame", "keypoint", "x", "y")
FARTHEST = 1e6  # pixels; no picture is as large
LAST = 10**8  # frame; no clip is as long


class KeypointsError(ValueError):
    """A keypoints table that cannot be used."""


LAYOUT = Layout(
    error=KeypointsError,
    name="keypoints table",
    header="frame,keypoint,x,y,visible",
    needed=COLUMNS,
    known=(*COLUMNS, "visible"),
    absent="no keypoints file {path}; mark the joints and give the table's name",
)


@dataclass(frozen=True)
class Mark:
    """One marked joint: pixel, and whether it was seen or estimated."""

    x: float
    y: float
    visible: bool = True


Marks = dict[int, dict[str, Mark]]


def read_keypoints(path: str | Path, names: Iterable[str] = KEYPOINTS) -> Marks:
    """Marks of every frame in a table `frame,keypoint,x,y[,visible]`; rows without a position are left out.

    KeypointsError: no such file, not such a table, an unknown joint, or a cell that is no finite number.
    """
    known = tuple(names)
    marks: Marks = {}
    for where, row in LAYOUT.rows(path):
        _read_row(marks, row, known, where)
    if not marks:
        raise KeypointsError(f"{path} has no marked joints; mark one frame at least")
    return marks


def write_marks(path: Path, marks: Marks) -> None:
    """Write such a table."""
    rows = [
        (frame, name, f"{mark.x:.2f}", f"{mark.y:.2f}", int(mark.visible))
        for frame, of_frame in marks.items()
        for name, mark in of_frame.items()
    ]
    write_table(path, (*COLUMNS, "visible"), rows)


def points(marks: Mapping[str, Mark]) -> dict[str, tuple[float, float]]:
    """Positions alone."""
    return {name: (mark.x, mark.y) for name, mark in marks.items()}


def hidden(marks: Mapping[str, Mark]) -> frozenset[str]:
    """Names of the joints that were guessed, not seen."""
    return frozenset(name for name, mark in marks.items() if not mark.visible)


def _read_row(marks: Marks, row: Mapping[str, str], known: tuple[str, ...], where: str) -> None:
    name = row["keypoint"]
    if name not in known:
        raise KeypointsError(f"{where}: unknown joint {name!r}; known are {', '.join(known)}")
    if row["x"] == row["y"] == "":
        return
    cells = {column: row[column] for column in ("frame", "x", "y")} | {"visible": row.get("visible") or "1"}
    numbers = {column: _number(text, column, where) for column, text in cells.items()}
    frame = int(numbers["frame"])
    if frame != numbers["frame"] or frame < 0:
        raise KeypointsError(f"{where}: frame must be a whole number from 0; got {cells['frame']!r}")
    for column, most in (("frame", LAST), ("x", FARTHEST), ("y", FARTHEST)):
        if abs(numbers[column]) > most:
            raise KeypointsError(f"{where}: {column} {cells[column]} is out of all range; correct it")
    if numbers["visible"] not in (0.0, 1.0):
        raise KeypointsError(f"{where}: visible must be 1, 0 or empty; got {cells['visible']!r}")
    of_frame = marks.setdefault(frame, {})
    if name in of_frame:
        raise KeypointsError(f"{where}: {name} of frame {frame} is marked twice; keep one of the two")
    of_frame[name] = Mark(numbers["x"], numbers["y"], numbers["visible"] == 1.0)


def _number(text: str, column: str, where: str) -> float:
    value = finite(text)
    if math.isnan(value):
        raise KeypointsError(f"{where}: {column} must be a finite number; got {text!r}")
    return value
