"""DeepLabCut's CSV: rows scorer, (individuals,) bodyparts, coords, then one row a frame or labelled image."""

from itertools import islice
from pathlib import Path

import numpy as np

from dynamics.gaussian import Array
from tracker.foreign.people import People, Person, frame_number, person
from tracker.foreign.points import Points
from tracker.foreign.text_files import ForeignError, load_rows, opened, write_rows

SCORER = "figtrack"
COORDS = ("x", "y", "likelihood")
HEADS = ("scorer", "individuals", "bodyparts", "coords")

Column = tuple[str, str, str]  # individual ("" if the file has none), body part, coordinate


def write_dlc(points: Points, path: Path) -> None:
    """Write every point of every frame in the layout of DeepLabCut; missing points are empty cells."""
    J = len(points.names)
    header = (
        ["scorer", *[SCORER] * (J * len(COORDS))],
        ["bodyparts", *(name for name in points.names for _ in COORDS)],
        ["coords", *COORDS * J],
    )
    body = (
        [t, *(cell for place, p in zip(places, sure, strict=True) for cell in _cells(place, p))]
        for t, (places, sure) in enumerate(zip(points.places, points.likelihood, strict=True))
    )
    write_rows(path, [*header, *body])


def is_dlc(head: str) -> bool:
    """Whether a file's first line has this layout."""
    return head.partition(",")[0].strip('" \r\n') == HEADS[0]


def has_parts(path: Path) -> bool:
    """Whether one of the first rows names body parts."""
    with opened(path) as file:
        return any(line.partition(",")[0].strip('" ') == "bodyparts" for line in islice(file, len(HEADS)))


def read_people(path: Path) -> People:
    """All people in the table, by frame, which is the first cell of a row or the number in its image's name.

    ForeignError: another kind of table, a row that does not fit its header, or a frame given twice.
    """
    rows = load_rows(path)
    heads = {row[0]: row for row in rows[: len(HEADS)] if row[0] in HEADS}
    if not {"scorer", "bodyparts", "coords"} <= heads.keys():
        raise ForeignError(
            f"{path} is no DeepLabCut table: its first rows must begin with scorer, bodyparts, coords; "
            "export it again"
        )
    columns, front = _columns(heads, path)
    people: People = {}
    for row in rows[len(heads) :]:
        frame = _frame(row[:front], path)
        if frame in people:
            raise ForeignError(f"{path} has two rows of frame {frame}; give a table of one video")
        try:
            numbers = [float(cell or "nan") for cell in row[front:]]
            cells = dict(zip(columns, numbers, strict=True))
        except ValueError as error:
            raise ForeignError(f"{path}, frame {frame}: {error}; export it again") from error
        found = [_person(cells, who) for who in dict.fromkeys(who for who, _, _ in columns)]
        people[frame] = [seen for seen in found if seen]
    return people


def _cells(place: Array, p: float) -> tuple[str, str, str]:
    x, y = place
    return (f"{x:.3f}", f"{y:.3f}", f"{p:.4f}") if np.isfinite(x) else ("", "", "")


def _columns(heads: dict[str, list[str]], path: Path) -> tuple[list[Column], int]:
    """The content of each column, and how many precede the first: labelled images have two more."""
    parts, coords = heads["bodyparts"], heads["coords"]
    whose = heads.get("individuals", [""] * len(parts))
    if not len(parts) == len(coords) == len(whose):
        raise ForeignError(f"{path}: its header rows differ in length; export it again")
    front = next((i for i, cell in enumerate(parts) if i and cell), len(parts))
    columns = list(zip(whose[front:], parts[front:], coords[front:], strict=True))
    wanted = {(who, part, axis) for who, part, _ in columns for axis in "xy"}
    if len(set(columns)) < len(columns) or not wanted <= set(columns):
        raise ForeignError(f"{path}: every body part needs one column x and one y; export it again")
    return columns, front


def _frame(front: list[str], path: Path) -> int:
    cell = next((cell for cell in reversed(front) if cell), "")
    frame = None if cell.startswith("-") else frame_number(cell)
    if frame is None:
        raise ForeignError(f"{path}: a row begins with {front[0]!r}, which names no frame; export it again")
    return frame


def _person(cells: dict[Column, float], who: str) -> Person:
    parts = {}
    for (owner, part, axis), x in cells.items():
        if owner == who and axis == "x":
            sure = cells.get((who, part, "likelihood"), np.nan)
            # Data without confidence are written without a likelihood.
            parts[part] = x, cells[who, part, "y"], 1.0 if np.isnan(sure) else sure
    return person(parts)
