"""Gait figures of a track: cadence, stride and step time, stance share, ranges of motion, symmetry.

Each is a mean over strides with its standard error. That adds in quadrature how much the strides differ and
what the poses' covariance says of each, by the delta method. A figure of both legs is the mean of theirs, its
error that of errors which go together.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kinematics.sides import SIDES, Side
from tracker.gait.strides import Event, Stride, Strides, strides_of
from tracker.run.track import Track

# Joints whose range of motion is told, of either leg and of the trunk.
LEG_JOINTS = ("hip", "knee", "ankle")
TRUNK = "torso"

# A number of each stride, and its variance.
Sample = tuple[float, float]


@dataclass(frozen=True)
class Value:
    """A mean, its standard error, and how many strides or steps it is taken over."""

    mean: float
    error: float
    count: int


@dataclass(frozen=True)
class Measure:
    """One gait figure of either leg and of both; None where it was not measured.

    symmetry : 100 (near - far) / mean of the two, per cent; 0 for legs that do alike
    """

    name: str
    unit: str
    near: Value | None = None
    far: Value | None = None
    both: Value | None = None
    symmetry: Value | None = None


@dataclass(frozen=True)
class Gait:
    """What a track tells of the gait; no measures where there is no whole stride.

    strides : of either foot
    rate    : playback speed by which the film's seconds were multiplied
    """

    measures: tuple[Measure, ...]
    strides: Mapping[Side, Strides]
    rate: float

    @property
    def discord(self) -> float:
        """By how much the legs' stride times differ, as a share: 0 in gait, whatever the limp."""
        lengths = [
            np.mean([stride.end.at - stride.strike.at for stride in of_side.sound])
            for of_side in self.strides.values()
            if of_side.sound
        ]
        return float(max(lengths) / min(lengths) - 1.0) if lengths else 0.0

    @property
    def left_out(self) -> int:
        """Strides that were not measured, because the figure was lost in them or their length is odd."""
        return sum(strides.left_out for strides in self.strides.values())

    def summary(self) -> dict[str, object]:
        """What gait.json says."""
        kinds = ("near", "far", "both", "symmetry")
        return {
            "rate": self.rate,
            "strides_left_out": self.left_out,
            "measures": {
                m.name: {"unit": m.unit} | {kind: _plain(getattr(m, kind)) for kind in kinds}
                for m in self.measures
            },
            "strides": {
                side: [
                    {name: round(getattr(s, name).at, 2) for name in ("strike", "down", "off", "end")}
                    for s in strides.sound
                ]
                for side, strides in self.strides.items()
            },
        }


def gait_of(track: Track, rate: float = 1.0) -> Gait | None:
    """The gait figures of a track; None for a figure without legs by the walking figure's names.

    Args:
        rate: playback speed, 0.5 for a film at half speed; its seconds times this are seconds walked.
    """
    if not {f"{side}_ankle" for side in SIDES} <= set(track.figure.joints):
        return None
    strides = {side: strides_of(track, side) for side in SIDES}
    measures: tuple[Measure, ...] = ()
    if any(strides[side].sound for side in SIDES):
        every = (*_times(track, strides, rate), *_ranges(track, strides))
        measures = tuple(measure for measure in every if measure.both is not None)
    return Gait(measures, strides, rate)


def _times(track: Track, strides: Mapping[Side, Strides], rate: float) -> Iterable[Measure]:
    frames = track.first + np.arange(len(track))
    seconds = track.times * rate

    def span(start: Event, end: Event) -> Sample:
        moments = np.interp([start.at, end.at], frames, seconds)
        pace = (moments[1] - moments[0]) / (end.at - start.at)
        return float(moments[1] - moments[0]), pace**2 * (start.error**2 + end.error**2)

    def lasts(stride: Stride) -> Sample:
        return span(stride.strike, stride.end)

    def stance(stride: Stride) -> Sample:
        length = stride.end.at - stride.strike.at
        share = (stride.off.at - stride.down.at) / length
        # A walker's strike begins the stance as well as the stride.
        if stride.down == stride.strike:
            begun = (1.0 - share) ** 2 * stride.strike.error**2
        else:
            begun = stride.down.error**2 + share**2 * stride.strike.error**2
        var = begun + stride.off.error**2 + share**2 * stride.end.error**2
        return 100.0 * share, 1e4 * var / length**2

    stride = _measure("stride time", "s", _each(strides, lasts))
    steps = {side: [span(*pair) for pair in _steps(strides, side)] for side in SIDES}
    yield Measure("cadence", "steps/min", both=_cadence(stride.both))
    yield Measure(stride.name, stride.unit, stride.near, stride.far, stride.both)  # legs share their strides
    yield _measure("step time", "s", steps)
    yield _measure("stance share", "%", _each(strides, stance))


def _ranges(track: Track, strides: Mapping[Side, Strides]) -> Iterable[Measure]:
    freedoms = track.figure.freedoms
    for joint in LEG_JOINTS:
        of_side = {side: f"{joint}_{side}" for side in SIDES}
        if set(of_side.values()) <= set(freedoms):
            found = {
                side: [_range(track, name, s) for s in strides[side].sound] for side, name in of_side.items()
            }
            yield _measure(f"{joint} range", "deg", found)
    if TRUNK in freedoms:
        either = {side: [_range(track, TRUNK, s) for s in strides[side].sound] for side in SIDES}
        yield Measure(f"{TRUNK} range", "deg", both=_measure("", "", either).both)


def _range(track: Track, freedom: str, stride: Stride) -> Sample:
    """Greatest less least angle of a stride, degrees."""
    k = track.figure.index(freedom)
    rows = slice(int(np.ceil(stride.strike.at)) - track.first, int(stride.end.at) - track.first + 1)
    angles, variances = np.degrees(track.q[rows, k]), np.degrees(np.degrees(track.cov[rows, k, k]))
    top, bottom = angles.argmax(), angles.argmin()
    return float(angles[top] - angles[bottom]), float(variances[top] + variances[bottom])


def _each(strides: Mapping[Side, Strides], told: Callable[[Stride], Sample]) -> dict[Side, list[Sample]]:
    return {side: [told(stride) for stride in strides[side].sound] for side in SIDES}


def _steps(strides: Mapping[Side, Strides], side: Side) -> list[tuple[Event, Event]]:
    """From the other foot's strike within each stride to the strike that ends it."""
    other = strides["far" if side == "near" else "near"].sound
    strikes = {event.at: event for stride in other for event in (stride.strike, stride.end)}
    found = []
    for stride in strides[side].sound:
        within = [strikes[at] for at in sorted(strikes) if stride.strike.at < at < stride.end.at]
        if len(within) == 1:
            found.append((within[0], stride.end))
    return found


def _measure(name: str, unit: str, samples: Mapping[Side, Sequence[Sample]]) -> Measure:
    near, far = (_mean(samples[side]) for side in SIDES)
    return Measure(name, unit, near, far, _both(near, far), _symmetry(near, far))


def _mean(samples: Sequence[Sample]) -> Value | None:
    if not samples:
        return None
    values, variances = np.array(samples).T
    spread = float(np.var(values, ddof=1)) if len(values) > 1 else 0.0
    error = np.sqrt((spread + variances.mean()) / len(values))
    return Value(float(values.mean()), float(error), len(values))


def _both(near: Value | None, far: Value | None) -> Value | None:
    if near is None or far is None:
        return near or far
    mean, error = (near.mean + far.mean) / 2.0, (near.error + far.error) / 2.0
    return Value(mean, error, near.count + far.count)


def _symmetry(near: Value | None, far: Value | None) -> Value | None:
    if near is None or far is None or near.mean + far.mean <= 0.0:
        return None
    total = near.mean + far.mean
    error = 400.0 * np.hypot(far.mean * near.error, near.mean * far.error) / total**2
    return Value(200.0 * (near.mean - far.mean) / total, float(error), min(near.count, far.count))


def _cadence(stride: Value | None) -> Value | None:
    """Two steps a stride."""
    if stride is None:
        return None
    mean = 120.0 / stride.mean
    return Value(mean, mean * stride.error / stride.mean, stride.count)


def _plain(value: Value | None) -> dict[str, float | int] | None:
    if value is None:
        return None
    return {"mean": round(value.mean, 4), "error": round(value.error, 4), "count": value.count}
