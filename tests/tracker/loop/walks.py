"""A rendered walk and a painted figure as marked, the loop run on their pictures, and a network's points."""

from dataclasses import dataclass

import numpy as np

from kinematics.recover import Start, start_pose
from kinematics.sides import other_side
from kinematics.spm import joints
from tests.kinematics.figures import WALKER, Puppet
from tests.tracker.painted import FULL, STRIDE, VIEW, Painted, levels_of
from tracker.loop.begin import begin
from tracker.loop.detections import Detections
from tracker.loop.estimate import State
from tracker.loop.tracker import Tracker, make_tracker
from tracker.models.find import find_model
from tracker.registration.field import Field
from tracker.registration.templates import Templates

FRAMES = 20
NAMES = ("head_top", "neck", "hip", "near_knee", "near_ankle", "near_toe", "far_knee", "far_ankle", "far_toe")
# A part of the frame that is always the whole frame: what lies outside is then the frame's own edge.
WHOLE = FULL.model_copy(update={"margin": 50.0})


@dataclass(frozen=True)
class Walk:
    """The first frames of a rendered walk."""

    images: list
    joints: dict
    start: Start
    leg_px: float


def start_of(places, facing, without=()):
    return start_pose(
        WALKER, {name: tuple(at[0]) for name, at in places.items() if name not in without}, facing
    )


def run(tracker, start, images):
    """One estimate an image, the first of which is the marked one."""
    images = iter(images)
    state, estimate = begin(tracker, start, next(images))
    yield estimate
    for image in images:
        state, estimate = tracker.step(state, image)
        yield estimate


def pixels(start, estimates):
    """(T, J, 2)"""
    return np.stack([start.view.to_pixels(joints(start.figure, e.pose.mean)) for e in estimates])


def field_of(tracker: Tracker, templates: Templates, state: State, image) -> Field:
    """What the templates are laid on: the whole frame, before the scene as the loop has come to know it."""
    view, settings = tracker.seen_by(state).view, tracker.settings
    levels = levels_of(image, settings, view, curve=state.curve)
    return Field(templates, levels, tracker.figure, view, settings, state.scenery)


def still(figure, q):
    """A start whose every freedom was marked."""
    return Start(figure, VIEW, q, np.ones(len(q), dtype=bool))


def begun(rng, settings=FULL, name="cv"):
    painted, start = Painted(rng), still(WALKER, STRIDE)
    tracker = make_tracker(start, find_model(name, 30.0, settings), settings)
    state, estimate = begin(tracker, start, painted.picture(STRIDE))
    return painted, tracker, state, estimate


def pixels_of(q, view=VIEW):
    """Joint to pixels, by the definition alone."""
    return {
        name: np.asarray(view.origin) + at * np.array([view.facing * view.unit, -view.unit])
        for name, at in Puppet(WALKER, q).joints().items()
    }


def detected(q, *, names=NAMES, without=(), view=VIEW, swap=False):
    """The joints of a pose as a network would give them without error."""
    at = pixels_of(q, view)
    named = {name: at[other_side(name) if swap else name] for name in names}
    return Detections.of(WALKER, names, np.array([[np.nan] * 2 if n in without else named[n] for n in names]))
