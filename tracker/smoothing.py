"""Estimates given the whole clip: the best switching path, and along it the Rauch-Tung-Striebel smoother.

A window of frames is smoothed at a time, back from the hypothesis that is best at its end, and its first half
is let go, so that memory does not grow with the clip. Hypotheses of LAG frames ago have nearly always one
common ancestor, and what is seen as much later says nothing more of a pose.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from dynamics.kalman import smooth
from tracker.track import Estimate, Tracker

LAG = 100  # frames: three strides


def smoothed(tracker: Tracker, estimates: Iterable[Estimate], lag: int = LAG) -> Iterator[Estimate]:
    """The estimates of a run, each given those after it as well; at least `lag` of them where there are."""
    window: list[Estimate] = []
    for estimate in estimates:
        window.append(estimate)
        if len(window) == 2 * lag:
            yield from _back(tracker, window)[:lag]
            window = window[lag:]
    yield from _back(tracker, window)


def _back(tracker: Tracker, window: Sequence[Estimate]) -> list[Estimate]:
    """All of a window given all of it."""
    if not window:
        return []
    slds, h = tracker.slds, window[-1].belief.best
    states = window[-1].belief.states[h]
    found = [replace(window[-1], pose=tracker.pose(states))]
    for later, estimate in zip(window[:0:-1], window[-2::-1], strict=True):
        s, h = later.belief.s[h], later.belief.parent[h]
        belief = estimate.belief
        states, _ = smooth(belief.states[h], states, slds.A[s], slds.b[s], slds.Q[s])
        found.append(replace(estimate, pose=tracker.pose(states), s=int(belief.s[h])))
    return found[::-1]
