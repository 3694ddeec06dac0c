"""Step and stride length and speed, in leg lengths or, with a known scale, in metres.

A foot's place in the scene is the ankle's mean over the part of its stance in which the foot lies flat: the
difference of two is a step or a stride, independent of the ankle's motion at the strike and while the heel
rises. Speed is what the hip travels in a stride over the stride's time, so every stride has one, also the
last, after which no foot is flat. A moving camera's shift was measured against the scene, so lengths are as
exact as that shift.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from kinematics.sides import OTHER, SIDES, Side
from kinematics.spm import joint_jacobian, joints
from tracker.gait.moments import Event
from tracker.gait.strides import Stride, Strides
from tracker.gait.times import span, steps
from tracker.gait.values import Measure, Sample
from tracker.run.stature import stature
from tracker.run.track import Track

FLAT = (0.2, 0.5)  # part of a stance in which the foot is flat, shares from the strike
LENGTHS = 0.015  # relative error of a tracked figure's lengths on rendered films
STAYS = 0.3  # stride length below which the figure stays in place, as on a treadmill, leg lengths

# A foot's place along the direction of travel, and its variance, leg lengths, by the time of the strike.
Footholds = Mapping[float, tuple[float, float]]


@dataclass(frozen=True)
class Known:
    """Known scale: the person's height in metres, or pixels a metre, or neither."""

    height: float | None = None
    scale: float | None = None

    def leg(self, track: Track) -> float | None:
        """Metres in a leg length; None without a known scale."""
        if self.scale is not None:
            return track.view.unit / self.scale
        if self.height is None:
            return None
        tall = stature(joints(track.figure, track.q), track.figure.joints, track.measured)
        return self.height / tall if np.isfinite(tall) else None


def lengths(track: Track, strides: Mapping[Side, Strides], leg: float | None) -> Iterator[Measure]:
    """All measures of length, without values for a figure that stays in place; `leg` is metres in a leg
    length, None for results in leg lengths."""
    holds = {side: _footholds(track, side, strides[side]) for side in SIDES}
    unit, long = ("leg lengths", 1.0) if leg is None else ("m", leg)

    def apart(start: Event, end: Event, before: Footholds, after: Footholds) -> Iterator[Sample]:
        if start.at in before and end.at in after:
            (x, var), (other_x, other_var) = before[start.at], after[end.at]
            way = long * (other_x - x)
            yield Sample(way, long**2 * (var + other_var), LENGTHS * abs(way))

    of_strides = {
        side: [way for s in strides[side].sound for way in apart(s.strike, s.end, holds[side], holds[side])]
        for side in SIDES
    }
    whole = Measure.of("stride length", unit, of_strides)
    if whole.both is None or whole.both.mean < STAYS * long:
        return
    of_steps = {
        side: [
            way
            for stride, strike in steps(strides, side)
            for way in apart(strike, stride.end, holds[OTHER[side]], holds[side])
        ]
        for side in SIDES
    }
    yield Measure.of("step length", unit, of_steps)
    yield whole
    speeds = {side: [_speed(track, s, long) for s in strides[side].sound] for side in SIDES}
    yield Measure.common("speed", f"{unit}/s", speeds)


def _speed(track: Track, stride: Stride, long: float) -> Sample:
    """The speed of the hip in a stride; an error of its moments changes way and time alike."""
    frames, moments = track.first + np.arange(len(track)), [stride.strike.at, stride.end.at]
    start, end = np.interp(moments, frames, _ahead(track) * track.q[:, 0])
    variance = float(np.interp(moments, frames, track.cov[:, 0, 0]).sum())
    rate = long / span(track, stride.strike, stride.end).value
    speed = rate * float(end - start)
    return Sample(speed, rate**2 * variance, LENGTHS * abs(speed))


def _ahead(track: Track) -> float:
    """The sign of the direction of travel."""
    return 1.0 if track.q[-1, 0] >= track.q[0, 0] else -1.0


def _footholds(track: Track, side: Side, strides: Strides) -> dict[float, tuple[float, float]]:
    """Places of the foot for the strikes that begin or end a measured stride."""
    ankle = track.figure.joints.index(f"{side}_ankle")
    along = _ahead(track) * joints(track.figure, track.q)[:, ankle, 0]
    found: dict[float, tuple[float, float]] = {}
    for stride in strides.sound:
        for strike in (stride.strike, stride.end):
            flat = strike.at - track.first + np.array(FLAT) * (stride.off.at - stride.strike.at)
            begin = int(np.ceil(flat[0]))
            rows = slice(begin, max(int(flat[1]), begin) + 1)
            if rows.stop <= len(track) and track.measured[rows].all():
                # Errors of neighbouring frames are correlated, so the mean gets the variance of one frame.
                by_pose = joint_jacobian(track.figure, track.q[rows])[:, ankle, 0]
                variances = np.einsum("ti,tij,tj->t", by_pose, track.cov[rows], by_pose)
                found[strike.at] = float(along[rows].mean()), float(variances.mean())
    return found
