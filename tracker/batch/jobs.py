"""The jobs of a batch: a table with a clip and its options in each row, or a folder of films."""

import math
import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from tracker.clip.asked import asked
from tracker.clip.job import Following, Job, Option, bare_name, options
from tracker.progress import Progress
from tracker.tables.keypoints import number_marked
from tracker.tables.table import Layout, finite
from videos.frames import FILM_SUFFIXES, films_in

OPTIONS = {option.shown: option for option in options()}
HEADER = "video,keypoints,start,model,out"
COLUMNS = ("video", "keypoints", *OPTIONS, "out")
FLAGS = {"1": True, "0": False}


class JobsError(ValueError):
    """A table of jobs that cannot be used."""


LAYOUT = Layout(
    error=JobsError,
    name="table of jobs",
    header=HEADER,
    needed=("video",),
    known=COLUMNS,
    absent="no table of jobs {path}; check its name",
    misfit="has more cells than the header; quote a name that has a comma",
)


@dataclass(frozen=True)
class Row:
    """One row of the table, with absolute paths; the named files are not checked yet.

    keypoints : None to find the walker
    """

    video: Path
    keypoints: Path | None
    out: Path
    how: Following

    @property
    def inputs(self) -> list[Path | None]:
        return [self.video, self.keypoints, *self.how.inputs]

    def job(self) -> Job:
        """The job of the row; raises as `tracker.clip.asked.asked`."""
        return asked(self.how, self.video, self.keypoints, None, Progress("quiet"))


def read_jobs(jobs: Path, place: Path, progress: Progress) -> list[Row]:
    """The rows of a table, or a row for each film of a folder; results are relative to `place`.

    Warns of missing files and unknown columns. JobsError: no such file, not a table of jobs, no rows, an
    invalid cell, results inside one another, or a folder without films.
    """
    rows = _films(jobs, place) if jobs.is_dir() else _rows(jobs, place, progress)
    _check_apart(rows, jobs, place)
    for row in rows:
        for path in row.inputs:
            if path is not None and not path.exists():
                progress.warn(f"there is no {path}; {row.video.name} will fail")
    return rows


def _films(folder: Path, place: Path) -> list[Row]:
    """A row for each film, with the marks that `figtrack annotate` left beside it, if any; through all marked
    frames."""
    rows, films = [], films_in(folder)
    stems = Counter(video.stem for video in films)
    for video in films:
        marks, alone = video.with_name(f"{video.stem}.keypoints.csv"), stems[video.stem] == 1
        if not alone and marks.exists():
            raise JobsError(f"{marks} may be of any film {video.stem}; rename these films and the marks")
        how = Following(anchors=number_marked(marks) > 1)
        out = _out(video) if alone else f"{video.name}-track"
        rows.append(Row(video, marks if marks.exists() else None, place / out, how))
    if not rows:
        raise JobsError(
            f"{folder} has no films ({', '.join(FILM_SUFFIXES)}); give a folder of films or a table of jobs"
        )
    return rows


def _out(video: Path) -> str:
    return f"{bare_name(video)}-track"


def _rows(table: Path, place: Path, progress: Progress) -> list[Row]:
    rows: list[Row] = []
    for where, cells in LAYOUT.rows(table):
        if not rows:
            for name in (name for name in cells if name not in COLUMNS):
                progress.warn(f"column {name!r} of {table.name} is not read; known are {', '.join(COLUMNS)}")
        rows.append(_row(cells, table.absolute().parent, place, where))
    if not rows:
        raise JobsError(f"{table} has no jobs; write a row for each clip below {HEADER}")
    return rows


def _check_apart(rows: list[Row], table: Path, place: Path) -> None:
    """JobsError if a row's results would lie in another's or contain the summary."""
    real = [Path(os.path.realpath(row.out)) for row in rows]
    whole = Path(os.path.realpath(place))
    for row, one in zip(rows, real, strict=True):
        if whole.is_relative_to(one):
            raise JobsError(f"{table}: out {row.out} would hold the whole batch; name a folder inside it")
    # In this order the content of a folder comes right after it.
    for one, other in pairwise(sorted(real, key=lambda path: path.parts)):
        if one == other:
            raise JobsError(f"{table}: two rows have the same out, {one}; give each its own")
        if other.is_relative_to(one):
            raise JobsError(f"{table}: out {one} and out {other} lie in one another; keep them apart")


def _row(cells: Mapping[str, str], beside: Path, place: Path, where: str) -> Row:
    if not cells["video"]:
        raise JobsError(f"{where}: video is empty; every row needs one")
    given = {
        option.name: _value(option, cells[name], beside, where)
        for name, option in OPTIONS.items()
        if cells.get(name)
    }
    video = beside / cells["video"]
    out = place / (cells.get("out") or _out(video))
    keypoints = cells.get("keypoints")
    try:
        how = Following(**given)
    except ValueError as error:
        raise JobsError(f"{where}: {error}") from error
    return Row(video, beside / keypoints if keypoints else None, out, how)


def _value(option: Option, text: str, beside: Path, where: str) -> Any:
    """The value of a cell; files are relative to the table's folder."""
    if option.kind is Path:
        return beside / text
    if option.kind is str:
        return str(beside / text) if text.endswith((".npz", ".toml")) or (beside / text).is_file() else text
    if option.kind in (int, float):
        return _number(option, text, where)
    known = FLAGS if option.kind is bool else {word: option.kind(word) for word in option.words}
    if text not in known:
        raise JobsError(f"{where}: {option.shown} must be {', '.join(known)} or empty; got {text!r}")
    return known[text]


def _number(option: Option, text: str, where: str) -> float:
    least, most = option.about.least or 0, option.about.most
    if option.kind is int:
        if text.isascii() and text.isdigit() and len(text) < 10:
            return int(text)
        raise JobsError(
            f"{where}: {option.shown} must be a whole number from {least}, or empty; got {text!r}"
        )
    number = finite(text)
    if not least <= number <= (most or math.inf):
        raise JobsError(f"{where}: {option.shown} must be from {least:g} to {most:g}, or empty; got {text!r}")
    return number
