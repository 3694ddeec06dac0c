"""The joints of a figure's outline in every frame: the film surveyed, the outline fitted, then followed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

import numpy as np

from kinematics.recover import Start
from tracker.loop.detections import Detections
from tracker.outline.cycles import Cycles
from tracker.outline.fit import outlined
from tracker.outline.stage import Stage
from tracker.picture.pyramid import within
from tracker.settings import Settings
from tracker.survey.small import SIDE
from tracker.survey.surveyed import survey
from videos.frames import Image, Video

REACH = 600  # frames either way of the marked one: memory is bounded
FEWEST = 20  # frames: in fewer a walker covers most places in half of them
LEG = 40.0  # small pictures show a leg of so many pixels, or less
POINT = 0.06  # spread of an outline's joint, leg lengths
EXCHANGE = 0.01  # least probability that its legs are named wrongly
MOST = 0.49  # the same at most
MARGIN = 10.0  # nats of what tells the names that count as one: neighbouring pixels err together


@dataclass(frozen=True)
class Outlined:
    """Joints of the outline by frame, and the probability that they name the legs wrongly."""

    frames: Mapping[int, Detections]
    exchange: float

    def known_by(self, settings: Settings) -> Settings:
        """The settings with the spread and the doubts of these very points."""
        return settings.model_copy(update={"point": POINT, "exchange": self.exchange})


def outline_points(video: Video, start: Start, frame: int, stop: int | None) -> Outlined | None:
    """Joints of the outline by frame; None where the figure does not stand out from a known scene.

    Args:
        start: the pose marked in `frame`.
        stop: the last frame to be looked at, None for the video's last.
    """
    first, size = max(frame - REACH, 0), (video.width, video.height)
    last = frame + REACH if stop is None else min(frame + REACH, stop)

    def images() -> Iterator[Image]:
        return (each.image for each in islice(video, first, last + 1))

    seen = survey(images(), max(max(size) / SIDE, start.view.unit / LEG))
    if len(seen.places) < FEWEST:
        return None
    odds = np.stack(list(seen.odds(images())))
    stage = Stage(odds, seen.up, seen.places, start.view.facing)
    found = outlined(stage, start, frame - first, video.fps, Cycles.load())
    joints = np.arange(found.joints.shape[1])
    points = {}
    for t in np.flatnonzero(found.seen).tolist():
        inside = within(found.joints[t], size[::-1])
        points[first + t] = Detections(joints[inside], found.joints[t][inside])
    points = {t: each for t, each in points.items() if len(each.joint)}
    exchange = max(EXCHANGE, 1.0 / (1.0 + float(np.exp(found.margin / MARGIN))))
    return Outlined(points, min(exchange, MOST)) if points else None
