"""The strides of a tracked figure: when each foot strikes and when it leaves the floor.

A foot strikes where its ankle is furthest ahead of the hip and leaves the floor where it is furthest behind
(Zeni, Richards and Higginson, 2008), to a fraction of a frame: with the parabola a t^2 + b t + c fitted
around that frame, at t = -b / 2a. A stride goes from one strike of a foot to its next.

A runner's foot is in the air at both extremes. What it does on the floor is to sweep back about as fast as
the floor goes by: where that takes less of the stride than any walk, it is what counts as stance.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array
from kinematics.sides import Side
from kinematics.spm import joint_jacobian, joints
from tracker.run.track import Track

REACH = 0.2  # leg lengths that the ankle swings at least; less is no stride
PROMINENCE = 0.4  # of that swing, by which an extreme stands out
WINDOW = 0.06  # of a stride, to either side of an extreme: where the parabola is fitted
ODD = (0.6, 1.6)  # of the median: a stride out of this range has missed a strike or made one up
BACKWARDS = -0.5  # leg lengths travelled; below, the figure walks backwards
SWEEP = 0.6  # of its fastest way back: what counts as sweeping
RUNS = 0.45  # of a stride: who sweeps for less runs


@dataclass(frozen=True)
class Event:
    """A moment, in frames with a fraction, and its standard error.

    The error is that of the poses' covariance by the delta method, the errors of frames taken as independent.
    That is cautious: what neighbouring frames err by alike moves no extreme.
    """

    at: float
    error: float


@dataclass(frozen=True)
class Stride:
    """From one strike of a foot to its next; `down` to `off` it is on the floor.

    A walker's foot is down at the strike.
    """

    strike: Event
    down: Event
    off: Event
    end: Event


@dataclass(frozen=True)
class Strides:
    """The strides of one foot that can be measured, in order, and how many more there were.

    Left out are those in which the figure was lost and those of odd length.
    """

    sound: tuple[Stride, ...]
    left_out: int


def strides_of(track: Track, side: Side) -> Strides:
    """The strides of one foot of the walking figure; frames of the clip."""
    found = _found(_Foot.of(track, side))
    seen = [s for s in found if track.measured[int(s.strike.at) : int(np.ceil(s.end.at)) + 1].all()]
    lengths = [s.end.at - s.strike.at for s in seen]
    usual = float(np.median(lengths)) if seen else 0.0
    sound = [
        _moved(stride, track.first)
        for stride, length in zip(seen, lengths, strict=True)
        if ODD[0] * usual < length < ODD[1] * usual
    ]
    return Strides(tuple(sound), len(found) - len(sound))


@dataclass(frozen=True)
class _Foot:
    """A foot's way along the floor.

    ahead : (T,) leg lengths that the ankle is ahead of the hip, the way the figure goes
    """

    track: Track
    ankle: int
    ahead: Array

    @classmethod
    def of(cls, track: Track, side: Side) -> Self:
        ankle = track.figure.joints.index(f"{side}_ankle")
        places = joints(track.figure, track.q)
        # Who walks backwards strikes behind the hip and leaves the floor ahead of it.
        way = -1.0 if track.q[-1, 0] - track.q[0, 0] < BACKWARDS else 1.0
        return cls(track, ankle, way * (places[:, ankle, 0] - places[:, 0, 0]))

    def variances(self, rows: slice) -> Array:
        """Of `ahead`, leg lengths squared."""
        J = joint_jacobian(self.track.figure, self.track.q[rows])
        row = J[:, self.ankle, 0] - J[:, 0, 0]
        return np.asarray(np.einsum("ti,tij,tj->t", row, self.track.cov[rows], row))


def _found(foot: _Foot) -> list[Stride]:
    """Every stride, in order; rows of the track."""
    ahead, measured = foot.ahead, foot.track.measured
    swing = float(np.ptp(np.percentile(ahead[measured], (5, 95)))) if measured.any() else 0.0
    if swing < REACH:
        return []
    strikes, leavings = (_peaks(s * ahead, PROMINENCE * swing) for s in (1.0, -1.0))
    length = float(np.median(np.diff(strikes))) if len(strikes) > 1 else 0.0
    half = max(round(WINDOW * length), 2)
    inside = range(half, len(ahead) - half)
    first, last = (
        [_extreme(foot, int(t), half) for t in turns if t in inside] for turns in (strikes, leavings)
    )
    speed = np.gradient(ahead) if len(ahead) > 1 else ahead
    fast = SWEEP * float(np.percentile(speed[measured], 10))
    return _runners(foot, speed - fast, _joined(first, last))


def _peaks(values: Array, prominence: float) -> NDArray[np.intp]:
    """Rows at which values (T,) turn down, the middle one where several are alike, that stand out.

    Args:
        prominence: how far the values fall on either side, at least, before they are higher than the peak.
    """
    first = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    last = np.append(first[1:], len(values)) - 1
    level = values[first]
    turns = np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])) + 1
    return np.array([t for t in ((first + last) // 2)[turns] if _stands_out(values, t, prominence)], np.intp)


def _stands_out(values: Array, t: int, prominence: float) -> bool:
    higher = np.flatnonzero(values > values[t])
    i = np.searchsorted(higher, t)
    start = higher[i - 1] if i > 0 else 0
    end = higher[i] + 1 if i < len(higher) else len(values)
    return bool(values[t] - max(values[start:t].min(), values[t:end].min()) >= prominence)


def _extreme(foot: _Foot, t: int, half: int) -> Event:
    """Where the parabola around a row turns."""
    fit = np.linalg.pinv(np.vander(np.arange(-half, half + 1.0), 3))
    rows = slice(t - half, t + half + 1)
    a, b, _ = fit @ foot.ahead[rows]
    turn = float(np.clip(-b / (2.0 * a), -half, half))
    slope = -(fit[1] + 2.0 * turn * fit[0]) / (2.0 * a)
    return Event(t + turn, float(np.sqrt(slope**2 @ foot.variances(rows))))


def _joined(strikes: Sequence[Event], leavings: Sequence[Event]) -> list[Stride]:
    """From strike to strike; extremes that stand out come in turns."""
    return [
        Stride(strike, strike, leaving, end)
        for strike, end in pairwise(strikes)
        for leaving in leavings
        if strike.at < leaving.at < end.at
    ]


def _runners(foot: _Foot, excess: Array, strides: Sequence[Stride]) -> list[Stride]:
    """The strides with the foot down for as long as it sweeps back, if they are a runner's; else as they are.

    Args:
        excess: (T,) forward speed of the foot over the sweep's, below 0 in the sweep.
    """
    swept = [_swept(foot, excess, stride) for stride in strides]
    shares = [(s.off.at - s.down.at) / (s.end.at - s.strike.at) for s in swept]
    return swept if shares and np.median(shares) < RUNS else list(strides)


def _swept(foot: _Foot, excess: Array, stride: Stride) -> Stride:
    """The stride with its longest sweep for stance; as it is without a whole one."""
    start, end = int(np.ceil(stride.strike.at)), int(stride.end.at)
    edges = np.flatnonzero(np.diff(np.signbit(excess[start : end + 1]))) + start
    downs = edges[excess[edges] >= 0.0]
    ups = edges[excess[edges] < 0.0]
    sweeps = [(t, ups[ups > t][0]) for t in downs if (ups > t).any()]
    if not sweeps:
        return stride
    down, off = (_crossing(foot, excess, int(t)) for t in max(sweeps, key=lambda sweep: sweep[1] - sweep[0]))
    return Stride(stride.strike, down, off, stride.end)


def _crossing(foot: _Foot, excess: Array, t: int) -> Event:
    """Where a line through rows t and t + 1 crosses zero."""
    rise = excess[t + 1] - excess[t]
    share = -excess[t] / rise
    # The speeds are central differences, the point between them a mean of theirs.
    around = range(t - 1, t + 3)
    weights = 0.5 * np.array([share - 1.0, -share, 1.0 - share, share]) / rise
    inside = [0 <= row < len(excess) for row in around]
    variances = foot.variances(slice(max(t - 1, 0), t + 3))
    return Event(t + float(share), float(np.sqrt(weights[inside] ** 2 @ variances)))


def _moved(stride: Stride, by: int) -> Stride:
    """The stride with frames for rows."""
    events = (stride.strike, stride.down, stride.off, stride.end)
    return Stride(*(Event(event.at + by, event.error) for event in events))
