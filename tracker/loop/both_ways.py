"""A clip followed one way in time through its anchors, each stretch between two of them both ways.

A template that was cut at an anchor slides off the further it goes, so between two anchors the way there and
the way back are averaged: each counts by how near its own anchor is and how little its pictures cost. Where
a joint is far apart on the two, the figure was lost on one of them; they are then joined where that costs
least.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dynamics.gaussian import Array, Gaussian
from kinematics.spm import joints
from tracker.loop.anchors import FAR, Anchor, anew, passed
from tracker.loop.detections import Detections
from tracker.loop.estimate import NOTHING, Estimate, State
from tracker.loop.tracker import Tracker
from tracker.loop.trail import Trail
from tracker.picture.pyramid import Image


@dataclass(frozen=True)
class Passage:
    """One way through a clip.

    tracker : that goes this way in time
    other   : makes the one that goes the other way
    anchors : by frame, the start frame among them
    way     : +1 ahead, -1 back
    span    : pictures of the frames from one to another, both included, in that order
    smooth  : makes of the estimates of a run those given all of it
    detections : by frame, where joints were detected
    places : by frame, (3, 3) from its pixels to the start frame's, where the camera's path is known
    """

    tracker: Tracker
    other: Callable[[], Tracker]
    anchors: Mapping[int, Anchor]
    way: int
    span: Callable[[int, int], Iterable[Image]]
    smooth: Callable[[Tracker, Iterable[Estimate]], Iterable[Estimate]]
    detections: Mapping[int, Detections] = field(default_factory=dict)
    places: Mapping[int, Array] = field(default_factory=dict)

    def run(
        self, frame: int, state: State, estimate: Estimate, images: Iterable[Image]
    ) -> Iterator[Estimate]:
        """Estimates from the start frame on; `images` are of the frames after it, this way."""
        last = frame
        yield estimate
        for image in images:
            frame += self.way
            state, estimate = self._step(self.tracker, state, frame, image)
            if frame in self.anchors:
                estimate = replace(estimate, back=self._back(frame, last, state, image))
                last = frame
            yield estimate

    def _step(self, tracker: Tracker, before: State, frame: int, image: Image) -> tuple[State, Estimate]:
        """Follow the figure into the next frame, ahead or back in time."""
        place = self.places.get(frame)
        if frame in self.anchors:
            return passed(tracker, before, self.anchors[frame], image, place)
        return tracker.step(before, image, self.detections.get(frame), place)

    def _back(self, frame: int, last: int, state: State, image: Image) -> tuple[Estimate, ...]:
        """From an anchor back to the one before it: the frames between, in this passage's order."""
        other = self.other()

        def run() -> Iterator[Estimate]:
            there, estimate = anew(other, state, self.anchors[frame], image)
            yield estimate
            for t, picture in enumerate(self.span(frame - self.way, last), start=1):
                there, estimate = self._step(other, there, frame - t * self.way, picture)
                yield estimate

        # Hypotheses take forty times the memory of the rest.
        return tuple(replace(each, belief=NOTHING) for each in self.smooth(other, run()))[-2:0:-1]


def prolong(tracker: Tracker, trail: Trail, estimate: Estimate) -> None:
    """Append a frame; before an anchor the frames since the last are joined with those of the way back."""
    if back := estimate.back:
        trail.extend(between_anchors(tracker, trail.pop(len(back)), back))
    trail.append(estimate)


def between_anchors(
    tracker: Tracker, there: Sequence[Estimate], back: Sequence[Estimate]
) -> Sequence[Estimate]:
    """One estimate a frame of those between two anchors, from the way there and the way back."""
    if not there:
        return ()
    ways = [np.array([e.pose.mean for e in way]) for way in (there, back)]
    apart = np.linalg.norm(np.subtract(*(joints(tracker.figure, q) for q in ways)), axis=-1)
    costs = [np.maximum([e.misfit for e in way], 1e-9) for way in (there, back)]
    if apart.max() > FAR:
        until = np.append(0.0, costs[0].cumsum()) + np.append(costs[1][::-1].cumsum()[::-1], 0.0)
        cut = int(until.argmin())
        return [*there[:cut], *back[cut:]]
    near = np.arange(1, len(there) + 1)
    weights = near / costs[1], near[::-1] / costs[0]
    shares = weights[0] / (weights[0] + weights[1])
    return [_between(a, b, share) for a, b, share in zip(there, back, shares, strict=True)]


def _between(a: Estimate, b: Estimate, share: float) -> Estimate:
    """The estimate that has this share of b, with the moments of the mixture of the two.

    Both saw the same pictures, so it is no surer than they are.
    """
    apart = b.pose.mean - a.pose.mean
    spread = share * (1.0 - share) * np.outer(apart, apart)
    pose = Gaussian(
        (1.0 - share) * a.pose.mean + share * b.pose.mean,
        (1.0 - share) * a.pose.cov + share * b.pose.cov + spread,
    )
    return replace(b if share > 0.5 else a, pose=pose)
