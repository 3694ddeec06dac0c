"""Points as of a pose network: hand marks made into paths and spoiled; and what people repair them with."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import median_filter

from dynamics.gaussian import Gaussian
from dynamics.kalman import predict, smooth, update
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
    order = twins(points.names)
    places[wrong] = places[wrong][:, order]
    near = [j for j, name in enumerate(points.names) if name.startswith("near_") and order[j] != j]
    merged = rng.permutation(T) < round(damage.both * T)
    places[np.ix_(merged, order[near])] = places[np.ix_(merged, near)]
    places[rng.permutation(T * J).reshape(T, J) < round(damage.missing * T * J)] = np.nan
    places[middle - damage.hole // 2 :][: damage.hole] = np.nan
    return Spoiled(_points(points.names, places), frozenset(np.flatnonzero(wrong).tolist()))


def twins(names: tuple[str, ...]) -> NDArray[np.intp]:
    """(J,) position of each point's name on the other leg; its own where there is none."""
    other = {"near": "far", "far": "near"}
    found = [f"{other.get(name.split('_')[0])}_{name.split('_')[-1]}" for name in names]
    return np.array([names.index(twin) if twin in names else j for j, twin in enumerate(found)])


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
    A, b = np.array([[1.0, 1.0], [0.0, 1.0]]), np.zeros(2)
    Q = acceleration**2 * np.diag([1e-3, 1.0])
    C, R = np.array([[1.0, 0.0]]), np.array([[jitter**2]])
    paths = np.moveaxis(points.places, 0, -1)[..., None]  # (J, 2, T, 1)
    first = np.moveaxis(filled(points).places[:1], 0, -1)
    mean = np.concatenate([first, np.zeros_like(first)], axis=-1)
    cov = np.diag([(3.0 * jitter) ** 2, FIRST_SPEED**2])
    belief = Gaussian(mean, np.broadcast_to(cov, (*mean.shape, 2)))
    ahead = []
    for t in range(len(points)):
        prior = predict(belief, A, b, Q) if t else belief
        belief, _ = update(prior, paths[..., t, :], C, R)
        ahead.append(belief)
    found = [ahead[-1]]
    for filtered in ahead[-2::-1]:
        found.append(smooth(filtered, found[-1], A, b, Q)[0])
    return replace(points, places=np.stack([each.mean[..., 0] for each in found[::-1]]))


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
