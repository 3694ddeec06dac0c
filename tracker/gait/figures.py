"""Gait figures of a track: times, shares, lengths and ranges of motion of strides, and their symmetry."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from dynamics.gaussian import Array
from kinematics.sides import SIDES, Side
from kinematics.spm import joints
from tracker.gait.evened import evened
from tracker.gait.lengths import Known, lengths
from tracker.gait.strides import Stride, Strides, goes_backwards, strides_of
from tracker.gait.times import CONTACT, STANCE, STRIDE, times
from tracker.gait.values import Measure, Sample, each
from tracker.run.track import Track

NEEDED = {word.format(side) for side in SIDES for word in ("{}_knee", "{}_ankle", "knee_{}")}
# Joints whose range of motion is reported, of both legs and of the trunk.
LEG_JOINTS = ("hip", "knee", "ankle")
TRUNK = "torso"
# Peaks that gait analysis reports: the name, and whether the angle is greatest there. The foot is left out,
# as it has too many peaks to distinguish.
TURNS = {"hip": ("hip extension peak", False), "knee": ("knee flexion peak", True)}
LEAST_STANCE = 50.0  # least stance of a walk, per cent of a stride
BENT, WITHIN = 85.0, 10.0  # knee flexion between walks and runs, and a certain difference, degrees
TOP = 98.0  # percentile over frames that counts as the largest flexion of a knee
SLOW = 0.8  # seconds over which the hip's height is averaged
LABELS = {"walk": -1.0, "run": 1.0}


@dataclass(frozen=True)
class Gait:
    """The gait figures of a track; without a whole stride there are no measures.

    strides  : of each foot
    rate     : playback speed, by which the film's seconds were multiplied
    motion   : "walk" or "run"
    backwards: whether the figure goes backwards
    leg      : metres in a leg length, None if lengths are in leg lengths
    warnings : on impossible values, which were left out
    """

    measures: tuple[Measure, ...]
    strides: Mapping[Side, Strides]
    rate: float
    motion: str
    backwards: bool
    leg: float | None
    warnings: tuple[str, ...] = ()

    @property
    def discord(self) -> float:
        """Relative difference of the legs' stride times, which is 0 in every gait, even with a limp."""
        lasting = self.named(STRIDE)
        if lasting is None or lasting.near is None or lasting.far is None:
            return 0.0
        means = lasting.near.mean, lasting.far.mean
        return max(means) / min(means) - 1.0

    @property
    def left_out(self) -> int:
        """Number of strides left out because the figure was lost in them or their duration is implausible."""
        return sum(strides.left_out for strides in self.strides.values())

    def named(self, name: str) -> Measure | None:
        return next((measure for measure in self.measures if measure.name == name), None)

    def summary(self) -> dict[str, object]:
        return {
            "motion": self.motion,
            "rate": self.rate,
            "metres_in_leg": None if self.leg is None else round(self.leg, 4),
            "strides_left_out": self.left_out,
            "warnings": list(self.warnings),
            "measures": {measure.name: measure.plain() for measure in self.measures},
            "strides": {
                side: [
                    {name: round(getattr(s, name).at, 2) for name in ("strike", "off", "end")}
                    for s in strides.sound
                ]
                for side, strides in self.strides.items()
            },
        }


def gait_of(track: Track, rate: float = 1.0, known: Known | None = None) -> Gait | None:
    """The gait figures of a track; None for a figure without legs by the walking figure's names.

    `rate` is the playback speed, 0.5 for a film at half speed, by which the film's seconds are multiplied.
    """
    if not {*track.figure.joints, *track.figure.freedoms} >= NEEDED:
        return None
    film = replace(track, times=track.times * rate)
    track = evened(film)
    run = runs(track)
    strides, leg = strides_of(track, run), None if known is None else known.leg(film)
    gait = Gait((), strides, rate, "run" if run else "walk", goes_backwards(track), leg)
    if not any(strides[side].sound for side in SIDES):
        return gait
    every = (
        *times(track, strides, run),
        *lengths(track, strides, leg),
        *_ranges(track, strides),
        *turns(track, strides),
    )
    measures = tuple(measure for measure in every if measure.both is not None)
    return _possible(replace(gait, measures=measures, strides=_in_film(strides, track, film)))


def runs(track: Track) -> bool:
    """Whether the walking figure runs, decided once for the whole clip and both feet.

    Three cues between -1 for a walk and 1 for a run are added:

    - the largest flexion of the knees: below 81 degrees in all captures of walks, over 90 in all of runs;
    - the correlation of the hip's height, less its slow part, with the distance of the ankles: with the feet
      apart the hip is low in a walk, and high in the flight of a run;
    - the motion model's label of each frame.
    """
    said = [LABELS[motion] for motion in track.motions if motion in LABELS]
    return _bend(track) + _bounce(track) + (float(np.mean(said)) if said else 0.0) > 0.0


def _in_film(strides: Mapping[Side, Strides], track: Track, film: Track) -> Mapping[Side, Strides]:
    """Strides in frames of the film, from those in rows of the evened track."""
    if track is film:
        return strides

    def frame(row: float) -> float:
        seconds = np.interp(row, np.arange(len(track)), track.times)
        return film.first + float(np.interp(seconds, film.times, np.arange(len(film))))

    return {side: of_side.moved(frame) for side, of_side in strides.items()}


def _possible(gait: Gait) -> Gait:
    """The gait figures; an impossible stance of a walk is replaced by a warning."""
    stance = gait.named(STANCE)
    legs = {} if stance is None else {"near": stance.near, "far": stance.far}
    short = [f"{v.mean:.0f} % for the {leg} leg" for leg, v in legs.items() if v and v.mean < LEAST_STANCE]
    if gait.motion == "run" or not short:
        return gait
    said = (
        f"of a walk no foot is on the ground for less than half of its stride, but {' and '.join(short)} was "
        "found: stance, swing and double support are left out; look at the overlay"
    )
    kept = tuple(measure for measure in gait.measures if measure.name not in CONTACT)
    return replace(gait, measures=kept, warnings=(said,))


def _ranges(track: Track, strides: Mapping[Side, Strides]) -> Iterator[Measure]:
    for joint in LEG_JOINTS:
        if found := _of_legs(track, strides, joint, _range):
            yield Measure.of(f"{joint} range", "deg", found)
    if TRUNK in track.figure.freedoms:
        yield Measure.common(f"{TRUNK} range", "deg", each(strides, lambda s: _range(track, TRUNK, s)))


def turns(track: Track, strides: Mapping[Side, Strides]) -> Iterator[Measure]:
    """Times of the peaks of joint angles in the stride, per cent of it."""
    for joint, (name, greatest) in TURNS.items():
        if found := _of_legs(track, strides, joint, partial(_turn, greatest=greatest)):
            yield Measure.of_moments(name, found)


def _of_legs(
    track: Track, strides: Mapping[Side, Strides], joint: str, told: Callable[[Track, str, Stride], Sample]
) -> dict[Side, list[Sample]]:
    """A number for every stride from the angle of its leg's joint; none if the figure lacks one of both
    angles."""
    freedoms = {side: f"{joint}_{side}" for side in SIDES}
    if not set(freedoms.values()) <= set(track.figure.freedoms):
        return {}
    return {side: [told(track, name, s) for s in strides[side].sound] for side, name in freedoms.items()}


def _turn(track: Track, freedom: str, stride: Stride, greatest: bool) -> Sample:
    rows, k = _rows(track, stride), track.figure.index(freedom)
    angles = track.q[rows, k] * (1.0 if greatest else -1.0)
    top = int(angles.argmax())
    share = (track.first + rows.start + top - stride.strike.at) / stride.frames
    # A peak may be in any of the frames around it with as large an angle but for its standard error, and
    # anywhere within its frame, hence the variance of a uniform distribution.
    lower = np.flatnonzero(angles < angles[top] - np.sqrt(track.cov[rows, k, k][top]))
    wide = lower[lower > top].min(initial=len(angles)) - lower[lower < top].max(initial=-1) - 1
    variance = wide**2 / 12.0 + ((1.0 - share) * stride.strike.error) ** 2 + (share * stride.end.error) ** 2
    shared = 100.0 * stride.strike.shared / stride.frames
    return Sample(100.0 * share, 1e4 * variance / stride.frames**2, shared)


def _rows(track: Track, stride: Stride) -> slice:
    """The rows of a track that lie within a stride."""
    return slice(int(np.ceil(stride.strike.at)) - track.first, int(stride.end.at) - track.first + 1)


def _range(track: Track, freedom: str, stride: Stride) -> Sample:
    """Range of an angle in a stride, degrees."""
    k, rows = track.figure.index(freedom), _rows(track, stride)
    angles, variances = np.degrees(track.q[rows, k]), np.degrees(np.degrees(track.cov[rows, k, k]))
    top, bottom = angles.argmax(), angles.argmin()
    return Sample(float(angles[top] - angles[bottom]), float(variances[top] + variances[bottom]))


def _bend(track: Track) -> float:
    knees = [track.figure.index(f"knee_{side}") for side in SIDES]
    seen = track.q[track.measured]
    most = np.degrees(np.percentile(seen[:, knees], TOP, axis=0)).mean() if len(seen) else BENT
    return float(np.clip((most - BENT) / WITHIN, -1.0, 1.0))


def _bounce(track: Track) -> float:
    places = joints(track.figure, track.q)
    near, far = (places[:, track.figure.joints.index(f"{side}_ankle"), 0] for side in SIDES)
    wide = round(SLOW / max(float(np.median(np.diff(track.times))), 1e-3)) if len(track) > 1 else 1
    height = track.q[:, 1] - _mean_around(track.q[:, 1], max(wide, 1))
    apart = np.abs(near - far)
    seen = track.measured
    if seen.sum() < 3 or not (height[seen].std() > 0.0 and apart[seen].std() > 0.0):
        return 0.0
    return float(np.corrcoef(height[seen], apart[seen])[0, 1])


def _mean_around(values: Array, wide: int) -> Array:
    part = slice((wide - 1) // 2, (wide - 1) // 2 + len(values))
    total, count = (np.convolve(each, np.ones(wide))[part] for each in (values, np.ones(len(values))))
    return np.asarray(total / count)
