"""Which way a figure faces whose feet are not marked: the way it goes over the scene in the frames after."""

from collections.abc import Iterable

from kinematics.recover import Start, needed_joints
from tracker.loop.begin import begin, start_curve
from tracker.loop.tracker import make_tracker
from tracker.models.find import CONSTANT_VELOCITY, find_model
from tracker.picture.pyramid import Image
from tracker.picture.tone import toned
from tracker.settings import Settings

FRAMES = 15  # half a second: a step


def footless(start: Start) -> bool:
    """Whether the last link of no leg is marked, so that nothing tells where its knees bend to."""
    figure, needed = start.figure, needed_joints(start.figure)
    last = [i for i, link in enumerate(figure.links) if figure.is_leg(link) and link.joint not in needed]
    return bool(last) and not start.known[figure.layout.angle[last]].any()


def heading(images: Iterable[Image], start: Start, fps: float, settings: Settings) -> int:
    """+1 right, -1 left; of who stays where he is the way that the start faces.

    Args:
        images: RGB, the marked frame first.
        start: the pose there, facing either way.
        fps: frames a second.
    """
    tracker = make_tracker(start, find_model(CONSTANT_VELOCITY, fps, settings, figure=start.figure), settings)
    frames = iter(images)
    first = next(frames)
    curve = start_curve(tracker, start, first)
    state, estimate = begin(tracker, start, toned(first, curve))
    for image in frames:
        state, estimate = tracker.step(state, toned(image, curve))
    ahead = estimate.pose.mean[0] >= start.q[0]
    return start.view.facing if ahead else -start.view.facing
