"""Legs that pass each other: which of them comes out ahead is asked of the motion once they are apart again.

Where two legs that look alike cover each other, the templates of either hold on to both, and each hypothesis
climbs to where its own prior puts it: a leg that was held back comes out behind, as the other. So what the
pictures told of the legs while they were together is left out, and the motion bridges that stretch from what
was known before. The frames after it then count twice, with the legs named as they were tracked and with
their names exchanged; the motion finds one more likely.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from dynamics.belief import Belief
from dynamics.gaussian import Array
from kinematics.figure import Figure
from kinematics.spm import joints
from tracker.loop.detections import Likelihood
from tracker.loop.estimate import Estimate, State
from tracker.loop.tracker import Tracker

TOGETHER = 0.2  # leg lengths within which knees and ankles are
BEFORE = 3  # frames that they are apart before they meet, where no marks name them: else they may be either
AFTER = 9  # frames that tell them apart
SHORT = 8  # frames together: of longer crossings the motion says little of either way
LONGEST = 60  # frames that they may be together; of longer ones the motion foresees little
# Nats by which the names as tracked must be the more likely after a short crossing: who measured the frames
# after it believed them.
BELIEVED = 10.0

_Path = tuple[list[Belief], float]


@dataclass(frozen=True)
class Crossing:
    """What is known of legs that are near each other; nothing while they are not.

    before   : the state before they met, or at marks where they were together; None while they are apart
    frames   : estimates since then
    together : how many of these until they were last together
    apart    : frames in a row that they have been apart
    """

    before: State | None = None
    frames: tuple[Estimate, ...] = ()
    together: int = 0
    apart: int = 0

    @classmethod
    def at_marks(cls, figure: Figure, state: State, estimate: Estimate) -> Self:
        """In a marked frame, whose marks say which leg is which: they may be together, or meet at once."""
        if (state.templates.strange & figure.layout.breathes).any():
            return cls()  # a lower leg was not marked
        return cls(before=state) if _together(figure, estimate.pose.mean) else cls(apart=BEFORE)

    def followed(
        self, tracker: Tracker, before: State, state: State, estimate: Estimate
    ) -> tuple[Self, State, Estimate]:
        """One frame on; the frame's own state and estimate, or what takes their place.

        Args:
            before: the state of the frame before.
        """
        new = type(self)()
        if not tracker.mode.crossings or estimate.told is None or len(self.frames) == LONGEST:
            return new, state, estimate
        meet = _together(tracker.figure, estimate.told.q[0])
        if self.before is None:
            if meet and self.apart >= BEFORE:
                return replace(new, before=before, frames=(estimate,), together=1), state, estimate
            return replace(new, apart=0 if meet else self.apart + 1), state, estimate
        frames = (*self.frames, estimate)
        together = len(frames) if meet else self.together
        if len(frames) - together < AFTER:
            return replace(self, frames=frames, together=together), state, estimate
        return replace(new, apart=AFTER), *_named(tracker, self.before, frames, together, state)


def _named(
    tracker: Tracker, before: State, frames: Sequence[Estimate], together: int, state: State
) -> tuple[State, Estimate]:
    """The state and estimate of the last frame, with the legs named as the motion finds more likely."""
    figure, told = tracker.figure, [frame.told for frame in frames if frame.told is not None]
    met, after = told[:together], told[together:]
    bridge, _ = _path(tracker, before.belief, [_without_legs(figure, each) for each in met])
    belief = bridge[-1] if bridge else before.belief
    _, as_tracked = _path(tracker, belief, after)
    other, exchanged = _path(tracker, belief, [_exchanged(figure, each) for each in after])
    if as_tracked + (BELIEVED if together < SHORT else 0.0) <= exchanged:
        return state, frames[-1]
    return _instead(tracker, before, frames, [*bridge, *other], state)


def _instead(
    tracker: Tracker, before: State, frames: Sequence[Estimate], beliefs: Sequence[Belief], state: State
) -> tuple[State, Estimate]:
    """State and estimate of the last frame when other beliefs take the place of those of all of them."""
    *past, last = (_with_belief(tracker, *each) for each in zip(frames, beliefs, strict=True))
    # What was taken into the templates since they met may be of either leg.
    state = replace(state, belief=last.belief, templates=before.templates)
    return state, replace(last, instead=tuple(past))


def _path(tracker: Tracker, belief: Belief, told: Sequence[Likelihood]) -> _Path:
    """Beliefs given what each frame told, and minus the log likelihood of that by the best, nats."""
    beliefs, cost = [], 0.0
    for each in told:
        proposed = tracker.proposed(belief)
        fused = tracker.conditioned(proposed, tracker.pose(proposed.states), each)
        belief, cost = fused.levelled(), cost + float(fused.cost.min())
        beliefs.append(belief)
    return beliefs, cost


def _with_belief(tracker: Tracker, estimate: Estimate, belief: Belief) -> Estimate:
    pose, s = tracker.pose(belief.merged()), int(belief.s[belief.best])
    return replace(estimate, pose=pose, s=s, belief=belief)


def _together(figure: Figure, q: Array) -> bool:
    """Whether knees and ankles are near each other; feet point where they like."""
    places = joints(figure, q)
    pairs = [(i, twin) for i, twin in figure.twins.items() if i < twin and figure.layout.breathes[i]]
    apart = [np.hypot(*(places[link + 1] - places[twin + 1])) for link, twin in pairs]
    return max(apart, default=np.inf) < TOGETHER


def _exchanged(figure: Figure, told: Likelihood) -> Likelihood:
    """The same with the names of near and far leg exchanged."""
    order = figure.exchanged
    information = told.information[:, order[:, None], order]
    return replace(told, q=told.q[:, order], information=information, vector=told.vector[:, order])


def _without_legs(figure: Figure, told: Likelihood) -> Likelihood:
    """What is said of everything but the legs, whatever those do (the Schur complement)."""
    order = figure.exchanged
    legs = np.flatnonzero(order != np.arange(len(order)))
    rest = np.flatnonzero(order == np.arange(len(order)))
    information, vector = np.zeros_like(told.information), np.zeros_like(told.vector)
    L, h = told.information[0], told.vector[0]
    # What nothing is said of, a hidden shank, needs no place in the inverse.
    share = L[np.ix_(rest, legs)] @ np.linalg.pinv(L[np.ix_(legs, legs)], hermitian=True)
    information[0][np.ix_(rest, rest)] = L[np.ix_(rest, rest)] - share @ L[np.ix_(legs, rest)]
    vector[0, rest] = h[rest] - share @ h[legs]
    return replace(told, information=information, vector=vector)
