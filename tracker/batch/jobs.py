"""The table of jobs for a batch: a clip a row, and how to follow it."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from tracker.clip.follow import Job
from tracker.progress import Progress
from tracker.settings import Settings, read_settings
from tracker.tables.keypoints import read_keypoints
from tracker.tables.table import Layout

NEEDED = ("video", "keypoints")
COLUMNS = (*NEEDED, "start", "model", "out", "stop", "facing", "rate", "smooth", "anchors", "settings")
HEADER = ",".join(COLUMNS[:5])
MODEL = "walk-run"
RATES = (0.25, 4.0)
FACING = {"": None, "left": -1, "right": 1}
SMOOTH = {"": True, "1": True, "0": False}
ANCHORS = {"": False, "1": True, "0": False}


class JobsError(ValueError):
    """A table of jobs that cannot be used."""


LAYOUT = Layout(
    error=JobsError,
    name="table of jobs",
    header=HEADER,
    needed=NEEDED,
    known=COLUMNS,
    absent="no table of jobs {path}; check its name",
    misfit="has more cells than the header; quote a name that has a comma",
)


@dataclass(frozen=True)
class Row:
    """One row of the table, its paths absolute; the files that it names may still be wrong.

    start, stop, facing, rate, smooth, anchors : as in `Job`
    """

    video: Path
    keypoints: Path
    model: str
    out: Path
    start: int | None
    stop: int | None
    facing: int | None
    rate: float | None
    smooth: bool
    anchors: bool
    settings: Path | None

    @property
    def inputs(self) -> list[Path]:
        """The files that the work reads."""
        model = [Path(self.model)] if Path(self.model).is_file() else []
        return [self.video, self.keypoints, *model, *([] if self.settings is None else [self.settings])]

    def job(self) -> Job:
        """What to follow, and how; raises as `read_keypoints` and `read_settings`."""
        return Job(
            video=self.video,
            marks=read_keypoints(self.keypoints),
            model=self.model,
            settings=Settings() if self.settings is None else read_settings(self.settings),
            start=self.start,
            stop=self.stop,
            facing=self.facing,
            rate=self.rate,
            smooth=self.smooth,
            anchors=self.anchors,
        )


def read_jobs(table: Path, place: Path, progress: Progress) -> list[Row]:
    """The rows of a table: files are relative to it, results to `place`; warns of columns that are not read.

    Raises:
        JobsError: no such file, not such a table, no rows, a cell that cannot be, or results that would lie
            in one another.
    """
    rows: list[Row] = []
    for where, cells in LAYOUT.rows(table):
        if not rows:
            _warn_of_unknown(cells, table, progress)
        rows.append(_row(cells, table.absolute().parent, place, where))
    if not rows:
        raise JobsError(f"{table} has no jobs; write a row for each clip below {HEADER}")
    _check_apart(rows, table, place)
    return rows


def _warn_of_unknown(names: Iterable[str], table: Path, progress: Progress) -> None:
    for name in names:
        if name not in COLUMNS:
            progress.warn(f"column {name!r} of {table.name} is not read; known are {', '.join(COLUMNS)}")


def _check_apart(rows: list[Row], table: Path, place: Path) -> None:
    """No row's results may lie in another's, or hold the summary."""
    real = [Path(os.path.realpath(row.out)) for row in rows]
    for row, one in zip(rows, real, strict=True):
        if Path(os.path.realpath(place)).is_relative_to(one):
            raise JobsError(f"{table}: out {row.out} would hold the whole batch; name a folder inside it")
    for one, other in combinations(real, 2):
        if one == other:
            raise JobsError(f"{table}: two rows have the same out, {one}; give each its own")
        if one.is_relative_to(other) or other.is_relative_to(one):
            raise JobsError(f"{table}: out {one} and out {other} lie in one another; keep them apart")


def _row(cells: Mapping[str, str], beside: Path, place: Path, where: str) -> Row:
    cell = {name: cells.get(name, "") for name in COLUMNS}
    for name in NEEDED:
        if not cell[name]:
            raise JobsError(f"{where}: {name} is empty; every row needs {' and '.join(NEEDED)}")
    for name, known in (("facing", FACING), ("smooth", SMOOTH), ("anchors", ANCHORS)):
        if cell[name] not in known:
            wanted = ", ".join(filter(None, known))
            raise JobsError(f"{where}: {name} must be {wanted} or empty; got {cell[name]!r}")
    video = beside / cell["video"]
    model = cell["model"] or MODEL
    if model.endswith(".npz") or (beside / model).is_file():
        model = str(beside / model)
    return Row(
        video=video,
        keypoints=beside / cell["keypoints"],
        model=model,
        out=place / (cell["out"] or f"{video.stem}-track"),
        start=_frame(cell["start"], "start", where),
        stop=_frame(cell["stop"], "stop", where),
        facing=FACING[cell["facing"]],
        rate=_rate(cell["rate"], where),
        smooth=SMOOTH[cell["smooth"]],
        anchors=ANCHORS[cell["anchors"]],
        settings=beside / cell["settings"] if cell["settings"] else None,
    )


def _frame(text: str, name: str, where: str) -> int | None:
    if text and not (text.isascii() and text.isdigit() and len(text) < 10):
        raise JobsError(f"{where}: {name} must be a whole number from 0, or empty; got {text!r}")
    return int(text) if text else None


def _rate(text: str, where: str) -> float | None:
    if not text:
        return None
    try:
        rate = float(text)
    except ValueError:
        rate = -1.0
    if not RATES[0] <= rate <= RATES[1]:
        raise JobsError(f"{where}: rate must be from {RATES[0]:g} to {RATES[1]:g}, or empty; got {text!r}")
    return rate
