"""Estimates given the whole clip: the best switching path, and along it the Rauch-Tung-Striebel smoother.

A window of frames is smoothed at a time, back from the best hypothesis at its end, and its first part is then
released, so that memory does not grow with the clip. Hypotheses nearly always have a common ancestor three
strides ago, and frames that much later add nothing to a pose.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from dynamics.belief import Belief, of_every_state
from dynamics.gaussian import Array, Gaussian, joint
from dynamics.kalman import predict, smooth
from dynamics.slds import SLDS
from tracker.loop.estimate import Estimate
from tracker.loop.tracker import Tracker

LAG = 3.3  # three strides, seconds
FEWEST, MOST = 100, 300  # frames of it at least, and at most, which bounds memory


def smoothed(tracker: Tracker, estimates: Iterable[Estimate], lag: int | None = None) -> Iterator[Estimate]:
    """The estimates of a run, each given also later ones, at least `lag` of them if there are as many.

    Their beliefs are the single hypothesis of the best path. Smoothing crosses no new start; LAG is usual.
    """
    lag = lag or min(max(round(LAG * tracker.slds.fps), FEWEST), MOST)
    window: list[Estimate] = []
    for estimate in estimates:
        if estimate.began:
            yield from _back(tracker, window)
            window = []
        window.append(estimate)
        if len(window) == 2 * lag:
            yield from _back(tracker, window)[:lag]
            window = window[lag:]
    yield from _back(tracker, window)


def turned_belief(slds: SLDS, first: Belief, second: Belief) -> Belief:
    """The belief in the first frame of a smoothed run, from which to follow in the opposite direction.

    A second-order state holds the pose and the one before it, which is the one after in the other direction.
    The switching state is left open. `first` is filtered, `second`, of the frame after, smoothed.
    """
    s, h = second.s[0], second.parent[0]
    there = second.states[0]
    here, lag = _smooth(slds, first.states[h], there, s, second.wider[0])
    start = joint(here, there, lag.T).through(slds.layout.turned)
    states = Gaussian(np.tile(start.mean, (slds.K, 1)), np.tile(start.cov, (slds.K, 1, 1)))
    return of_every_state(slds, states)


def _back(tracker: Tracker, window: Sequence[Estimate]) -> list[Estimate]:
    """The estimates of a window, each smoothed given all of them."""
    if not window:
        return []
    slds, h = tracker.slds, window[-1].belief.best
    states = window[-1].belief.states[h]
    found = [_alone(tracker, window[-1], states, h)]
    for later, estimate in zip(window[:0:-1], window[-2::-1], strict=True):
        if not later.repeats:
            s, wider, h = later.belief.s[h], later.belief.wider[h], later.belief.parent[h]
            states, _ = _smooth(slds, estimate.belief.states[h], states, s, wider)
        found.append(_alone(tracker, estimate, states, h))
    return found[::-1]


def _smooth(slds: SLDS, filtered: Gaussian, later: Gaussian, s: int, wider: float) -> tuple[Gaussian, Array]:
    """As `dynamics.kalman.smooth` in switching state s, if the predicted covariance was increased so."""
    A, b, Q = slds.A[s], slds.b[s], slds.Q[s]
    return smooth(filtered, later, A, b, Q + (wider - 1.0) * predict(filtered, A, b, Q).cov)


def _alone(tracker: Tracker, estimate: Estimate, states: Gaussian, h: int) -> Estimate:
    """The estimate reduced to hypothesis h, with this Gaussian over the state."""
    belief = replace(estimate.belief.at([h]), states=states[None], cost=np.zeros(1))
    return replace(estimate, pose=tracker.pose(states), s=int(belief.s[0]), belief=belief)
