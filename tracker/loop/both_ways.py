"""A clip followed in one direction through its anchors, with both directions between two anchors.

A template that was cut at an anchor slides more the longer it is followed, so between two anchors the pass
forth and the pass back are averaged, weighted by the distance from their anchors and by their misfit. Where a
joint differs much between the two, the figure was lost in one of them; they join where that costs least.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, count, pairwise

import numpy as np

from dynamics.gaussian import Array, Gaussian
from kinematics.figure import ROOT, SCALE
from kinematics.spm import joints
from tracker.loop.anchors import FAR, Anchor, anew, passed
from tracker.loop.detections import Detections
from tracker.loop.estimate import NOTHING, Estimate, State
from tracker.loop.outcome import Outcome
from tracker.loop.tracker import Tracker
from tracker.loop.trail import Trail
from tracker.picture.pyramid import Image, same

ALIKE = 5  # pictures alike in a row by a conversion of the film; more show that nothing moves
LEAST = 1e-9  # least misfit that a frame is weighted by
MORE = 1.0 + 1e-6  # factor by which losing the figure costs more than the worst misfit


@dataclass(frozen=True)
class Passage:
    """A pass through a clip in one direction.

    tracker : runs in this direction
    other   : makes the tracker that runs in the other direction
    anchors : by frame, the start frame among them
    way     : +1 forwards, -1 backwards
    span    : gives the pictures of the frames from one to another, both included, in that order
    smooth  : smooths the estimates of a run
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
        self, frame: int, state: State, estimate: Estimate, image: Image, images: Iterable[Image]
    ) -> Iterator[Estimate]:
        """Estimates from the start frame, of this image, on; `images` follow it in this direction."""
        last, frames, images = frame, count(frame + self.way, self.way), chain([image], images)
        yield estimate
        followed = self._steps(self.tracker, state, estimate, frames, images)
        for frame, image, state, estimate in followed:
            if frame in self.anchors:
                estimate = replace(estimate, back=self._back(frame, last, state, image))
                last = frame
            yield estimate

    def _steps(
        self,
        tracker: Tracker,
        state: State,
        estimate: Estimate,
        frames: Iterable[int],
        images: Iterable[Image],
    ) -> Iterator[tuple[int, Image, State, Estimate]]:
        """Follow the figure into further frames of either direction.

        In a picture that repeats the one before, nothing has moved: state and estimate stay. The first image
        is that of `state`.
        """
        alike = 1
        for frame, (before, image) in zip(frames, pairwise(images), strict=False):
            alike = alike + 1 if same(before, image) else 1
            place = self.places.get(frame)
            if frame in self.anchors:
                state, estimate = passed(tracker, state, self.anchors[frame], image, place)
            elif 1 < alike <= ALIKE:
                # It is found again once, not in every repetition.
                outcome = Outcome.OK if estimate.outcome is Outcome.FOUND else estimate.outcome
                estimate = replace(estimate, outcome=outcome, began=False, repeats=True)
            else:
                state, estimate = tracker.step(state, image, self.detections.get(frame), place)
            yield frame, image, state, estimate

    def _back(self, frame: int, last: int, state: State, image: Image) -> tuple[Estimate, ...]:
        """The pass from an anchor back to the one before it: the frames between, in this passage's order."""
        other = self.other()

        def run() -> Iterator[Estimate]:
            there, estimate = anew(other, state, self.anchors[frame], image)
            yield estimate
            frames, images = count(frame - self.way, -self.way), self.span(frame - self.way, last)
            found = self._steps(other, there, estimate, frames, chain([image], images))
            yield from (each for *_, each in found)

        # Hypotheses, which take forty times the memory of the rest, are dropped.
        return tuple(replace(each, belief=NOTHING) for each in self.smooth(other, run()))[-2:0:-1]


def prolong(tracker: Tracker, trail: Trail, estimate: Estimate) -> None:
    """Append a frame; at an anchor, first join the frames since the last one with those of the pass back."""
    if back := estimate.back:
        trail.extend(between_anchors(tracker, trail.pop(len(back)), back))
    trail.append(estimate)


def between_anchors(
    tracker: Tracker, there: Sequence[Estimate], back: Sequence[Estimate]
) -> Sequence[Estimate]:
    """One estimate for each frame between two anchors, from the pass forth and the pass back."""
    if not there:
        return ()
    back = [_in_scene_of(a, b, tracker) for a, b in zip(there, back, strict=True)]
    ways = [np.array([e.pose.mean for e in way]) for way in (there, back)]
    apart = np.linalg.norm(np.subtract(*(joints(tracker.figure, q) for q in ways)), axis=-1)
    worst = (max(e.misfit for e in (*there, *back)) or 1.0) * MORE
    costs = [
        np.array([max(e.misfit if e.outcome.measured else worst, LEAST) for e in way])
        for way in (there, back)
    ]
    if apart.max() > FAR:
        until = np.append(0.0, costs[0].cumsum()) + np.append(costs[1][::-1].cumsum()[::-1], 0.0)
        least = np.flatnonzero(until <= until.min() + LEAST)
        cut = int(least[len(least) // 2])  # where both passes are lost, each is taken half of the way
        return [*there[:cut], *back[cut:]]
    near = np.arange(1, len(there) + 1)
    weights = near / costs[1], near[::-1] / costs[0]
    shares = weights[0] / (weights[0] + weights[1])
    return [_between(a, b, share) for a, b, share in zip(there, back, shares, strict=True)]


def _in_scene_of(a: Estimate, b: Estimate, tracker: Tracker) -> Estimate:
    """The estimate b in the same pixels, its pose relative to the scene where a has it."""
    mean, ways = b.pose.mean.copy(), [tracker.view.moved(each.moved) for each in (a, b)]
    mean[: len(ROOT)] = ways[0].to_body(ways[1].to_pixels(mean[: len(ROOT)]))
    mean[tracker.figure.index(SCALE)] += np.log(ways[1].unit / ways[0].unit)
    return replace(b, pose=Gaussian(mean, b.pose.cov), moved=a.moved)


def _between(a: Estimate, b: Estimate, share: float) -> Estimate:
    """The estimate that has this share of b, with the moments of the mixture of the two.

    Both passes used the same pictures, so the result is no more certain than they are.
    """
    apart = b.pose.mean - a.pose.mean
    spread = share * (1.0 - share) * np.outer(apart, apart)
    pose = Gaussian(
        (1.0 - share) * a.pose.mean + share * b.pose.mean,
        (1.0 - share) * a.pose.cov + share * b.pose.cov + spread,
    )
    return replace(b if share > 0.5 else a, pose=pose)
