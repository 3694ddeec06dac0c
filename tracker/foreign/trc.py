"""TRC, the marker table of OpenSim: metres for OpenSim itself, pixels for Sports2D.

Five rows of header, then a row a frame: its number from 1, its time, x, y, z of every marker, three times
`nan` for a missing one. In metres x points ahead and y up (`tracker.foreign.scale`), in pixels x right and y
down; z is 0.
"""

from pathlib import Path

import numpy as np

from dynamics.gaussian import Array
from tracker.foreign.people import People, Person, person, triples
from tracker.foreign.points import Points
from tracker.foreign.scale import Scale
from tracker.foreign.text_files import ForeignError, load_rows, write_rows

KEYS = (
    "DataRate",
    "CameraRate",
    "NumFrames",
    "NumMarkers",
    "Units",
    "OrigDataRate",
    "OrigDataStartFrame",
    "OrigNumFrames",
)
MAGIC = "PathFileType"
HEADER = 5  # rows of the header


def write_trc(points: Points, times: Array, fps: float, scale: Scale | None, path: Path) -> None:
    """Write markers in metres, or in pixels without a scale; those of likelihood 0 are missing."""
    places, units = (points.known, "px") if scale is None else (scale.to_metres(points.known), "m")
    T, rate, names = len(times), f"{fps:.6f}", points.names
    header = (
        (MAGIC, "4", "(X/Y/Z)", path.name),
        KEYS,
        (rate, rate, T, len(names), units, rate, 1, T),
        ("Frame#", "Time", *(cell for name in names for cell in (name, "", "")), ""),
        ("", "", *(f"{axis}{n}" for n in range(1, len(names) + 1) for axis in "XYZ"), ""),
    )
    body = (
        (t + 1, f"{times[t]:.6f}", *(cell for place in row for cell in _cells(place)))
        for t, row in enumerate(places)
    )
    write_rows(path, [*header, *body], "\t")


def is_trc(head: str) -> bool:
    """Whether the beginning of a file has this layout."""
    return head.startswith(MAGIC)


def read_people(path: Path) -> People:
    """The markers of a TRC file in pixels, one person a row. ForeignError: another layout, or metres.

    The first row's frame is its time times the header's rate; the others follow it.
    """
    rows = load_rows(path, "\t")
    if len(rows) <= HEADER or rows[0][0] != MAGIC:
        raise ForeignError(
            f"{path} is no TRC file: it must begin with {MAGIC} and hold a frame; export it again"
        )
    header = dict(zip(rows[1], rows[2], strict=False))
    units = header.get("Units", "")
    if units.strip().lower() != "px":
        raise ForeignError(f"{path} is in {units or 'no'} units; markers on a picture must be in px")
    names = [name.strip() for name in rows[3][2:] if name.strip()]
    body = [row for row in rows[HEADER:] if any(cell.strip() for cell in row)]
    try:
        first = round(float(body[0][1]) * float(header.get("DataRate", "no DataRate")))
        markers = ([float(cell or "nan") for cell in row[2 : 2 + 3 * len(names)]] for row in body)
        return {t: [_person(names, row)] for t, row in enumerate(markers, first)}
    except (IndexError, OverflowError, ValueError) as error:
        raise ForeignError(f"{path}: {error}; a row is a frame, a time and three numbers a marker") from error


def _person(names: list[str], numbers: list[float]) -> Person:
    return person({name: (x, y) for name, (x, y, _) in triples(names, numbers).items()})


def _cells(place: Array) -> tuple[str, str, str]:
    x, y = place
    return (f"{x:.6f}", f"{y:.6f}", f"{0.0:.6f}") if np.isfinite(x) else ("nan", "nan", "nan")
