"""The outline in one part of a film, surveyed by itself, which bounds memory; and the parts beyond it."""

from dataclasses import dataclass

import numpy as np

from kinematics.figure import Array, Figure
from kinematics.recover import Start
from tracker.clip.staged import every, surveyed
from tracker.outline.bodies import paths
from tracker.outline.cycles import Cycles
from tracker.outline.fit import Outline, fitted
from tracker.outline.occluders import forget_occluders
from tracker.outline.others import forget_others, path_of
from tracker.outline.pieces import joined
from tracker.outline.shape import Shape
from tracker.outline.smooth import finer
from tracker.outline.stage import Stage
from tracker.progress import Progress
from tracker.survey.evidence import SOMEBODY
from videos.frames import Video

TOLD = 0.9  # share of frames that must show the camera's path; else it is found beside the figure, once known
LEG = 40.0  # largest length of a leg in the small pictures, pixels
EDGE = 30  # surveyed frames at an end, one of which must show the whole figure for a part beyond

Pose = tuple[int, Start]  # a frame and the pose in it
Ends = tuple[int | None, int | None]  # first and last frame of a scene, None for an end that was not seen


@dataclass(frozen=True)
class Part:
    """The outline in a part of a film.

    first   : its first frame
    outline : in every frame from the first on
    places  : by frame, (3, 3) map from its pixels to those of the frame of the part's start pose; empty if
        the film does not show it
    lights  : by frame, its light as a share of that of the frame of the part's start pose
    before, after : poses from which parts of the film before and after this one start, None for none
    """

    first: int
    outline: Outline
    places: dict[int, Array]
    lights: dict[int, float]
    before: Pose | None
    after: Pose | None


def part_around(
    video: Video,
    pose: Pose,
    around: tuple[int, int],
    within: tuple[int, int | None],
    progress: Progress,
    named: bool = False,
) -> tuple[Ends, Part | None]:
    """The ends of the scene around a frame whose pose is known, and the part; None if the scene is too short.

    Args:
        around: surveyed frames before and after that frame.
        within: first and last frame to be followed, None for the film's last.
        named: whether the legs keep the names that they have in the pose.
    """
    (frame, start), (begin, stop), step = pose, within, every(video, *within)
    before = min(around[0], (frame - begin) // step)
    first, last = frame - before * step, frame + around[1] * step
    last = last if stop is None else min(last, stop)
    film = surveyed(video, first, last, step, start.view.unit / LEG, progress, frame)
    if film is None or frame > film.first + (len(film.survey.places) - 1) * step:
        return (None, None), None
    shot = (film.first if film.first > first else None, film.last if film.cut else None)
    if not film.enough:
        return shot, None
    first, before = film.first, (frame - film.first) // step
    # A known person is certainly there, so what is as dark as a shadow or like the scene may be clothes.
    cycles, stage = Cycles.load(), film.stage(start.view.facing, SOMEBODY)
    told = film.survey.sure.mean() > TOLD
    began = first < begin + step or shot[0] is not None
    ended = len(stage) < (last - first) // step + 1 or last == stop
    del film  # frees its small pictures
    _forget_all_else(stage, start, before, cycles)
    outline = fitted(stage, start, before, cycles).finer(step)
    q = outline.q[frame - first]
    if named and np.abs(q[start.figure.exchanged] - start.q).sum() < np.abs(q - start.q).sum():
        outline = outline.exchanged(start.figure)
    to_start = np.linalg.inv(stage.places[before]) @ finer(stage.places, step)
    lights = finer(stage.shares, step) / stage.shares[before]
    facing, edge = start.view.facing, EDGE * step
    part = Part(
        first,
        outline,
        dict(enumerate(to_start, first)) if told else {},
        dict(enumerate(lights.tolist(), first)),
        None if began else _seen_whole(start.figure, outline, facing, first, slice(edge)),
        None if ended else _seen_whole(start.figure, outline, facing, first, slice(-edge, None)),
    )
    return shot, part


def _seen_whole(figure: Figure, outline: Outline, facing: int, first: int, some: slice) -> Pose | None:
    """The pose in the frame that shows the whole figure best among some rows of an outline, if any does; the
    outline begins with frame `first`."""
    rows = np.arange(len(outline.q))[some]
    rows = rows[outline.seen[rows] & outline.shown[rows].all(1)]
    if not len(rows):
        return None
    t = int(rows[outline.score[rows].argmax()])
    return first + t, outline.start(figure, facing, t)


def _forget_all_else(stage: Stage, start: Start, frame: int, cycles: Cycles) -> None:
    """Set the places of other people, and of what is in front of the figure, to unknown."""
    hip, unit = np.asarray(start.view.origin), start.view.unit
    everybody = joined(stage, paths(stage, Shape.of(start.figure), cycles, unit))
    own = path_of(stage, hip, unit, frame, everybody)
    if own is None:
        return
    forget_others(stage, own, everybody)
    forget_occluders(stage, own)
