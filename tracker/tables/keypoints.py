"""The keypoints table of marked joints. Pixels, (0, 0) the centre of the top-left one."""

import csv
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from tracker.tables.unreadable import misread, unreadable

KEYPOINTS = (
    "head_top",
    "neck",
    "hip",
    "near_knee",
    "near_ankle",
    "near_toe",
    "far_knee",
    "far_ankle",
    "far_toe",
)
COLUMNS = ("frame", "keypoint", "x", "y")
FARTHEST = 1e6  # pixels; no picture is as large
LAST = 10**8  # frame; no clip is as long


class KeypointsError(ValueError):
    """A keypoints table that cannot be used."""


@dataclass(frozen=True)
class Mark:
    """One marked joint: pixel, and whether it was seen or estimated."""

    x: float
    y: float
    visible: bool = True


Marks = dict[int, dict[str, Mark]]


def read_keypoints(path: str | Path, names: Iterable[str] = KEYPOINTS) -> Marks:
    """Marks of every frame in a table `frame,keypoint,x,y[,visible]`; rows without a position are left out.

    Raises:
        KeypointsError: no such file, not such a table, an unknown joint, or a cell that is no finite number.
    """
    known = tuple(names)
    marks: Marks = {}
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            header = reader.fieldnames or ()
            if (fault := misread(path, header)) is not None:
                raise KeypointsError(fault)
            missing = [column for column in COLUMNS if column not in header]
            if missing:
                raise KeypointsError(
                    f"{path} is no keypoints table: column {missing[0]!r} is missing; "
                    "the header is frame,keypoint,x,y,visible"
                )
            for row in reader:
                _read_row(marks, row, known, f"{path} line {reader.line_num}")
    except FileNotFoundError as error:
        raise KeypointsError(
            f"no keypoints file {path}; mark the joints and give the table's name"
        ) from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise KeypointsError(unreadable(path, error)) from error
    if not marks:
        raise KeypointsError(f"{path} has no marked joints; mark one frame at least")
    return marks


def points(marks: Mapping[str, Mark]) -> dict[str, tuple[float, float]]:
    """Positions alone."""
    return {name: (mark.x, mark.y) for name, mark in marks.items()}


def _read_row(marks: Marks, row: Mapping[str, str | None], known: tuple[str, ...], where: str) -> None:
    name = (row["keypoint"] or "").strip()
    if name not in known:
        raise KeypointsError(f"{where}: unknown joint {name!r}; known are {', '.join(known)}")
    cells = {column: (row.get(column) or "").strip() for column in ("frame", "x", "y", "visible")}
    if cells["x"] == cells["y"] == "":
        return
    cells["visible"] = cells["visible"] or "1"
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
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise KeypointsError(f"{where}: {column} must be a finite number; got {text!r}")
    return value
