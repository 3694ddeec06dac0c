"""The pose table: `seq,frame,` root in leg lengths, angles in degrees, and what may stand beside them."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from kinematics.mocap import POSE_COLUMNS
from tracker.sampling import Array

ROOT_COLUMNS = 2  # root_x and root_y, which some uses can do without


Rows = dict[str, dict[int, tuple[Array, str]]]


class PosesError(ValueError):
    """A pose table that cannot be used."""


@dataclass(frozen=True)
class PoseSequence:
    """One sequence of a pose table.

    name   : its `seq`, "0" where the table has none
    first  : frame of the first row
    y      : (T, 8) in body units, angles in radians; NaN where nothing was given
    labels : (T,) of each frame, "" where none was given
    """

    name: str
    first: int
    y: Array
    labels: tuple[str, ...]

    def runs(self) -> list[tuple[str, Array]]:
        """Label and poses of every stretch of one label without a gap."""
        kinds = list(zip(self.labels, (bool(np.isfinite(row).all()) for row in self.y), strict=True))
        cuts = [0, *(t for t in range(1, len(kinds)) if kinds[t] != kinds[t - 1]), len(kinds)]
        return [(kinds[a][0], self.y[a:b]) for a, b in pairwise(cuts) if kinds[a][1]]


def read_poses(path: str | Path) -> list[PoseSequence]:
    """Every sequence of a pose table, in the order of the file; frames left out become rows of NaN.

    Raises:
        PosesError: no such file, not such a table, a cell that is no number, or a frame given twice.
    """
    rows: Rows = {}
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            wanted = ("frame", *POSE_COLUMNS[ROOT_COLUMNS:])
            missing = [column for column in wanted if column not in (reader.fieldnames or ())]
            if missing:
                raise PosesError(
                    f"{path} is no pose table: column {missing[0]!r} is missing; "
                    f"the header is seq,frame,{','.join(POSE_COLUMNS)}"
                )
            for row in reader:
                _read_row(rows, row, f"{path} line {reader.line_num}")
    except FileNotFoundError as error:
        raise PosesError(f"no pose table {path}; check its name") from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise PosesError(f"cannot read {path} as a UTF-8 CSV table: {error}") from error
    if not rows:
        raise PosesError(f"{path} has no poses; give a table with one row a frame")
    return [_sequence(name, frames) for name, frames in rows.items()]


def _read_row(rows: Rows, row: Mapping[str, str | None], where: str) -> None:
    frame = _number(row.get("frame"), "frame", where)
    if not frame >= 0 or frame != int(frame):
        raise PosesError(f"{where}: frame must be a whole number from 0; got {row.get('frame')!r}")
    pose = np.array([_number(row.get(column), column, where) for column in POSE_COLUMNS])
    pose[ROOT_COLUMNS:] = np.radians(pose[ROOT_COLUMNS:])
    frames = rows.setdefault((row.get("seq") or "0").strip(), {})
    if int(frame) in frames:
        raise PosesError(f"{where}: frame {int(frame)} is given twice; number frames within each seq")
    frames[int(frame)] = pose, (row.get("label") or "").strip()


def _number(text: str | None, column: str, where: str) -> float:
    """The number in a cell, NaN for an empty one."""
    if not (text or "").strip():
        return np.nan
    try:
        value = float(str(text))
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise PosesError(f"{where}: {column} must be a finite number or empty; got {text!r}")
    return value


def _sequence(name: str, frames: Mapping[int, tuple[Array, str]]) -> PoseSequence:
    first, last = min(frames), max(frames)
    gap = np.full(len(POSE_COLUMNS), np.nan), ""
    rows = [frames.get(frame, gap) for frame in range(first, last + 1)]
    return PoseSequence(name, first, np.stack([pose for pose, _ in rows]), tuple(label for _, label in rows))
