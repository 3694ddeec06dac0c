"""A part of a film surveyed for outlines, and the joints of an outline as points."""

from dataclasses import dataclass
from itertools import chain

import numpy as np

from tracker.clip.pictures import pictures
from tracker.loop.detections import Detections
from tracker.outline.fit import Outline
from tracker.outline.stage import Stage
from tracker.picture.pyramid import within
from tracker.picture.small import SIDE
from tracker.progress import Progress
from tracker.survey.evidence import USUAL, Expected
from tracker.survey.surveyed import Survey, survey
from videos.frames import Video

POINT = 0.05  # spread of an outline's joint at least, leg lengths
TOGETHER = 3.0  # times what one frame tells: what is wrong in one is wrong in the next
MOST = 3.0  # times POINT, where a figure stands out: arms and shadows beside it do as well
FEWEST = 20  # frames: in fewer a walker covers most places in half of them


@dataclass(frozen=True)
class Surveyed:
    """Frames of a film from `first` to `last`, and what they show as a whole."""

    video: Video
    first: int
    last: int
    survey: Survey
    progress: Progress

    def stage(self, facing: int, expected: Expected = USUAL) -> Stage:
        """The log odds of the frames.

        Args:
            facing: of the figure, +1 right, -1 left.
            expected: what they may show.
        """
        T, (w, h) = len(self.survey.places), self.survey.size
        odds, light = (np.zeros((T, h, w), np.uint8) for _ in range(2))  # either can be let go of alone
        seen = self.survey.seen(pictures(self.video, self.first, self.last), expected)
        for t, shown in enumerate(self.progress.through(f"{self.video.path.name} outlined", seen, T)):
            odds[t], light[t] = shown
        return Stage(odds, light, self.survey.up, self.survey.places, facing, self.video.fps)


def surveyed(video: Video, first: int, last: int, by: float, progress: Progress) -> Surveyed | None:
    """Frames of a film surveyed; None where they are too few to know the scene.

    Args:
        by: pixels of the film that a pixel of its small pictures is to span, at least.
    """
    total = None if video.count_hint is None else min(last + 1, video.count_hint) - first
    if total is not None and total <= 0:
        return None
    images = progress.through(f"{video.path.name} surveyed", pictures(video, first, last), total)
    begin = next(images, None)  # none where the film is shorter than it says
    if begin is None:
        return None
    by = max(max(video.width, video.height) / SIDE, by)
    found = survey(chain([begin], images), by, total or 0)
    return Surveyed(video, first, last, found, progress) if len(found.places) >= FEWEST else None


def detections(outline: Outline, first: int, video: Video) -> dict[int, Detections]:
    """The outline's joints that lie in the picture and stand out from the scene, by frame, where it is seen.

    Args:
        first: frame of the outline's first.
    """
    number, found = np.arange(outline.joints.shape[1]), {}
    for t in np.flatnonzero(outline.seen).tolist():
        inside = within(outline.joints[t], (video.height, video.width)) & outline.shown[t]
        if inside.any():
            doubt = min(max(TOGETHER * float(outline.spread[t]) / POINT, 1.0), MOST)
            found[first + t] = Detections(number[inside], outline.joints[t][inside], doubt)
    return found
