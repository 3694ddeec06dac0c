"""A finished run followed again: its job, read back, and what stays where marks were corrected."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, NonNegativeInt

from kinematics.recover import Start
from tracker.clip.asked import marks_in
from tracker.clip.job import Facing, Following, Job
from tracker.run.read import News, RunError, read_news
from tracker.run.track import Track
from tracker.settings import Settings
from tracker.tables.keypoints import Marks
from videos.frames import files_of

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
        given = {"start": news.start.frame, "facing": Facing(news.facing), "anchors": True}
        how = Following(**news.options | given)
        marks = marks_in(folder / START, how)
    except (TypeError, ValueError) as error:
        raise RunError(
            f"{folder} does not say how it was made as this version of figtrack does; track the clip again"
        ) from error
    job = how.job(_there(news.film, folder), marks, news.settings)
    return Finished(job, news.start.frame, news.job, news.start.near_leg == "unsure")


def film_told(job: Job) -> dict[str, Any]:
    """Where a job's film lies and how large it is, by which it is known again."""
    return {"path": str(Path(job.called or job.video).absolute()), "bytes": _bytes(job.video)}


@dataclass(frozen=True)
class Kept:
    """An earlier track, and the frames of it that are followed again: those between the marks that stay.

    Marks are passed through, so a frame beyond the next one that was not touched is followed as before.
    Templates come from the start frame and change on the way, so following begins there again.

    anew  : the first and the last frame that are replaced
    span  : the first and the last that are followed for it; the start frame is among them
    """

    track: Track
    anew: tuple[int, int]
    span: tuple[int, int]

    @classmethod
    def of(cls, track: Track, before: Marks, now: Marks, start: int) -> "Kept | None":
        """What stays where marks changed; None where nothing can: none changed, or those of the start did."""
        changed = [t for t in before.keys() | now.keys() if before.get(t) != now.get(t)]
        if not changed or start in changed:
            return None
        same, first, end = sorted(before.keys() - set(changed)), track.first, track.first + len(track) - 1
        low = max((t for t in same if t < min(changed)), default=first - 1)
        high = min((t for t in same if t > max(changed)), default=end + 1)
        span = min(max(low, first), start), max(min(high, end), start)
        return cls(track, (low + 1, high - 1), span)

    def fits(self, start: Start, labels: tuple[str, ...]) -> bool:
        """Whether a start has the same figure at the same place, to rounding, and a model the same states."""

        def numbers(of: Start | Track) -> list[float]:
            lengths = [link.length for link in of.figure.links]
            return [*lengths, *of.view.origin, of.view.unit, of.view.facing]

        same = np.allclose(numbers(start), numbers(self.track), rtol=1e-6)
        return labels == self.track.labels and same

    def joined(self, new: Track) -> Track:
        """The earlier track with the frames that were followed again; `new` is of its span."""
        here, there = (
            slice(self.anew[0] - each.first, self.anew[1] + 1 - each.first) for each in (self.track, new)
        )
        rows = {name: getattr(self.track, name).copy() for name in ("q", "cov", "s", "shift")}
        for name, values in rows.items():
            values[here] = getattr(new, name)[there]
        outcome = list(self.track.outcome)
        outcome[here] = new.outcome[there]
        return replace(self.track, outcome=tuple(outcome), misnamed=new.misnamed, **rows)


def _there(film: _Film, folder: Path) -> Path:
    path = Path(film.path)
    if not path.exists():
        raise RunError(f"the film of {folder} is no longer at {path}; bring it back to there")
    if _bytes(path) != film.bytes:
        raise RunError(f"{path} was altered since {folder} was made of it; track the clip again")
    return path


def _bytes(film: Path) -> int:
    """Size of a video file, or of the pictures of a folder together."""
    return sum(each.stat().st_size for each in files_of(film))
