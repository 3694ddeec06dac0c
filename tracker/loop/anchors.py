"""Anchors: further marked frames of a track, and a new start where the marks show the figure elsewhere.

At an anchor the marked joints replace the picture as the measurement. It is linearised about the pose of the
marks and iterated (the iterated extended Kalman filter: Bell and Cathey, 1993); joints that are not marked
measure nothing. Templates slide slowly, which the filter does not model: so an anchor may also shift the pose
and the one before it by the same amount, which leaves the velocity unchanged.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from dynamics.belief import Belief, of_every_state
from dynamics.gaussian import Array, Flags, Gaussian, Ints, apply
from dynamics.kalman import update
from kinematics.figure import ROOT, SCALE, Figure
from kinematics.recover import Marks, recover
from kinematics.spm import joint_jacobian, joints, skeleton
from tracker.loop.estimate import Estimate, State
from tracker.loop.outcome import Outcome
from tracker.loop.tracker import Tracker
from tracker.picture.pyramid import Image
from tracker.registration.templates import Templates

# Standard deviations of marks, leg lengths. Marks repeat to 0.02, but frames around an anchor are
# overconfident: with 0.007 the track is closer to marks between anchors. A hidden joint is a guess.
SEEN, HIDDEN = 0.007, 0.06
ALONG = 0.04  # the same along the limb, since clothes hide the height of a hip or knee
RIGID = 0.2  # the same along a limb of fixed length, which may point towards the camera
SLIDE = 0.03  # slide of templates from one anchor to the next, leg lengths or log units
TURN = float(np.radians(3.0))  # the same for an angle
FAR = 0.25  # error of a joint, leg lengths, above which the track was on something else or exchanged the legs
SIZE = 0.1  # spread of the common log scale at a new start: change of a walker's size in some seconds
PLACE = 10.0  # spread of the root at a new start, leg lengths: anywhere in the picture
ITERATIONS = 4
BLEND = 0.5  # share of an anchor's pixels in the updated templates


@dataclass(frozen=True)
class Anchor:
    """The marked joints of one frame.

    joint   : (J,) positions in `figure.joints`
    pixels  : (J, 2)
    visible : (J,)
    """

    joint: Ints
    pixels: Array
    visible: Flags

    @classmethod
    def of(cls, figure: Figure, places: Marks, hidden: Collection[str] = ()) -> Self:
        """The named pixels whose joints the figure has; `hidden` names the guessed ones."""
        known = [(j, name) for j, name in enumerate(figure.joints) if name in places]
        return cls(
            np.array([j for j, _ in known], dtype=np.intp),
            np.array([places[name] for _, name in known]).reshape(-1, 2),
            np.array([name not in hidden for _, name in known], dtype=bool),
        )


def passed(
    tracker: Tracker, state: State, anchor: Anchor, image: Image, place: Array | None = None
) -> tuple[State, Estimate]:
    """The step to an anchor, from the belief, or as a new start if it is far off or the figure was lost."""
    proposed = tracker.proposed(state.belief)
    priors = tracker.pose(proposed.states)
    state = tracker.with_scene(state, image, priors, place)
    here, expected = tracker.seen_by(state), priors.mean
    places = here.view.to_pixels(joints(tracker.figure, expected[proposed.best]))
    away = np.hypot(*(anchor.pixels - places[anchor.joint]).T).max(initial=0.0) / here.view.unit
    if not state.outcome.measured or away > FAR:
        return anew(tracker, state, anchor, image)
    belief = _measured(here, _loosened(tracker, proposed), anchor, expected)
    return _settled(here, state, belief, anchor, image)


def anew(tracker: Tracker, state: State, anchor: Anchor, image: Image) -> tuple[State, Estimate]:
    """A new start at an anchor, which keeps only size and templates of the previous state."""
    tracker = tracker.seen_by(state)
    slds, size = tracker.slds, tracker.figure.index(SCALE)
    like = tracker.pose(state.belief.merged()).mean
    q = _marked_pose(tracker, anchor, like)
    mean, cov = slds.mean0.copy(), slds.cov0.copy()
    both = slds.shift
    root = both[:, : len(ROOT)]
    cov += PLACE**2 * root @ root.T
    at = both[:, size].argmax()
    mean[:, at], cov[:, at, at] = like[size], SIZE**2
    belief = of_every_state(slds, Gaussian(mean, cov))
    state, estimate = _settled(tracker, state, _measured(tracker, belief, anchor, q), anchor, image)
    return state, replace(estimate, began=True)


def _loosened(tracker: Tracker, belief: Belief) -> Belief:
    """The belief, widened as templates may have slid."""
    slide = np.full(len(tracker.offset), SLIDE)
    slide[len(ROOT) : tracker.figure.index(SCALE)] = TURN
    spread = tracker.slds.shift * slide
    states = belief.states
    return replace(belief, states=Gaussian(states.mean, states.cov + spread @ spread.T))


def _marked_pose(tracker: Tracker, anchor: Anchor, like: Array) -> Array:
    """(D,) the pose of the marks; freedoms that they do not determine are taken from the pose `like`."""
    figure = tracker.figure
    names = [figure.joints[j] for j in anchor.joint]
    if figure.base not in names:
        return like
    q, known = recover(figure, dict(zip(names, tracker.view.to_body(anchor.pixels), strict=True)))
    known[figure.index(SCALE) :] = False
    return np.where(known, q, like)


def _measured(tracker: Tracker, belief: Belief, anchor: Anchor, q: Array) -> Belief:
    """The belief given the marks, with a first linearisation about poses q (..., D)."""
    figure, view, C = tracker.figure, tracker.view, tracker.slds.C
    q = np.broadcast_to(q, (len(belief.cost), len(tracker.offset)))
    for _ in range(ITERATIONS):
        J = joint_jacobian(figure, q)[:, anchor.joint] * view.axes[:, None]
        away = anchor.pixels - view.to_pixels(joints(figure, q))[:, anchor.joint]
        y = (away + apply(J, (q - tracker.offset)[:, None])).reshape(len(q), -1)
        R = _noise(tracker, anchor, q)
        states, log_lik = update(belief.states, y, J.reshape(*y.shape, -1) @ C, R)
        q = tracker.pose(states).mean
    return replace(belief, states=states, cost=belief.cost - log_lik).levelled()


def _noise(tracker: Tracker, anchor: Anchor, q: Array) -> Array:
    """(H, 2J, 2J) covariance of the marks, px^2, for limbs placed by poses (H, D)."""
    figure = tracker.figure
    inner = {link.parent for link in figure.links}
    limb = skeleton(figure, q).direction * np.sign(tracker.view.axes)
    R = np.zeros((len(q), 2 * len(anchor.joint), 2 * len(anchor.joint)))
    for k, (j, seen) in enumerate(zip(anchor.joint, anchor.visible, strict=True)):
        # The base slides along the first link that starts there, other joints along the link that ends there.
        link, along = figure.links[max(j - 1, 0)], limb[:, max(j - 1, 0)]
        sd = SEEN if seen else HIDDEN
        if j > 0 and not link.breathes:
            further = RIGID
        elif j == 0 or (figure.is_leg(link) and link.name in inner):
            further = np.sqrt(max(ALONG**2 - sd**2, 0.0))
        else:
            further = 0.0
        own = slice(2 * k, 2 * k + 2)
        R[:, own, own] = sd**2 * np.eye(2) + further**2 * along[:, :, None] * along[:, None]
    return tracker.view.unit**2 * R


def _settled(
    tracker: Tracker, state: State, belief: Belief, anchor: Anchor, image: Image
) -> tuple[State, Estimate]:
    """The state at an anchor; where templates are updated, from the marked limbs."""
    state = replace(state, belief=belief, outcome=Outcome.OK)
    if tracker.mode.learns:
        state = replace(state, templates=_renewed(tracker, state, anchor, image))
    return state, tracker.estimate(state)


def _renewed(tracker: Tracker, state: State, anchor: Anchor, image: Image) -> Templates:
    now = tracker.templates_at(tracker.pose(state.belief.merged()).mean, image, state.curve)
    ends = anchor.joint - 1
    # A limb whose end is not marked, or guessed, may lie anywhere, so its template is not updated.
    told = np.isin(now.link, ends[anchor.visible])
    trust = np.where(now.known & told, 1.0, 0.0)
    light = state.templates.light
    offset = np.tile(light, (len(tracker.figure.links), 1))
    return state.templates.refreshed(now.colours - light, trust, BLEND, offset)
