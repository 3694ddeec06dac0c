"""The start of the loop: belief and templates in the marked frame."""

from dataclasses import replace

import numpy as np

from dynamics.belief import Belief, first_belief
from kinematics.figure import SCALE, Flags
from kinematics.recover import Start
from kinematics.spm import covering, skeleton
from tracker.loop.estimate import Estimate, State
from tracker.loop.tracker import Tracker
from tracker.picture.backdrop import first_backdrop
from tracker.picture.camera import Camera
from tracker.picture.pyramid import Image
from tracker.picture.tone import tone_curve
from tracker.registration.templates import Templates

# Standard deviations of the marks: hip, leg lengths; angles, radians; log lengths.
START_PLACE, START_ANGLE, START_LENGTH = 0.02, float(np.radians(5.0)), 0.01
GUESSED = 2.0  # factor on the error of an angle whose limb has a guessed tip or looks short


def begin(
    tracker: Tracker, start: Start, image: Image, belief: Belief | None = None
) -> tuple[State, Estimate]:
    """Cut the templates from the start frame and start from the belief there, None for that of the marks."""
    box = tracker.box(start.q[None])
    curve = tone_curve(image, box, tracker.mode.contrast)
    state = State(
        belief or start_belief(tracker, start),
        _templates(tracker, start, image, curve),
        curve,
        Camera(image, box) if tracker.settings.camera else None,
        first_backdrop(image, box, tracker.view.unit, curve) if tracker.mode.backdrop else None,
    )
    return state, replace(tracker.estimate(state), began=True)


def start_belief(tracker: Tracker, start: Start) -> Belief:
    """The belief from the marks of the start frame."""
    D, layout = len(start.q), tracker.figure.layout
    noise = np.full(D, START_ANGLE)
    noise[:2] = START_PLACE
    noise[tracker.figure.index(SCALE) :] = START_LENGTH
    guessed = _guessed(tracker, start)
    noise[layout.angle[guessed & layout.turns]] *= GUESSED
    y = np.where(start.known, start.q - tracker.offset, np.nan)
    y[layout.stretch[guessed & layout.breathes]] = np.nan
    return first_belief(tracker.slds, y, np.diag(noise**2))


def _templates(tracker: Tracker, start: Start, image: Image, curve: Image) -> Templates:
    if not tracker.mode.learns:
        return tracker.templates_at(start.q, image, curve)
    layout = tracker.figure.layout
    # A foot, whose length is fixed, is short and near its rest angle: it need not be marked.
    turned = ~layout.turns | ~layout.breathes | start.known[layout.angle]
    turned &= ~_guessed(tracker, start)
    placed = np.array([turned[chain].all() for chain in tracker.figure.chain])
    return tracker.templates_at(start.q, image, curve, placed).completed(
        tracker.figure, 2.0 * tracker.settings.spacing
    )


def _guessed(tracker: Tracker, start: Start) -> Flags:
    """(L,) whether a link's appearance is unknown: it is foreshortened, or something hides its tip."""
    figure, bones = tracker.figure, skeleton(tracker.figure, start.q)
    own = covering(figure, bones, bones.tip, np.arange(len(figure.links)), tracker.settings.mark)
    hidden = np.array([link.joint in start.hidden for link in figure.links])
    return (hidden & ~own) | [link.name in start.foreshortened for link in figure.links]
