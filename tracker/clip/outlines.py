"""The joints of a figure's outline in every frame: the film surveyed, the outline fitted, then followed."""

from collections.abc import Iterator, Mapping
from itertools import islice

import numpy as np

from kinematics.recover import Start
from tracker.loop.detections import Detections
from tracker.outline.cycles import Cycles
from tracker.outline.fit import outlined
from tracker.outline.stage import Stage
from tracker.picture.pyramid import within
from tracker.settings import Settings
from tracker.survey.film import survey
from tracker.survey.small import SIDE
from videos.frames import Image, Video

REACH = 600  # frames either way of the marked one: memory is bounded
FEWEST = 20  # frames: in fewer a walker covers most places in half of them
LEG = 40.0  # small pictures show a leg of so many pixels, or less
POINT = 0.06  # spread of an outline's joint, leg lengths
EXCHANGE = 0.01  # probability that its legs are named wrongly in a frame


def outline_points(
    video: Video, start: Start, frame: int, stop: int | None, settings: Settings
) -> Mapping[int, Detections]:
    """Joints of the outline by frame; none where the figure does not stand out from a known scene.

    Args:
        start: the pose marked in `frame`.
        stop: the last frame to be looked at, None for the video's last.
    """
    if not (settings.outline and settings.templates and settings.mode == "full"):
        return {}
    first, size = max(frame - REACH, 0), (video.width, video.height)
    last = frame + REACH if stop is None else min(frame + REACH, stop)

    def images() -> Iterator[Image]:
        return (each.image for each in islice(video, first, last + 1))

    seen = survey(images(), max(max(size) / SIDE, start.view.unit / LEG))
    if len(seen.places) < FEWEST:
        return {}
    odds = np.stack(list(seen.odds(images())))
    stage = Stage(odds, seen.up, seen.places, start.view.facing)
    found = outlined(stage, start, frame - first, video.fps, Cycles.load())
    joints = np.arange(found.joints.shape[1])
    points = {}
    for t in np.flatnonzero(found.seen).tolist():
        inside = within(found.joints[t], size[::-1])
        points[first + t] = Detections(joints[inside], found.joints[t][inside])
    return {t: each for t, each in points.items() if len(each.joint)}


def known_by_outline(settings: Settings) -> Settings:
    """The settings with the spread of an outline's joints."""
    return settings.model_copy(update={"point": POINT, "exchange": EXCHANGE})
