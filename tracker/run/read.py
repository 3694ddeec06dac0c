"""A run's folder read back: the contents of track.npz and run.json, a row a frame."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, PositiveFloat, PositiveInt, ValidationError

from dynamics.gaussian import Array
from kinematics.figure import ROOT, SCALE, Figure
from kinematics.spm import UNMOVED, View
from kinematics.text_file import ordinary, read_json, why
from tracker.loop.outcome import Outcome
from tracker.run.track import Track
from tracker.run.write import ROWS, VERSION, whole_times

NEWS, OVERLAY, REPORT, FILM = "run.json", "overlay.mp4", "report.html", "film.mp4"
START = "start.keypoints.csv"  # the marks that the track passes through
RUN_FILES = (NEWS, "keypoints.csv", "pose.csv", "track.npz", "gait.json", OVERLAY)


class RunError(ValueError):
    """A folder that holds no complete run, or one that cannot be read."""


class News(BaseModel, allow_inf_nan=False):
    """The fields of run.json that other modules read.

    size   : width and height of a frame, pixels
    height : of the person, metres; scale: pixels a metre; None if not given
    """

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
    start: Any = None
    options: dict[str, Any] = {}


class Mean(BaseModel, allow_inf_nan=False):
    """A gait figure of a leg or of both in gait.json."""

    mean: float


class Figures(BaseModel, allow_inf_nan=False):
    """The fields of gait.json that other modules read; a figure of a leg is a mean, its unit a text."""

    motion: str = ""
    rate: PositiveFloat
    metres_in_leg: float | None = None
    measures: dict[str, dict[str, Mean | str | None]] = {}

    def mean(self, measure: str, legs: str) -> float | None:
        """The mean over strides; None if there is none of these legs."""
        found = self.measures.get(measure, {}).get(legs)
        return found.mean if isinstance(found, Mean) else None


@dataclass(frozen=True)
class Record:
    """A finished run of T frames from frame 0 on; NaN where the figure was not followed.

    news    : fields of run.json
    times   : (T,) seconds
    names   : (J,) joints of the figure
    places  : (T, J, 2) pixels
    covs    : (T, J, 2, 2) px^2
    freedoms: (M,) names of root and angles
    poses   : (T, M) root in leg lengths, angles in radians
    outcome : (T,) of each frame, None for frames that were not followed
    moved   : (T, 3) how a moving camera has moved the scene since the start, see `View.moved`
    view    : at the start
    """

    news: News
    times: Array
    names: tuple[str, ...]
    places: Array
    covs: Array
    freedoms: tuple[str, ...]
    poses: Array
    outcome: tuple[Outcome | None, ...]
    moved: Array
    view: View

    def __len__(self) -> int:
        return len(self.times)

    @property
    def facing(self) -> int:
        return 1 if self.news.facing == "right" else -1

    @property
    def measured(self) -> NDArray[np.bool_]:
        """(T,) whether the figure was followed and neither lost nor outside the picture."""
        return np.array([outcome is not None and outcome.measured for outcome in self.outcome])

    def in_scene(self) -> Self:
        """The run in the pixels of a camera that stays as it started."""
        away, zoom = self.moved[:, None, :2], self.moved[:, 2, None, None]
        places = self.view.origin + (self.places - self.view.origin - away) / zoom
        moved = np.tile(UNMOVED, (len(self), 1))
        return replace(self, places=places, covs=self.covs / zoom[..., None] ** 2, moved=moved)

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
    """The fields of run.json; RunError: no complete run in this folder."""
    path = folder / NEWS
    try:
        return News.model_validate(read_json(path))
    except (FileNotFoundError, NotADirectoryError) as error:
        inner = sorted(found.parent.name for found in folder.glob("*/run.json"))
        advice = f"give one of the runs in it, {', '.join(inner)}" if inner else "track a clip first"
        raise RunError(f"{folder} holds no complete run (no run.json); {advice}") from error
    except (OSError, ValidationError) as error:
        raise RunError(f"{path} is no run of figtrack ({_fault(error)}); track the clip again") from error
    except (ValueError, RecursionError) as error:
        raise RunError(f"{path} is no run of figtrack (invalid json); track the clip again") from error


def read_gait(folder: Path) -> Figures | None:
    """The fields of gait.json, None without one; RunError: it is damaged."""
    with _sound(folder / "gait.json") as path:
        return Figures.model_validate(read_json(path)) if path.exists() else None


def read_run(folder: Path) -> Record:
    """A complete run; RunError: there is none in this folder, or its track.npz is damaged."""
    news = read_news(folder)
    with _sound(folder / "track.npz") as path:
        header, rows = _archive(path, ("times", "q", "outcome", "moved", "joints", "joint_covs"))
        first, followed, T = header["first"], len(rows["q"]), news.frames
        if not 0 <= first <= T - followed:
            raise ValueError(f"it holds frames {first} to {first + followed - 1} of {T}")
        angles = header["freedoms"][len(ROOT) : header["freedoms"].index(SCALE)]
        here = slice(first, first + followed)
        return Record(
            news=news,
            times=whole_times(rows["times"], first, T, news.fps, header.get("before", ())),
            names=tuple(header["joints"]),
            places=_padded(rows["joints"], here, T),
            covs=_padded(rows["joint_covs"], here, T),
            freedoms=(*ROOT, *angles),
            poses=_padded(rows["q"][:, : len(ROOT) + len(angles)], here, T),
            outcome=(*[None] * first, *map(Outcome, rows["outcome"].tolist()), *[None] * (T - here.stop)),
            moved=_padded(rows["moved"], here, T, UNMOVED),
            view=_view(header),
        )


def _view(header: Mapping[str, Any]) -> View:
    x, y, unit, facing = header["view"]
    return View((x, y), unit, facing)


def _padded(values: Array, rows: slice, frames: int, beyond: float | Array = np.nan) -> Array:
    """Values of some rows padded to all frames of the clip, in double precision."""
    whole = np.full((frames, *values.shape[1:]), beyond)
    whole[rows] = values
    return whole


@contextmanager
def _sound(path: Path) -> Iterator[Path]:
    """A file to read in this block; RunError if its content is not that of a run."""
    try:
        yield path
    except (OSError, ValueError, KeyError, IndexError, TypeError, RecursionError) as error:
        raise RunError(f"{path} is damaged ({_fault(error)}); track the clip again") from error


def _fault(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors()[0]
        return " ".join([*map(str, first["loc"]), first["msg"].lower()])
    return f"there is no {error.args[0]!r}" if isinstance(error, KeyError) else why(error)


def read_track(folder: Path, mark: float, figure: Figure) -> Track:
    """The track of a complete run of this figure, its setting `mark` given; raises as `read_run`."""
    with _sound(folder / "track.npz") as path:
        header, rows = _archive(path, ROWS)
        return Track(
            figure=figure.with_lengths(header["lengths"]),
            view=_view(header),
            model=header["model"],
            labels=tuple(header["labels"]),
            misnamed=header["misnamed"],
            first=header["first"],
            before=tuple(header.get("before", ())),
            motions=tuple(rows.pop("motions").tolist()),
            outcome=tuple(rows.pop("outcome").tolist()),
            mark=mark,
            **rows,
        )


def _archive(path: Path, names: Sequence[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The header and these arrays of track.npz."""
    try:
        with ordinary(path).open("rb") as file, np.load(file) as track:
            header, rows = json.loads(str(track["header"])), {name: track[name] for name in names}
    except OSError:
        raise
    except Exception as error:  # zipfile, zlib, numpy and json raise many kinds for damaged bytes
        raise ValueError("it is no archive that can be read") from error
    if header["version"] != VERSION:
        raise ValueError(f"it is of version {header['version']}, this program reads {VERSION}")
    return header, rows
