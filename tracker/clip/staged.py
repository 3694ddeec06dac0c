"""A part of a film surveyed for outlines, and the joints of an outline as points."""

from collections.abc import Iterable, Iterator
from itertools import chain, islice
from typing import TypeVar

import numpy as np

from tracker.loop.detections import Detections
from tracker.outline.fit import Outline
from tracker.outline.stage import Stage
from tracker.picture.pyramid import within
from tracker.progress import Progress
from tracker.survey.small import SIDE
from tracker.survey.surveyed import survey
from videos.frames import Image, Video

T = TypeVar("T")
FEWEST = 20  # frames: in fewer a walker covers most places in half of them


def staged(
    video: Video, first: int, last: int, by: float, facing: int, progress: Progress, plain: float = 0.0
) -> Stage | None:
    """The log odds of a film's frames from `first` to `last`; None where they are too few to know the scene.

    Args:
        by: pixels of the film that a pixel of its small pictures is to span, at least.
        plain: share of clothes that are about grey.
    """
    total = None if video.count_hint is None else min(last + 1, video.count_hint) - first

    def images() -> Iterator[Image]:
        return (each.image for each in islice(video, first, last + 1))

    def told(items: Iterable[T], doing: str) -> Iterator[T]:
        with progress.task(f"{video.path.name} {doing}", total) as advance:
            for each in items:
                yield each
                advance()

    if total is not None and total <= 0:
        return None
    pictures = told(images(), "surveyed")
    begin = next(pictures, None)  # none where the film is shorter than it says
    if begin is None:
        return None
    seen = survey(chain([begin], pictures), max(max(video.width, video.height) / SIDE, by))
    if len(seen.places) < FEWEST:
        return None
    odds, light = map(np.stack, zip(*told(seen.seen(images(), plain), "outlined"), strict=True))
    return Stage(odds, light, seen.up, seen.places, facing)


def detections(outline: Outline, first: int, video: Video) -> dict[int, Detections]:
    """The outline's joints that lie in the picture and stand out from the scene, by frame, where it is seen.

    Args:
        first: frame of the outline's first.
    """
    number, found = np.arange(outline.joints.shape[1]), {}
    for t in np.flatnonzero(outline.seen).tolist():
        inside = within(outline.joints[t], (video.height, video.width)) & outline.shown[t]
        if inside.any():
            found[first + t] = Detections(number[inside], outline.joints[t][inside])
    return found
