"""A finished run's job, read back from its folder so that its film can be followed again."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, NonNegativeInt

from kinematics.figure_file import load_figure
from tracker.clip.job import Facing, Following, Job
from tracker.run.read import News, RunError, read_news
from tracker.settings import Settings
from tracker.tables.keypoints import read_keypoints

START = "start.keypoints.csv"  # in a run's folder: the marks that the track passes through


class _Film(BaseModel):
    path: str
    bytes: int


class _Began(BaseModel):
    frame: NonNegativeInt
    near_leg: str


class _Asked(News):
    """What run.json says of the work itself."""

    film: _Film
    start: _Began
    settings: Settings
    options: dict[str, Any]


@dataclass(frozen=True)
class Finished:
    """A run that can be followed again.

    job    : from the marks that its track passes through, the figure's facing given
    start  : frame that it started from
    key    : of a batch's job, "" for none
    unsure : whether it is not sure which leg is the nearer one
    """

    job: Job
    start: int
    key: str
    unsure: bool


def read_finished(folder: Path) -> Finished:
    """The job of a complete run.

    Raises:
        RunError: no complete run, one that does not say how it was made, or a film that is gone or altered.
    """
    read_news(folder)
    try:
        news = _Asked.model_validate_json((folder / "run.json").read_bytes())
        how = Following(
            **{**news.options, "start": news.start.frame, "facing": Facing(news.facing), "anchors": True}
        )
        marks = read_keypoints(folder / START, load_figure(how.figure).marks)
    except (TypeError, ValueError) as error:
        raise RunError(
            f"{folder} does not say how it was made as this version of figtrack does; track the clip again"
        ) from error
    job = how.job(_there(news.film, folder), marks, news.settings)
    return Finished(job, news.start.frame, news.job, news.start.near_leg == "unsure")


def film_told(job: Job) -> dict[str, Any]:
    """Where a job's film lies and how large it is, by which it is known again."""
    return {"path": str(Path(job.called or job.video).absolute()), "bytes": _bytes(job.video)}


def _there(film: _Film, folder: Path) -> Path:
    path = Path(film.path)
    if not path.exists():
        raise RunError(f"the film of {folder} is no longer at {path}; bring it back to there")
    if _bytes(path) != film.bytes:
        raise RunError(f"{path} was altered since {folder} was made of it; track the clip again")
    return path


def _bytes(film: Path) -> int:
    """Size of a video file, or of the files of a folder together."""
    files = [each for each in film.iterdir() if each.is_file()] if film.is_dir() else [film]
    return sum(each.stat().st_size for each in files)
