"""Points as of a pose network: hand marks made into paths and spoiled; and what people repair them with."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import median_filter

from dynamics.slds import constant_velocity as slds_of
from dynamics.viterbi import viterbi_all
from kinematics.sides import exchanged
from tracker.foreign.points import Points
from tracker.run.score import Places
from tracker.tables.keypoints import KEYPOINTS, Marks

Array = NDArray[np.float64]

FEWEST = 4  # marks of a joint that a path is laid through
MEDIAN = 5  # frames
FIRST_SPEED = 20.0  # px a frame, standard deviation


@dataclass(frozen=True)
class Damage:
    """What is done to points, all of it at once.

    jitter    : px a coordinate
    exchanged : share of the frames whose legs are named the wrong way round
    missing   : share of the points that are not there
    stretch   : frames in the middle whose legs are named the wrong way round
    hole      : frames in the middle without any point
    both      : share of the frames in which both legs have the near leg's points
    """

    jitter: float = 5.0
    exchanged: float = 0.0
    missing: float = 0.0
    stretch: int = 0
    hole: int = 0
    both: float = 0.0


@dataclass(frozen=True)
class Spoiled:
    """Spoiled points, and the frames whose legs are named the wrong way round."""

    points: Points
    exchanged: frozenset[int]


def splined(marks: Marks) -> Points:
    """A smooth path of every joint through its marks, frames from 0 to the last marked one."""
    names = tuple(name for name in KEYPOINTS if sum(name in row for row in marks.values()) >= FEWEST)
    places = np.full((max(marks) + 1, len(names), 2), np.nan)
    for j, name in enumerate(names):
        frames = [t for t in sorted(marks) if name in marks[t]]
        path = CubicSpline(frames, [(marks[t][name].x, marks[t][name].y) for t in frames])
        within = np.arange(frames[0], frames[-1] + 1)
        places[within, j] = path(within)
    return _points(names, places)


def spoil(points: Points, damage: Damage, rng: np.random.Generator) -> Spoiled:
    """The points with this damage."""
    T, J, _ = points.places.shape
    places = points.places + rng.normal(0.0, damage.jitter, points.places.shape)
    frames, middle = rng.permutation(T), T // 2
    wrong = frames < round(damage.exchanged * T)
    wrong[middle - damage.stretch // 2 :][: damage.stretch] = True
    order = exchanged(points.names)
    places[wrong] = places[wrong][:, order]
    near = [j for j, name in enumerate(points.names) if name.startswith("near_") and order[j] != j]
    merged = rng.permutation(T) < round(damage.both * T)
    places[np.ix_(merged, order[near])] = places[np.ix_(merged, near)]
    places[rng.permutation(T * J).reshape(T, J) < round(damage.missing * T * J)] = np.nan
    places[middle - damage.hole // 2 :][: damage.hole] = np.nan
    return Spoiled(_points(points.names, places), frozenset(np.flatnonzero(wrong).tolist()))


def filled(points: Points) -> Points:
    """Gaps filled by lines."""
    places, frames = points.places.copy(), np.arange(len(points))
    for path in places.reshape(len(frames), -1).T:
        seen = np.isfinite(path)
        path[...] = np.interp(frames, frames[seen], path[seen])
    return replace(points, places=places)


def median(points: Points) -> Points:
    """Gaps filled by lines, then the median of five frames."""
    return replace(points, places=median_filter(filled(points).places, (MEDIAN, 1, 1), mode="nearest"))


def constant_velocity(points: Points, acceleration: float, jitter: float) -> Points:
    """Every coordinate by a Kalman smoother of constant velocity; gaps measure nothing.

    Args:
        acceleration: change of the speed a frame, px.
        jitter: standard deviation of a coordinate, px.
    """
    unit = 3.0 * jitter
    slds = slds_of(("place",), [acceleration / unit], [FIRST_SPEED / unit], 1.0)
    paths, first = points.places.reshape(len(points), -1), filled(points).places[0].ravel()
    found = viterbi_all(replace(slds, R=np.eye(1) / 9.0), list(((paths - first) / unit).T[..., None]))
    places = first + unit * np.stack([each.states.mean[:, 0] for each in found], axis=1)
    return replace(points, places=places.reshape(points.places.shape))


def by_frame(points: Points) -> dict[int, Places]:
    """Places by frame and name, those that are there."""
    return {
        t: {
            name: (float(x), float(y))
            for name, (x, y) in zip(points.names, row, strict=True)
            if np.isfinite(x)
        }
        for t, row in enumerate(points.places)
    }


def _points(names: tuple[str, ...], places: Array) -> Points:
    return Points(names, places, np.where(np.isfinite(places[..., 0]), 1.0, 0.0))
