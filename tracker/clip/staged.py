"""A part of a film surveyed for outlines, and the joints of an outline as points."""

from dataclasses import dataclass
from itertools import chain
from math import ceil

import numpy as np

from tracker.loop.detections import Detections
from tracker.often import USUAL, crowded, often
from tracker.outline.fit import Outline
from tracker.outline.stage import Stage
from tracker.picture.pyramid import within
from tracker.picture.small import SIDE
from tracker.progress import Progress
from tracker.survey.evidence import NOTHING, ORDINARY, Expected
from tracker.survey.shot import PATIENCE, Shot
from tracker.survey.surveyed import Survey, survey
from videos.frames import Video, count_to

POINT = 0.05  # least spread of an outline's joint, leg lengths
TOGETHER = 3.0  # factor on the spread, since errors of successive frames are correlated
MOST = 3.0  # largest spread as a multiple of POINT, if the figure stands out from the scene
OFTEN = 60.0  # surveyed frames a second, about, if a film has more,
ENOUGH = 100  # and so many surveyed frames altogether
FEWEST = 20  # frames at 30 a second or more; in fewer a walker covers many places in half of them
LEAST = 10  # the same at lower rates, as the scene is their median


@dataclass(frozen=True)
class Surveyed:
    """Every `every`-th of the frames `first` to `last` of a film, and their survey.

    cut : whether another scene is shown from the next frame on
    """

    video: Video
    first: int
    last: int
    every: int
    survey: Survey
    cut: bool
    progress: Progress

    @property
    def enough(self) -> bool:
        """Whether the frames are enough to know the scene."""
        return len(self.survey.places) >= fewest(self.video.fps / self.every)

    def stage(self, facing: int, expected: Expected = ORDINARY) -> Stage:
        """The log odds of the frames.

        Args:
            facing: of the figure, +1 right, -1 left.
            expected: prior shares of grey clothes and shadow.
        """
        T, (w, h) = len(self.survey.places), self.survey.size
        odds, light = np.full((T, h, w), NOTHING, np.uint8), np.zeros((T, h, w), np.uint8)
        shares = np.ones(T)
        seen = self.survey.seen(self.video.pictures(self.first, self.last, self.every), expected)
        for t, shown in enumerate(self.progress.through(f"{self.video.path.name} outlined", seen, T)):
            odds[t], light[t], shares[t] = shown
        fps = self.video.fps / self.every
        return Stage(odds, light, self.survey.up, self.survey.places, facing, fps, shares)


def fewest(fps: float) -> int:
    """Least number of surveyed frames in which the scene is known; at a low rate a walker goes as far in
    fewer."""
    return min(max(ceil(FEWEST * fps / USUAL), LEAST), FEWEST)


def every(video: Video, first: int, last: int | None) -> int:
    """Of how many frames one is surveyed, as at a high frame rate not all are needed; see `count_to`."""
    step, end = round(video.fps / OFTEN), count_to(video, last)
    return max(step if end is None else min(step, (end - first) // ENOUGH), 1)


def surveyed(
    video: Video, first: int, last: int, step: int, by: float, progress: Progress, shows: int | None = None
) -> Surveyed | None:
    """Survey one scene of a part of a film; None if the part has no frames.

    Args:
        step: of how many frames one is surveyed.
        by: least number of the film's pixels along the side of a pixel of the small pictures.
        shows: a frame of the scene, None for the first one.
    """
    film = _to_cut(video, first, last, step, by, progress)
    while film is not None and film.cut and shows is not None and film.last < shows:
        film = _to_cut(video, film.last + step, last, step, by, progress)
    return film


def _to_cut(video: Video, first: int, last: int, step: int, by: float, progress: Progress) -> Surveyed | None:
    """The survey of a part of a film up to its first hard cut."""
    announced = video.count_hint or 0  # joined recordings may announce too few
    total = -((first - min(last + 1, announced)) // step) if first < announced else None
    patience = round(PATIENCE * often(video.fps / step))
    pictures = video.pictures(first, last + patience * step, step)
    shot = Shot(pictures, (last - first) // step + 1, patience)
    images = progress.through(f"{video.path.name} surveyed", shot, total)
    begin = next(images, None)  # None if the film is shorter than it announces
    if begin is None:
        return None
    by = max(max(video.width, video.height) / SIDE, by)
    found = survey(chain([begin], images), by, total or 0, lambda: shot.beyond)
    cut = shot.beyond > 0
    last = first + (len(found.places) - 1) * step if cut else last
    return Surveyed(video, first, last, step, found, cut, progress)


def detections(outline: Outline, first: int, video: Video) -> dict[int, Detections]:
    """By frame, from `first` on, the outline's joints in the picture that stand out from the scene."""
    joints, number = outline.joints, np.arange(outline.joints.shape[1])
    inside = within(joints, (video.height, video.width)) & outline.shown & outline.seen[:, None]
    doubt = (crowded(video.fps) * np.clip(TOGETHER * outline.spread / POINT, 1.0, MOST)).tolist()
    some = np.flatnonzero(inside.any(1)).tolist()
    return {first + t: Detections(number[inside[t]], joints[t, inside[t]], doubt[t]) for t in some}
