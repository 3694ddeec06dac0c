"""Parts of the open clips, each a film of its own that is followed without marks.

A part shows a stride or two, and the legs cross in it a few times at most: less than the whole clip, which
settings were chosen by. What is true in it is the track of the whole clip from its marks.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from tests.benchmarks.evaluation.cases import BEFORE_ALL, QUIET, first_whole, marks_of
from tests.benchmarks.evaluation.disturbances import Film, Image, write_film
from tests.benchmarks.page import Claim, chapter, table
from tests.benchmarks.rendered.measure import AWAY, meant
from tracker.clip.follow import follow
from tracker.clip.found import people, start_of
from tracker.clip.job import Following, Job
from tracker.clip.start import FoundError
from tracker.run.score import places, score
from tracker.tables.keypoints import Mark, Marks
from videos.frames import Video

LONG = 45  # frames of a part
APART = 22  # frames from the first one of a part to the next part's


def mirrored(film: Film) -> Film:
    """Left and right exchanged."""
    width = film.images[0].shape[1]
    images = [np.ascontiguousarray(image[:, ::-1]) for image in film.images]
    return Film(images, film.fps, _placed(film.marks, lambda x, y: (width - 1 - x, y)))


def halved(film: Film) -> Film:
    """Half as wide and high."""
    height, width = (side // 4 * 2 for side in film.images[0].shape[:2])
    share = np.array([width, height]) / film.images[0].shape[1::-1]

    def small(image: Image) -> Image:
        return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)

    def place(x: float, y: float) -> tuple[float, float]:
        at = (np.array([x, y]) + 0.5) * share - 0.5
        return float(at[0]), float(at[1])

    return Film([small(image) for image in film.images], film.fps, _placed(film.marks, place))


def _placed(marks: Marks, to: Callable[[float, float], tuple[float, float]]) -> Marks:
    return {
        frame: {name: Mark(*to(mark.x, mark.y)) for name, mark in row.items()} for frame, row in marks.items()
    }


VIEWS: dict[str, Callable[[Film], Film]] = {
    "as filmed": lambda film: film,
    "mirrored": mirrored,
    "half size": halved,
}


@dataclass(frozen=True)
class Told:
    """What came of a part.

    refused   : nobody is found whose facing or pose is sure
    exchanged : the legs, in most frames
    warned    : of something besides what is said of the film itself
    off       : frames with a mean error over AWAY
    """

    refused: bool = False
    exchanged: bool = False
    warned: bool = False
    off: int = 0


def told(clip: Path, view: str) -> list[Told]:
    """Of every part of the clip."""
    return [_followed(VIEWS[view](part)) for part in parts(_whole(clip))]


def parts(film: Film) -> Iterator[Film]:
    """Parts of LONG frames in which all is known, each half over the one before."""
    for first in range(min(film.marks), max(film.marks) + 2 - LONG, APART):
        frames = range(first, first + LONG)
        if film.marks.keys() >= set(frames):
            marks = {frame - first: film.marks[frame] for frame in frames}
            yield Film(film.images[first : first + LONG], film.fps, marks)


@cache
def _whole(clip: Path) -> Film:
    """The clip with the joints of its track from its marks."""
    marks = marks_of(clip)
    start = first_whole(marks)
    track = follow(Job(clip, {start: marks[start]}, start=start), QUIET).track
    found = {
        frame: {name: Mark(*at) for name, at in row.items()}
        for frame, row in places(track).items()
        if track.measured[frame - track.first]
    }
    video = Video(clip)
    return Film([frame.image for frame in islice(video, max(found) + 1)], video.fps, found)


def _followed(film: Film) -> Told:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mov"
        write_film(film, path)
        video = Video(path)
        everybody = people(video, QUIET)
        how = Following(person=meant(everybody, film.marks) if everybody else None)
        try:
            run = follow(how.job(path, start_of(everybody, how, video)), QUIET)
        except FoundError:
            return Told(refused=True)
    found = score(film.marks, places(run.track), BEFORE_ALL)
    return Told(
        exchanged=2 * found.swaps > found.truth_frames,
        warned=bool(set(run.warnings) - set(video.notes)),
        off=sum(error > AWAY for error in found.frame_errors.values()),
    )


Answers = Mapping[tuple[Path, str], Sequence[Told]]  # by clip and view

HEADER = ("shown", "parts", "refused", "exchanged, said", "not said", "frames off")
METHOD = f"""\
Parts of {LONG} frames of the {{clips}} clips, one every {APART}, followed without marks, against the track
of the whole clip from its marks.
"""


def claims(answers: Answers) -> list[Claim]:
    """How often legs are to be named wrongly without a warning."""
    silent = [part.exchanged and not part.warned for of_clip in answers.values() for part in of_clip]
    return [Claim("share of parts with legs exchanged silently", float(np.mean(silent)), 0.03)]


def section(answers: Answers) -> list[str]:
    """A table, a row for each view."""
    clips = len({clip for clip, _ in answers})
    rows = [
        [view, *_counts([part for (_, shown), of in answers.items() if shown == view for part in of])]
        for view in VIEWS
    ]
    return chapter("## Parts of films, without marks", METHOD.format(clips=clips), table(HEADER, rows))


def _counts(of: Sequence[Told]) -> list[str]:
    """The cells of a row, under HEADER."""
    said = [each.warned for each in of if each.exchanged]
    counts = len(of), sum(each.refused for each in of), sum(said), len(said) - sum(said)
    return [str(count) for count in (*counts, sum(each.off for each in of))]
