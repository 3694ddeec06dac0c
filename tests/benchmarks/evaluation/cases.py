"""One clip followed one way, and what came of it."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import islice, product
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from kinematics.figure_file import WALKER
from kinematics.sides import other_side
from tests.benchmarks.evaluation.calibration import distances
from tests.benchmarks.processes import each, spawned
from tests.benchmarks.rivals import correlation, lucas_kanade
from tests.benchmarks.rivals.body import body_at, by_frame
from tracker.clip.asked import asked
from tracker.clip.follow import follow
from tracker.clip.job import Following, Job
from tracker.clip.outlines import look
from tracker.clip.plan import Seen, prepare
from tracker.progress import Progress
from tracker.run.score import Places, Score, places, score
from tracker.settings import Settings
from tracker.tables.keypoints import Marks, read_keypoints

QUIET = Progress("quiet")
Array = NDArray[np.float64]
Answer = TypeVar("Answer")
Key = TypeVar("Key")

START = 0
BEFORE_ALL = -1  # a start from which on every marked frame is scored
LEGS = tuple(name for name in WALKER.scored if other_side(name) != name)
BAND = "near_knee"


@dataclass(frozen=True)
class Ours:
    """A way to follow: a motion model and settings, smoothed or as each frame was first seen.

    marked : whether the start is marked; else it is found
    """

    model: str
    settings: Settings = field(default_factory=Settings)
    smooth: bool = True
    marked: bool = True


@dataclass(frozen=True)
class Flow:
    """Lucas-Kanade points on every link."""

    options: lucas_kanade.Options = field(default_factory=lucas_kanade.Options)


@dataclass(frozen=True)
class Boxes:
    """A correlation tracker on every link."""

    options: correlation.Options = field(default_factory=correlation.Options)


Way = Ours | Flow | Boxes


@dataclass(frozen=True)
class Outcome:
    """Errors against the hand marks, and against the colour band where the clip has one.

    score     : errors at the hand marks
    distances : (M,) of visible marks, in standard deviations squared; None for who knows no covariance
    band      : root-mean-square distance of the near knee's path from the band's, px; None without a band
    labelled  : share of the frames whose motion is the clip's; None for who labels none
    """

    score: Score
    distances: Array | None
    band: float | None
    labelled: float | None = None


def outcome(way: Way, clip: Path) -> Outcome:
    """Follow the clip from its first whole frame of marks, or from none; the errors at its marks."""
    marks, band = marks_of(clip), band_of(clip)
    last, start = max(max(marks), max(band, default=0)), first_whole(marks)
    labelled = None
    if isinstance(way, Ours):
        how = {"model": way.model, "settings": way.settings, "smooth": way.smooth}
        if way.marked:
            job = Job(clip, marks, start=start, stop=last, **how)
        else:
            job, start = asked(Following(model=way.model), clip, None, way.settings, QUIET), BEFORE_ALL
        same = way.marked and way.settings.outline and way.settings.mode == "full"
        track = follow(job, QUIET, seen=_seen(clip, start, last) if same else None).track
        found, spread = places(track), distances(track, marks, start)
        motion = "walk" if "walk" in clip.stem else "run"
        if motion in track.labels:
            labelled = float(np.mean([each == motion for each in track.motions]))
    else:
        found, spread = _rival_places(clip, marks, way, last), None
    return Outcome(score(marks, found, start), spread, band_error(found, band) if band else None, labelled)


@cache
def _seen(clip: Path, start: int, last: int) -> Seen:
    """What the outline tells of a marked clip whatever model and settings follow it."""
    return look(prepare(Job(clip, marks_of(clip), start=start, stop=last)), QUIET)


def first_whole(marks: Marks) -> int:
    """The first frame in which every joint of the legs is marked."""
    return next(frame for frame in sorted(marks) if set(LEGS) <= marks[frame].keys())


def marks_of(clip: Path) -> Marks:
    """The hand marks beside a clip."""
    return read_keypoints(clip.with_name(f"{clip.stem}.keypoints.csv"))


def band_of(clip: Path) -> dict[int, tuple[float, float]]:
    """Where the colour band at the near knee was seen, by frame; empty without a table of colour markers."""
    path = clip.with_name(f"{clip.stem}.markers.csv")
    if not path.is_file():
        return {}
    seen = read_keypoints(path, names=(BAND, "near_heel_tape", "hip_band"))
    return {
        frame: (row[BAND].x, row[BAND].y) for frame, row in seen.items() if BAND in row and row[BAND].visible
    }


def band_error(found: Mapping[int, Places], band: Mapping[int, tuple[float, float]]) -> float:
    """Root-mean-square difference of two paths, px, less its mean: the band need not lie on the joint."""
    away = np.array([np.subtract(found[frame][BAND], at) for frame, at in band.items()])
    return float(np.sqrt(((away - away.mean(0)) ** 2).sum(1).mean()))


def measured(
    function: Callable[..., Answer], asked: Iterable[tuple[object, ...]], progress: Progress, name: str
) -> list[Answer]:
    """The function of everything asked, in order, two at a time."""
    with spawned() as pool:
        return each(pool, function, asked, progress, name)


def measured_by(
    keys: Iterable[Key],
    items: Collection[object],
    function: Callable[..., Answer],
    progress: Progress,
    name: str,
) -> dict[Key, list[Answer]]:
    """The function of each key with every item, by the key; keys that are the same are measured once."""
    different = list(dict.fromkeys(keys))
    found = iter(measured(function, product(different, items), progress, name))
    return {key: list(islice(found, len(items))) for key in different}


def outcomes(
    clips: Sequence[Path], ways: Iterable[Way], progress: Progress, name: str
) -> dict[Way, list[Outcome]]:
    """Outcomes on all clips of every way."""
    return measured_by(ways, clips, outcome, progress, name)


def _rival_places(
    clip: Path, marks: Marks, way: Flow | Boxes, last: int
) -> dict[int, dict[str, tuple[float, float]]]:
    plan = prepare(Job(clip, marks, model="cv", start=START))
    body = body_at(plan.start, marks[START])
    images = (frame.image for frame in islice(plan.video, last + 1))
    if isinstance(way, Flow):
        return by_frame(body, lucas_kanade.follow(images, body, way.options))
    return by_frame(body, correlation.follow(list(images), body, way.options))
