"""The keypoints table of marked joints; in pixels, (0, 0) is the centre of the top-left one."""

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from kinematics.figure_file import WALKER
from tracker.tables.table import Layout, write_table

KEYPOINTS = WALKER.marks
COLUMNS = ("frame", "keypoint", "x", "y")
FARTHEST = 1e6  # largest coordinate, pixels; no picture is so large
LAST = 10**8  # largest frame number; no clip is so long


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


def read_keypoints(
    path: str | Path, names: Collection[str] = KEYPOINTS, others: Collection[str] = ()
) -> Marks:
    """Marks of every frame in a table `frame,keypoint,x,y[,visible]`; rows without a position are left out.

    Rows of `others`, joints that are followed and not marked, are left out as well.

    KeypointsError: no such file, not a keypoints table, an unknown joint, or a cell that is no finite number.
    """
    marks: Marks = {}
    passed = False
    for where, row in LAYOUT.rows(path):
        if row["keypoint"] in names or row["keypoint"] not in others:
            _read_row(marks, row, names, where)
        else:
            passed = True
    if passed and not marks:
        raise KeypointsError(f"{path} has none of the joints that are marked; known are {', '.join(names)}")
    if not marks:
        raise KeypointsError(f"{path} has no marked joints; mark one frame at least")
    return marks


def number_marked(path: Path) -> int:
    """How many frames a table marks; 0 if it cannot be read, of which the command that reads it tells."""
    with suppress(KeypointsError):
        return len(read_keypoints(path))
    return 0


def write_marks(path: Path, marks: Marks) -> None:
    """Write marks as a keypoint table, which `read_keypoints` reads."""
    rows = [
        (frame, name, f"{mark.x:.10g}", f"{mark.y:.10g}", int(mark.visible))
        for frame, of_frame in marks.items()
        for name, mark in of_frame.items()
    ]
    write_table(path, (*COLUMNS, "visible"), rows)


def points(marks: Mapping[str, Mark]) -> dict[str, tuple[float, float]]:
    """Pixel positions of the marks, by joint."""
    return {name: (mark.x, mark.y) for name, mark in marks.items()}


def hidden(marks: Mapping[str, Mark]) -> frozenset[str]:
    """Names of the joints that were guessed, not seen."""
    return frozenset(name for name, mark in marks.items() if not mark.visible)


def _read_row(marks: Marks, row: Mapping[str, str], known: Collection[str], where: str) -> None:
    name = row["keypoint"]
    if name not in known:
        raise KeypointsError(f"{where}: unknown joint {name!r}; known are {', '.join(known)}")
    if row["x"] == row["y"] == "":
        return
    frame = LAYOUT.frame(row["frame"], where, LAST)
    x, y = (LAYOUT.number(row[column], column, where, FARTHEST) for column in ("x", "y"))
    seen = row.get("visible") or "1"
    visible = LAYOUT.number(seen, "visible", where, FARTHEST)
    if visible not in (0.0, 1.0):
        raise KeypointsError(f"{where}: visible must be 1, 0 or empty; got {seen!r}")
    of_frame = marks.setdefault(frame, {})
    if name in of_frame:
        raise KeypointsError(f"{where}: {name} of frame {frame} is marked twice; keep one of the two")
    of_frame[name] = Mark(x, y, visible == 1.0)
