"""The pose table: `seq,frame,` root in leg lengths, angles in degrees, and further columns."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array
from kinematics.direction import gone_back
from kinematics.figure import Figure
from kinematics.figure_file import WALKER
from kinematics.mocap import POSE_COLUMNS
from kinematics.text_file import blanked
from tracker.tables.table import Layout, finite, write_table

ROOT_COLUMNS = 2  # root_x and root_y, which are optional for some uses
BESIDE = ("label", "time_s", "outcome")  # further columns that are read
NO_MOTION = ("cv", "free")  # labels of `track` for frames whose motion is not known
UNSEEN = ("lost", "outside")  # outcomes of `track` for frames that did not show the pose
LONGEST = 1_000_000  # frames from a sequence's first to its last; more is a mistake in the table
GAP = 10_000  # largest number of missing frames in a row, some minutes
LARGEST = 1e9  # magnitude of any cell; sums with larger numbers lose their digits
TURNS = 3600.0  # degrees: larger angles are refused
RADIANS = 3.2  # if all angles are smaller than so many degrees, they probably are radians,
MOVED = 0.2  # provided that the root moved by so many leg lengths, or
MANY = 15  # that so many frames were measured

# Pose in body units, label, seconds, the pose's cells as written, and whether it was lost or outside.
Row = tuple[Array, str, float, tuple[str, ...], bool]
Rows = dict[str, dict[int, Row]]


class PosesError(ValueError):
    """A pose table that cannot be used."""


def layout_of(columns: Sequence[str]) -> Layout:
    """The layout of a table of poses with these columns."""
    return Layout(
        error=PosesError,
        name="pose table",
        header=f"seq,frame,{','.join(columns)}",
        needed=("frame", *columns[ROOT_COLUMNS:]),
        known=("seq", "frame", *columns, *BESIDE),
        absent="no pose table {path}; check its name",
        misfit="has {cells} cells, the header {columns}; empty cells want their commas, numbers a point",
        whole=True,
    )


@dataclass(frozen=True)
class PoseSequence:
    """One sequence of a pose table.

    name   : its `seq`, "0" if the table has none
    first  : frame of the first row
    y      : (T, M) in body units, angles in radians; NaN for empty cells and where the pose was not seen
    labels : (T,) of each frame, "" where no motion was given
    cells  : (T,) each frame's M cells as written, "" for empty ones
    unseen : number of frames whose outcome is lost or outside; they are taken as missing
    fps    : frames a second by the column time_s, None without it
    """

    name: str
    first: int
    y: Array
    labels: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]
    unseen: int
    fps: float | None

    def __len__(self) -> int:
        return len(self.y)

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(T, M) whether each number was measured."""
        return np.isfinite(self.y)

    @property
    def given(self) -> list[str]:
        """The labels of all frames that are in the table, "" for those without one or not seen."""
        labels = [self.labels[t] for t in np.flatnonzero(self.seen.any(axis=1))]
        return labels + [""] * self.unseen

    def order(self, fps: float) -> slice:
        """The frames in order of time, or the last first if the figure goes backwards."""
        back = gone_back(self.y[:, 0], np.arange(len(self)) / fps)
        return slice(None, None, -1 if back[-1] else 1)

    def runs(self) -> list[tuple[str, Array]]:
        """Label and poses of every stretch of one label without a gap."""
        kinds = [(label, bool(seen.all())) for label, seen in zip(self.labels, self.seen, strict=True)]
        return [(kinds[a][0], self.y[a:b]) for a, b in stretches(kinds) if kinds[a][1]]


def stretches(values: Sequence[object]) -> list[tuple[int, int]]:
    """First row and last + 1 of every run of equal values."""
    cuts = [0, *(t for t in range(1, len(values)) if values[t] != values[t - 1]), len(values)]
    return list(pairwise(cuts))


def read_poses(path: str | Path, figure: Figure = WALKER) -> list[PoseSequence]:
    """All sequences of a figure's pose table, in the order of the file; missing frames become rows of NaN,
    as do those that `track` calls lost or outside.

    PosesError: no such file, not a pose table, a cell that is no number, a frame given twice, or a sequence
    whose rows are not contiguous.
    """
    rows: Rows = {}
    columns = figure.learned_freedoms
    layout = layout_of(columns)
    for where, row in layout.rows(path):
        _read_row(rows, row, columns, layout, where)
    if not rows:
        raise PosesError(f"{path} has no poses; give a table with one row a frame")
    return [_sequence(name, frames, path) for name, frames in rows.items()]


def pose_cells(y: Array) -> list[str]:
    """The cells of a pose in body units, the root first; empty for NaN."""
    numbers = [*y[:ROOT_COLUMNS], *np.degrees(y[ROOT_COLUMNS:])]
    places = [5] * ROOT_COLUMNS + [4] * (len(y) - ROOT_COLUMNS)
    return [f"{v:.{n}f}" if np.isfinite(v) else "" for v, n in zip(numbers, places, strict=True)]


def write_poses(path: Path, rows: Iterable[Sequence[object]], further: Sequence[str] = ()) -> None:
    """Write a pose table from rows of seq, frame, the pose's 8 cells and those of `further` columns."""
    write_table(path, ("seq", "frame", *POSE_COLUMNS, *further), rows)


def suspicions(sequences: Sequence[PoseSequence], fps: float) -> list[str]:
    """Warnings about a readable table: angles that look like radians, a frame rate other than `fps`,
    figures that go backwards."""
    said = []
    small = [sequence.name for sequence in sequences if _in_radians(sequence)]
    if small:
        said.append(
            f"every angle of {_named(small)} lies within {RADIANS} degrees although the figure "
            "moves; these may be radians, write degrees"
        )
    back = [sequence.name for sequence in sequences if sequence.order(fps).step < 0]
    if back:
        said.append(f"root_x of {_named(back)} falls, so the figure goes backwards")
    others = [each for each in sequences if each.fps is not None and abs(each.fps / fps - 1.0) > 0.05]
    if others:
        said.append(
            f"time_s of sequence {others[0].name!r} says {others[0].fps:.4g} frames a second, the model "
            f"is taken at {fps:.4g}; give --fps {others[0].fps:.4g} if that is wrong"
        )
    return said


def _read_row(rows: Rows, row: Mapping[str, str], columns: Sequence[str], layout: Layout, where: str) -> None:
    """Add a row to its sequence."""
    frame = layout.frame(row["frame"], where, LARGEST)
    seq = row.get("seq", "0") or "0"
    if seq in rows and seq != next(reversed(rows)):
        raise PosesError(
            f"{where}: sequence {seq!r} ended before and comes again; give each its own name, "
            "and keep its rows together"
        )
    frames = rows.setdefault(seq, {})
    if frame in frames:
        raise PosesError(f"{where}: frame {frame} is given twice; number frames within each seq")
    given = tuple(row.get(name, "") for name in columns)
    largest = [LARGEST] * ROOT_COLUMNS + [TURNS] * (len(columns) - ROOT_COLUMNS)
    cells, label = zip(given, columns, largest, strict=True), blanked(row.get("label", ""))
    pose = np.array([layout.number(text, name, where, most, empty=True) for text, name, most in cells])
    pose[ROOT_COLUMNS:] = np.radians(pose[ROOT_COLUMNS:])
    unseen, time = row.get("outcome") in UNSEEN, finite(row.get("time_s", ""))
    if unseen:
        pose, label, given = np.full_like(pose, np.nan), "", ("",) * len(given)
    frames[frame] = pose, "" if label in NO_MOTION else label, time, given, unseen


def _sequence(name: str, frames: Mapping[int, Row], path: str | Path) -> PoseSequence:
    first, last = min(frames), max(frames)
    if last - first >= LONGEST:
        raise PosesError(
            f"{path}: sequence {name!r} goes from frame {first} to frame {last}; "
            f"at most {LONGEST} frames are read, correct the numbers"
        )
    for before, after in pairwise(sorted(frames)):
        if after - before - 1 > GAP:
            raise PosesError(
                f"{path}: in sequence {name!r} frame {after} comes after frame {before}; at most {GAP} "
                "frames may be left out, correct the numbers or give the rest a seq of its own"
            )
    pose, *_ = frames[first]
    gap = np.full(len(pose), np.nan), "", np.nan, ("",) * len(pose), False
    rows = (frames.get(t, gap) for t in range(first, last + 1))
    poses, labels, times, cells, unseen = zip(*rows, strict=True)
    return PoseSequence(name, first, np.stack(poses), labels, cells, sum(unseen), _fps(np.array(times)))


def _fps(times: Array) -> float | None:
    timed = np.flatnonzero(np.isfinite(times))
    if len(timed) < 2:
        return None
    step = np.median(np.diff(times[timed]) / np.diff(timed))
    return float(1.0 / step) if step > 0 else None


def _named(names: list[str]) -> str:
    return f"sequence {names[0]!r}" + (f" and {len(names) - 1} more" if len(names) > 1 else "")


def _in_radians(sequence: PoseSequence) -> bool:
    angles = np.degrees(sequence.y[:, ROOT_COLUMNS:])
    measured = sequence.seen[:, ROOT_COLUMNS:]
    largest = np.abs(angles[measured]).max(initial=0.0)
    roots = sequence.y[sequence.seen[:, 0], 0]
    moves = measured.any(1).sum() >= MANY or (len(roots) > 1 and np.ptp(roots) > MOVED)
    return bool(0.0 < largest <= RADIANS and moves)
