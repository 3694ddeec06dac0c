"""Following a finished run again: its job, read back, and the frames that stay when marks are corrected."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, NonNegativeInt

from kinematics.recover import Start
from kinematics.text_file import read_json
from tracker.clip.asked import marks_in
from tracker.clip.job import Facing, Following, Found, Job, Nearer
from tracker.run.read import NEWS, START, News, RunError, read_news
from tracker.run.track import Track
from tracker.settings import Settings
from tracker.tables.keypoints import Marks
from videos.frames import files_of


class _Film(BaseModel):
    path: str
    bytes: int


class _Began(BaseModel):
    frame: NonNegativeInt
    marks: str
    near_leg: str


class _Asked(News):
    """The part of run.json that describes the job."""

    film: _Film
    start: _Began
    settings: Settings
    options: dict[str, Any]


@dataclass(frozen=True)
class Finished:
    """A run that can be followed again.

    job    : from the marks that its track passes through, the figure's facing given
    start  : start frame
    key    : identifies a job of a batch, "" for none
    unsure : whether the nearer leg is uncertain
    """

    job: Job
    start: int
    key: str
    unsure: bool


def read_finished(folder: Path) -> Finished:
    """The job of a complete run.

    RunError: no complete run, one that does not say how it was made, or a film that is gone or altered.
    """
    read_news(folder)
    try:
        news = _Asked.model_validate(read_json(folder / NEWS))
        given = {"start": news.start.frame, "facing": Facing(news.facing), "anchors": True}
        how = Following(**news.options | given)
        marks = marks_in(folder / START, how)
        found = _found(news, marks) if news.start.marks == "found" else None
    except (KeyError, TypeError, ValueError) as error:
        raise RunError(
            f"{folder} does not say how it was made as this version of figtrack does; track the clip again"
        ) from error
    job = replace(how.job(_there(news.film, folder), marks, news.settings), found=found)
    return Finished(job, news.start.frame, news.job, news.start.near_leg == "unsure")


def _found(news: _Asked, marks: Marks) -> Found | None:
    """The start as it was found; None for marks of a figure without ankles."""
    of_start, facing = marks[news.start.frame], 1 if news.facing == "right" else -1
    if not {"near_ankle", "far_ankle"} <= of_start.keys():
        return None
    ahead = facing * (of_start["near_ankle"].x - of_start["far_ankle"].x)
    return Found(news.start.frame, of_start, facing, Nearer.of(ahead), news.start.near_leg)


def film_told(job: Job) -> dict[str, Any]:
    """Path and size of a job's film, by which it is recognised later."""
    return {"path": str(Path(job.called or job.video).absolute()), "bytes": _bytes(job.video)}


@dataclass(frozen=True)
class Kept:
    """An earlier track, and its frames that are followed again, those between unchanged marks.

    The track passes through all marks, so frames beyond the next unchanged mark are kept, though templates
    would reach them a little different. Templates come from the start frame, so following begins there again.

    anew  : first and last frame that are replaced
    span  : first and last frame that are followed for this, including the start frame
    """

    track: Track
    anew: tuple[int, int]
    span: tuple[int, int]

    @classmethod
    def of(cls, track: Track, before: Marks, now: Marks, start: int) -> "Kept | None":
        """The kept part after changes of marks; None if no marks changed, or those of the start frame did."""
        changed = [t for t in before.keys() | now.keys() if before.get(t) != now.get(t)]
        if not changed or start in changed:
            return None
        same, first, end = sorted(before.keys() - set(changed)), track.first, track.first + len(track) - 1
        low = max((t for t in same if t < min(changed)), default=first - 1)
        high = min((t for t in same if t > max(changed)), default=end + 1)
        low, high = min(max(low, first - 1), end), max(min(high, end + 1), first)
        span = min(max(low, first), start), max(min(high, end), start)
        return cls(track, (low + 1, high - 1), span if high > low + 1 else (start, start))

    def fits(self, start: Start, labels: tuple[str, ...]) -> bool:
        """Whether a new start has the same figure and place, to rounding, and the model the same states."""

        def numbers(of: Start | Track) -> list[float]:
            lengths = [link.length for link in of.figure.links]
            return [*lengths, *of.view.origin, of.view.unit, of.view.facing]

        same = np.allclose(numbers(start), numbers(self.track), rtol=1e-6)
        return labels == self.track.labels and same

    def joined(self, new: Track) -> Track:
        """The earlier track with the frames that were followed again; `new` is the track of the span."""
        here, there = (
            slice(self.anew[0] - each.first, self.anew[1] + 1 - each.first) for each in (self.track, new)
        )
        rows = {name: getattr(self.track, name).copy() for name in ("q", "cov", "s", "moved")}
        for name, values in rows.items():
            values[here] = getattr(new, name)[there]
        outcome = list(self.track.outcome)
        outcome[here] = new.outcome[there]
        return replace(self.track, outcome=tuple(outcome), misnamed=new.misnamed, **rows)


def _there(film: _Film, folder: Path) -> Path:
    """The film, where it was or moved together with the run's folder."""
    path = Path(film.path)
    if not path.exists():
        beside = folder.resolve().parent / path.name
        if beside.exists() and _bytes(beside) == film.bytes:
            return beside
        raise RunError(
            f"the film of {folder} is no longer at {path}, nor unaltered at {beside}; bring it back"
        )
    if _bytes(path) != film.bytes:
        raise RunError(f"{path} was altered since {folder} was made of it; track the clip again")
    return path


def _bytes(film: Path) -> int:
    """Size of a video file, or of the pictures of a folder together."""
    return sum(each.stat().st_size for each in files_of(film))
