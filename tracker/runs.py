"""A run's folder read back: what its tables and run.json say of a clip, a row a frame."""

import csv
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, Self
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, PositiveFloat, PositiveInt, ValidationError

from kinematics.mocap import POSE_COLUMNS
from tracker.sampling import Array
from tracker.track import LOST, OUTSIDE

POINT_COLUMNS = ("x", "y", "sxx", "sxy", "syy")


class RunError(ValueError):
    """A folder that holds no complete run, or one that cannot be read."""


class News(BaseModel):
    """What run.json says that others read; a frame's `size` is (width, height) in pixels."""

    figtrack: str
    video: str
    fps: PositiveFloat
    frames: PositiveInt
    facing: Literal["left", "right"]
    size: tuple[PositiveInt, PositiveInt] | None = None
    rate: float | None = None
    warnings: list[str] = []
    job: str = ""


@dataclass(frozen=True)
class Record:
    """A finished run of T frames from frame 0 on; NaN where the figure was not followed.

    news    : what run.json says
    times   : (T,) seconds
    names   : (J,) keypoints, also those that the figure has not
    places  : (T, J, 2) pixels
    covs    : (T, J, 2, 2) px^2
    poses   : (T, 8) root in leg lengths, angles in radians
    outcome : (T,) of each frame, "" where the figure was not followed
    shift   : (T, 2) pixels by which a moving camera has shifted the scene since the start
    """

    news: News
    times: Array
    names: tuple[str, ...]
    places: Array
    covs: Array
    poses: Array
    outcome: tuple[str, ...]
    shift: Array

    def __len__(self) -> int:
        return len(self.times)

    @property
    def facing(self) -> int:
        """+1 if the figure faces right, -1 if left."""
        return 1 if self.news.facing == "right" else -1

    @property
    def sure(self) -> NDArray[np.bool_]:
        """(T,) whether the figure was followed, and neither lost nor out of the picture."""
        return np.array([outcome not in ("", LOST, OUTSIDE) for outcome in self.outcome])

    def in_scene(self) -> Self:
        """The same run as a camera that stays where it started would have seen it."""
        steady = np.zeros_like(self.shift)
        return replace(self, places=self.places - self.shift[:, None], shift=steady)

    def place(self, name: str) -> Array:
        """(T, 2) pixels of a keypoint; NaN throughout if the figure has none of this name."""
        if name not in self.names:
            return np.full((len(self), 2), np.nan)
        return self.places[:, self.names.index(name)]


def read_news(folder: Path) -> News:
    """What run.json says.

    Raises:
        RunError: no complete run in this folder.
    """
    path = folder / "run.json"
    try:
        return News.model_validate_json(path.read_bytes())
    except (FileNotFoundError, NotADirectoryError) as error:
        inner = sorted(found.parent.name for found in folder.glob("*/run.json"))
        advice = f"give one of the runs in it, {', '.join(inner)}" if inner else "track a clip first"
        raise RunError(f"{folder} holds no complete run (no run.json); {advice}") from error
    except ValidationError as error:
        first = error.errors()[0]
        fault = " ".join([*map(str, first["loc"]), first["msg"].lower()])
        raise RunError(f"{path} is no run of figtrack ({fault}); track the clip again") from error


def read_run(folder: Path) -> Record:
    """A complete run.

    Raises:
        RunError: no complete run in this folder, or files in it that are damaged.
    """
    news = read_news(folder)
    try:
        points, poses = list(_rows(folder / "keypoints.csv")), list(_rows(folder / "pose.csv"))
        return _record(news, points, poses, _shift(folder / "track.npz", news.frames))
    except (OSError, ValueError, KeyError, IndexError, TypeError, csv.Error, BadZipFile) as error:
        raise RunError(
            f"the files in {folder} are damaged ({type(error).__name__}: {error}); track the clip again"
        ) from error


def _record(news: News, points: list[dict[str, str]], poses: list[dict[str, str]], shift: Array) -> Record:
    names = tuple(dict.fromkeys(row["keypoint"] for row in points))
    T, J = news.frames, len(names)
    wanted = [(t, name) for t in range(T) for name in names]
    if not J or len(points) != T * J or [(int(row["frame"]), row["keypoint"]) for row in points] != wanted:
        raise ValueError(f"keypoints.csv should hold every keypoint of {T} frames, in order")
    if [int(row["frame"]) for row in poses] != list(range(T)):
        raise ValueError(f"pose.csv should hold {T} frames, in order")
    numbers = _numbers(points, POINT_COLUMNS).reshape(T, J, len(POINT_COLUMNS))
    times = _numbers(poses, ["time_s"])[:, 0]
    if not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
        raise ValueError("the time in pose.csv should rise from row to row")
    body = _numbers(poses, POSE_COLUMNS)
    body[:, 2:] = np.radians(body[:, 2:])
    return Record(
        news=news,
        times=times,
        names=names,
        places=numbers[..., :2],
        covs=numbers[..., [2, 3, 3, 4]].reshape(T, J, 2, 2),
        poses=body,
        outcome=tuple(row["outcome"] for row in poses),
        shift=shift,
    )


def _shift(path: Path, frames: int) -> Array:
    """(T, 2), zero in frames that were not followed."""
    with path.open("rb") as file, np.load(file) as track:
        first, followed = json.loads(str(track["header"]))["first"], track["shift"]
    shift = np.zeros((frames, 2))
    shift[first : first + len(followed)] = followed
    return shift


def _rows(path: Path) -> Iterator[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        yield from csv.DictReader(file)


def _numbers(rows: list[dict[str, str]], columns: tuple[str, ...] | list[str]) -> Array:
    """(rows, columns), NaN for an empty cell."""
    numbers = np.array([[float(row[column] or "nan") for column in columns] for row in rows])
    if np.isinf(numbers).any():
        raise ValueError("a number is infinite")
    return numbers
