"""A run's folder read back: what its tables and run.json say of a clip, a row a frame."""

import csv
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, PositiveFloat, PositiveInt, ValidationError

from dynamics.gaussian import Array
from kinematics.figure import ROOT, SCALE, Figure
from kinematics.figure_file import WALKER
from kinematics.spm import View
from tracker.loop.outcome import Outcome
from tracker.run.track import Track
from tracker.tables.table import by_column, ordinary, read_lines, why

RUN_FILES = ("run.json", "keypoints.csv", "pose.csv", "track.npz", "overlay.mp4")
POINT_COLUMNS = ("x", "y", "sxx", "sxy", "syy")
BESIDE = ("seq", "frame", "time_s", "state", "label", "outcome")  # columns of pose.csv that are no freedom


class RunError(ValueError):
    """A folder that holds no complete run, or one that cannot be read."""


class News(BaseModel):
    """What run.json says that others read.

    size   : width and height of a frame, pixels
    height : of the person, metres; scale: pixels a metre; None where it was not given
    """

    model_config = ConfigDict(allow_inf_nan=False)

    figtrack: str
    video: str
    fps: PositiveFloat
    frames: PositiveInt
    facing: Literal["left", "right"]
    size: tuple[PositiveInt, PositiveInt] | None = None
    rate: float | None = None
    height: PositiveFloat | None = None
    scale: PositiveFloat | None = None
    warnings: list[str] = []
    headline: str = ""
    job: str = ""


@dataclass(frozen=True)
class Record:
    """A finished run of T frames from frame 0 on; NaN where the figure was not followed.

    news    : what run.json says
    times   : (T,) seconds
    names   : (J,) keypoints, also those that the figure has not
    places  : (T, J, 2) pixels
    covs    : (T, J, 2, 2) px^2
    freedoms: (M,) names of root and angles
    poses   : (T, M) root in leg lengths, angles in radians
    outcome : (T,) of each frame, None where the figure was not followed
    shift   : (T, 2) pixels by which a moving camera has shifted the scene since the start
    unit    : pixels in a leg length at the start
    """

    news: News
    times: Array
    names: tuple[str, ...]
    places: Array
    covs: Array
    freedoms: tuple[str, ...]
    poses: Array
    outcome: tuple[Outcome | None, ...]
    shift: Array
    unit: float

    def __len__(self) -> int:
        return len(self.times)

    @property
    def facing(self) -> int:
        return 1 if self.news.facing == "right" else -1

    @property
    def measured(self) -> NDArray[np.bool_]:
        """(T,) whether the figure was followed, and neither lost nor out of the picture."""
        return np.array([outcome is not None and outcome.measured for outcome in self.outcome])

    def in_scene(self) -> Self:
        """The same run as a camera that stays where it started would have seen it."""
        steady = np.zeros_like(self.shift)
        return replace(self, places=self.places - self.shift[:, None], shift=steady)

    def place(self, name: str) -> Array:
        """(T, 2) pixels of a keypoint; NaN throughout if the figure has none of this name."""
        if name not in self.names:
            return np.full((len(self), 2), np.nan)
        return self.places[:, self.names.index(name)]

    def angle(self, freedom: str) -> Array:
        """(T,) radians of an angle; NaN throughout if the figure has none of this name."""
        if freedom not in self.freedoms:
            return np.full(len(self), np.nan)
        return self.poses[:, self.freedoms.index(freedom)]


def read_news(folder: Path) -> News:
    """What run.json says; RunError: no complete run in this folder."""
    path = folder / "run.json"
    try:
        return News.model_validate_json(ordinary(path).read_bytes())
    except (FileNotFoundError, NotADirectoryError) as error:
        inner = sorted(found.parent.name for found in folder.glob("*/run.json"))
        advice = f"give one of the runs in it, {', '.join(inner)}" if inner else "track a clip first"
        raise RunError(f"{folder} holds no complete run (no run.json); {advice}") from error
    except ValidationError as error:
        first = error.errors()[0]
        fault = " ".join([*map(str, first["loc"]), first["msg"].lower()])
        raise RunError(f"{path} is no run of figtrack ({fault}); track the clip again") from error


def read_run(folder: Path) -> Record:
    """A complete run; RunError: there is none in this folder, or a file in it is damaged."""
    news = read_news(folder)
    with _sound(folder / "keypoints.csv") as path:
        names, numbers = _points(path, news.frames)
    with _sound(folder / "pose.csv") as path:
        times, freedoms, poses, outcome = _poses(path, news.frames)
    with _sound(folder / "track.npz") as path:
        shift, unit = _shift(path, news.frames)
        moving = _archive(path, ())[0]["freedoms"]
    with _sound(folder / "pose.csv"):
        if set(freedoms) != set(moving[: moving.index(SCALE)]):
            raise ValueError(f"its columns are not those of {', '.join(moving[: moving.index(SCALE)])}")
    return Record(
        news=news,
        times=times,
        names=names,
        places=numbers[..., :2],
        covs=numbers[..., [2, 3, 3, 4]].reshape(*numbers.shape[:2], 2, 2),
        freedoms=freedoms,
        poses=poses,
        outcome=outcome,
        shift=shift,
        unit=unit,
    )


@contextmanager
def _sound(path: Path) -> Iterator[Path]:
    """A file that is to be read; RunError if what is in it is not what a run leaves."""
    try:
        yield path
    except (OSError, ValueError, KeyError, IndexError, TypeError, csv.Error) as error:
        lacks = f"there is no {error.args[0]!r}" if isinstance(error, KeyError) else why(error)
        raise RunError(f"{path} is damaged ({lacks}); track the clip again") from error


def _points(path: Path, T: int) -> tuple[tuple[str, ...], Array]:
    """Names (J,) and numbers (T, J, 5) of keypoints.csv."""
    rows = _rows(path)
    names = tuple(dict.fromkeys(row["keypoint"] for row in rows))
    whole = bool(rows) and len(rows) == T * len(names)
    wanted = ((t, name) for t in range(T) for name in names)
    if not whole or any(
        (int(row["frame"]), row["keypoint"]) != one for row, one in zip(rows, wanted, strict=True)
    ):
        raise ValueError(f"it should hold every keypoint of {T} frames, in order")
    return names, _numbers(rows, POINT_COLUMNS).reshape(T, len(names), len(POINT_COLUMNS))


def _poses(path: Path, T: int) -> tuple[Array, tuple[str, ...], Array, tuple[Outcome | None, ...]]:
    """Times (T,), names (M,) and poses (T, M) in body units, and outcomes (T,) of pose.csv."""
    rows = _rows(path)
    if len(rows) != T or any(int(row["frame"]) != t for t, row in enumerate(rows)):
        raise ValueError(f"it should hold {T} frames, in order")
    times = _numbers(rows, ["time_s"])[:, 0]
    if not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
        raise ValueError("time_s should rise from row to row")
    angles = [name for name in rows[0] if name not in (*BESIDE, *ROOT)]
    poses = np.hstack([_numbers(rows, ROOT), np.radians(_numbers(rows, angles))])
    outcome = tuple(Outcome(row["outcome"]) if row["outcome"] else None for row in rows)
    return times, (*ROOT, *angles), poses, outcome


def read_track(folder: Path, mark: float, figure: Figure = WALKER) -> Track:
    """The track of a complete run of this figure, at rest; `mark` is the setting of that name. RunError: a
    file is damaged."""
    with _sound(folder / "track.npz") as path:
        header, rows = _archive(path, ("times", "q", "cov", "s", "motions", "outcome", "shift"))
        *origin, unit, facing = header["view"]
        return Track(
            figure=figure.with_lengths(header["lengths"]),
            view=View((origin[0], origin[1]), unit, facing),
            model=header["model"],
            labels=tuple(header["labels"]),
            misnamed=header["misnamed"],
            first=header["first"],
            motions=tuple(rows.pop("motions").tolist()),
            outcome=tuple(rows.pop("outcome").tolist()),
            mark=mark,
            **rows,
        )


def _shift(path: Path, frames: int) -> tuple[Array, float]:
    """(T, 2), zero in frames that were not followed; and pixels in a leg length."""
    header, rows = _archive(path, ("shift",))
    first, followed = header["first"], rows["shift"]
    shift = np.zeros((frames, 2))
    shift[first : first + len(followed)] = followed
    return shift, float(header["view"][2])


def _archive(path: Path, names: Sequence[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The header and these arrays of track.npz."""
    try:
        with ordinary(path).open("rb") as file, np.load(file) as track:
            return json.loads(str(track["header"])), {name: track[name] for name in names}
    except OSError:
        raise
    except Exception as error:  # damaged bytes fail in zipfile, zlib, numpy or json, each in its own ways
        raise ValueError("it is no archive that can be read") from error


def _rows(path: Path) -> list[dict[str, str]]:
    lines = read_lines(path)
    _, header = next(lines, (0, []))
    return [by_column(header, cells) for _, cells in lines]


def _numbers(rows: list[dict[str, str]], columns: Sequence[str]) -> Array:
    """(rows, columns), NaN for an empty cell."""
    numbers = np.array([[float(row[column] or "nan") for column in columns] for row in rows])
    if np.isinf(numbers).any():
        raise ValueError("a number is infinite")
    return numbers
