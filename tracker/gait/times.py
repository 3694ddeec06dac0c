"""Times and shares of strides: durations, and when one foot, both or none is on the ground."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from kinematics.sides import OTHER, SIDES, Side
from tracker.gait.moments import Event
from tracker.gait.strides import Stride, Strides, between
from tracker.gait.values import Measure, Sample, Value, each
from tracker.run.track import Track

STRIDE = "stride time"
STANCE, SWING, DOUBLE = CONTACT = ("stance share", "swing share", "double support")


def times(track: Track, strides: Mapping[Side, Strides], runs: bool) -> Iterator[Measure]:
    """All measures of time, including those without a value."""
    spans = each(strides, lambda s: span(track, s.strike, s.end))
    both, stances = Measure.common(STRIDE, "s", spans).both, each(strides, _stance)
    yield Measure("cadence", "steps/min", both=_cadence(both))
    yield replace(Measure.of(STRIDE, "s", spans), both=both, symmetry=None)  # both legs have the same
    of_steps = {side: [span(track, strike, s.end) for s, strike in steps(strides, side)] for side in SIDES}
    yield Measure.of("step time", "s", of_steps)
    yield Measure.of(STANCE, "%", stances)
    yield Measure.of(
        SWING, "%", {side: [s._replace(value=100.0 - s.value) for s in stances[side]] for side in SIDES}
    )
    if runs:
        flights = {side: [_flight(track, *each) for each in steps(strides, side)] for side in SIDES}
        yield Measure.of("flight time", "s", flights)
    else:
        yield Measure.common(DOUBLE, "%", {side: list(_together(strides, side)) for side in SIDES})


def span(track: Track, start: Event, end: Event) -> Sample:
    """Seconds from one moment to another of the same kind; their shared errors cancel."""
    begun, ended = np.interp([start.at, end.at], track.first + np.arange(len(track)), track.times)
    return Sample(float(ended - begun), _pace(track) ** 2 * (start.error**2 + end.error**2))


def steps(strides: Mapping[Side, Strides], side: Side) -> Iterator[tuple[Stride, Event]]:
    """Each stride in which the other foot strikes once, and that strike; the step is from there to the
    stride's end."""
    for stride in strides[side].sound:
        if strike := between(strides[OTHER[side]].strikes, stride.strike, stride.end):
            yield stride, strike


def _pace(track: Track) -> float:
    """Seconds from frame to frame."""
    return float(np.ptp(track.times)) / max(len(track) - 1, 1)


def _stance(stride: Stride) -> Sample:
    share = (stride.off.at - stride.strike.at) / stride.frames
    # The same strike begins stance and stride, so its error enters both.
    begun, ended = (1.0 - share) * stride.strike.error, share * stride.end.error
    variance = (begun**2 + ended**2 + stride.off.error**2) / stride.frames**2
    return Sample(100.0 * share, 1e4 * variance, 100.0 * _shared(stride) / stride.frames)


def _shared(stride: Stride) -> float:
    """Shared error of a time between a strike and a leaving, frames."""
    return float(np.hypot(stride.strike.shared, stride.off.shared))


def _together(strides: Mapping[Side, Strides], side: Side) -> Iterator[Sample]:
    """The share of each stride in which both feet are on the ground, per cent."""
    for stride, strike in steps(strides, side):
        if off := between(strides[OTHER[side]].offs, stride.strike, stride.off):
            length = stride.frames
            frames = (off.at - stride.strike.at) + (stride.off.at - strike.at)
            variance = sum(event.error**2 for event in (stride.strike, off, stride.off, strike))
            yield Sample(
                100.0 * frames / length, 1e4 * variance / length**2, 200.0 * _shared(stride) / length
            )


def _flight(track: Track, stride: Stride, strike: Event) -> Sample:
    """Seconds from the leaving to the other foot's strike."""
    return span(track, stride.off, strike)._replace(shared=_pace(track) * _shared(stride))


def _cadence(stride: Value | None) -> Value | None:
    if stride is None:
        return None
    mean = 120.0 / stride.mean
    return Value(mean, mean * stride.error / stride.mean, stride.count)
