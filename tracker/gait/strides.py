"""The strides of a tracked figure, each from a foot's strike to its next, with its leaving in between."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from dynamics.gaussian import Flags
from kinematics.direction import gone_back
from kinematics.sides import SIDES, Side
from tracker.gait.moments import OFF, STRIKE, Event, Way, named, read_weights
from tracker.run.track import Track

ODD = (0.6, 1.6)  # range of durations over the median; outside, a strike was missed or is false
TRAVELS = 0.5  # least travel in a stride of somebody who is not on a treadmill, leg lengths
STAND = 0.3  # share of the usual speed below which that person stands
PAUSE = 0.2  # of a stride, which this takes at least

Events = tuple[Event, ...]


@dataclass(frozen=True)
class Stride:
    """From one strike of a foot to its next; the foot is on the ground until `off`."""

    strike: Event
    off: Event
    end: Event

    @property
    def frames(self) -> float:
        return self.end.at - self.strike.at


@dataclass(frozen=True)
class Strides:
    """The measurable strides of one foot, in order, and the number of others.

    Strides in which the figure was lost, those of implausible duration and those that begin or end a stand
    are left out.

    strikes, offs : all moments of this foot, including those of incomplete strides
    """

    sound: tuple[Stride, ...]
    left_out: int
    strikes: Events = ()
    offs: Events = ()

    def moved(self, to: Callable[[float], float]) -> "Strides":
        """With every moment moved to where `to` says."""
        sound = tuple(Stride(*_moved((s.strike, s.off, s.end), to)) for s in self.sound)
        return Strides(sound, self.left_out, _moved(self.strikes, to), _moved(self.offs, to))


def strides_of(track: Track, runs: bool) -> dict[Side, Strides]:
    """The strides of both feet of the walking figure, in frames of the clip."""
    events = _events(track, runs)
    found = {side: _joined(*events[side]) for side in SIDES}
    every = [stride for of_side in found.values() for stride in of_side]
    usual = float(np.median([stride.frames for stride in every])) if every else 0.0
    stands = _stands(track, every)

    def sound(stride: Stride) -> bool:
        return (
            0.0 <= stride.strike.at < stride.end.at <= len(track) - 1
            and bool(track.measured[int(stride.strike.at) : int(np.ceil(stride.end.at)) + 1].all())
            and ODD[0] * usual < stride.frames < ODD[1] * usual
            and not stands[_beside(stride)].any()
        )

    measured = {side: tuple(filter(sound, found[side])) for side in SIDES}
    left_out = {side: max(len(events[side][0]) - 1, 0) - len(measured[side]) for side in SIDES}
    return {
        side: Strides(measured[side], left_out[side], *events[side]).moved(lambda row: row + track.first)
        for side in SIDES
    }


def goes_backwards(track: Track) -> bool:
    """Whether the figure moves against its facing."""
    return len(track) > 0 and bool(gone_back(track.q[:, 0], track.times)[-1])


def between(events: Iterable[Event], start: Event, end: Event) -> Event | None:
    """The single event between two others; None if there is none or several."""
    found = [event for event in events if start.at < event.at < end.at]
    return found[0] if len(found) == 1 else None


def _events(track: Track, runs: bool) -> dict[Side, tuple[Events, Events]]:
    """Strikes and leavings of both feet, in rows of the track."""
    weights, fps = read_weights(), 1.0 / float(np.median(np.diff(track.times))) if len(track) > 1 else 1.0
    back = goes_backwards(track)
    ways = {side: Way.of(track, side) for side in SIDES}
    ways = {side: way.back if back else way for side, way in ways.items()}
    turns = {side: way.turns(fps) for side, way in ways.items()}
    apart = np.concatenate([np.diff(at) for of_side in turns.values() for at in of_side.values()])
    if not len(apart):
        return {side: ((), ()) for side in SIDES}
    period = float(np.median(apart))
    found: dict[Side, tuple[Events, Events]] = {}
    for side, way in ways.items():
        own = [
            tuple(way.moments(turns[side][kind], period, weights[named(kind, runs, way.toes)]))
            for kind in (STRIKE, OFF)
        ]
        if back:  # with time reversed, a leaving is a strike
            own = [_moved(events[::-1], lambda at: len(track) - 1 - at) for events in reversed(own)]
        found[side] = own[0], own[1]
    return found


def _joined(strikes: Events, offs: Events) -> list[Stride]:
    """Strides between successive strikes with exactly one leaving in between."""
    return [
        Stride(strike, off, end) for strike, end in pairwise(strikes) if (off := between(offs, strike, end))
    ]


def _moved(events: Events, to: Callable[[float], float]) -> Events:
    return tuple(replace(event, at=to(event.at)) for event in events)


def _stands(track: Track, strides: Sequence[Stride]) -> Flags:
    """(T,) whether the figure stands, of a figure that travels; all False of one that never does."""
    rows, ends = np.arange(len(track)), np.array([[s.strike.at, s.end.at] for s in strides]).reshape(-1, 2)
    travel, seconds = (
        np.diff(np.interp(ends, rows, values))[:, 0] for values in (track.q[:, 0], track.times)
    )
    if not len(ends) or abs(np.median(travel)) < TRAVELS:
        return np.zeros(len(track), np.bool_)
    pace = float(np.median(travel / seconds))
    later = np.searchsorted(track.times, track.times + PAUSE * float(np.median(seconds)))
    rows = rows[later < len(track)]
    rows = rows[track.measured[rows] & track.measured[later[rows]]]
    speed = (track.q[later[rows], 0] - track.q[rows, 0]) / (track.times[later[rows]] - track.times[rows])
    slow = np.zeros(len(track), np.bool_)
    slow[(rows + later[rows]) // 2] = speed / pace < STAND
    return slow


def _beside(stride: Stride) -> slice:
    """Rows of the stride and half a stride on either side."""
    half = 0.5 * stride.frames
    return slice(max(int(np.ceil(stride.strike.at - half)), 0), int(stride.end.at + half) + 1)
