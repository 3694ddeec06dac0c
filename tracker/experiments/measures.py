"""Common parts of the experiments: noisy poses, errors by person, rivals, gaps, ranges.

Poses are (T, 8) in body units.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from scipy.interpolate import make_interp_spline

from dynamics.gaussian import Array, Flags
from dynamics.motion.tasks import forecasts
from dynamics.slds import SLDS, constant_velocity
from dynamics.viterbi import viterbi
from kinematics.mocap import POSE_COLUMNS
from kinematics.mocap import Sequence as Capture
from tracker.experiments.section import spread
from tracker.experiments.study import FPS
from tracker.models.centred import ANGLES, centred, own_offset

CHANGES = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0)  # process noise, degrees a frame squared
MEASURED = (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 9.0)  # measurement noise, degrees
NOISES = tuple(product(CHANGES, MEASURED))  # pairs that are tried for constant velocity
FIRST_SPEED = 4.0  # prior standard deviation of its first velocity, degrees a frame
SIDE = 10  # least number of frames on each side of a gap
WIDER = 0.05  # share of an angle's range by which it is widened for poses of a walk

Fill = Callable[[Array], Array]
Noises = tuple[float, float]


@dataclass(frozen=True)
class Errors:
    """Squares (6,) of one capture's angles, radians, summed over `count` frames."""

    person: str
    squares: Array = field(repr=False)
    count: int


def errors(person: str, found: Array, wanted: Array) -> Errors:
    """A person's errors: squared differences between the angles of found and wanted poses."""
    return Errors(person, ((found - wanted)[:, ANGLES] ** 2).sum(0), len(wanted))


def rms(every: Iterable[Errors]) -> float:
    """Root mean square error in degrees, pooled over angles and frames; NaN for none."""
    kept = list(every)
    squares = sum(float(e.squares.sum()) for e in kept)
    return float(np.degrees(np.sqrt(squares / sum(6 * e.count for e in kept)))) if kept else float("nan")


def by_person(every: Iterable[Errors]) -> dict[str, float]:
    """Root mean square error of each person in degrees, by name."""
    kept = list(every)
    return {name: rms(e for e in kept if e.person == name) for name in sorted({e.person for e in kept})}


def in_words(every: Sequence[Errors]) -> str:
    """Errors in degrees as text: pooled, and the least and the greatest of the people."""
    return spread(by_person(every).values(), pooled=rms(every))


def noisy(y: Array, degrees: float, rng: np.random.Generator) -> Array:
    """Poses with white noise added to every angle, not to the root."""
    noise = np.r_[0.0, 0.0, np.full(y.shape[1] - 2, np.radians(degrees))]
    return np.asarray(y + noise * rng.normal(size=y.shape))


def wrong_shares(found: Sequence[str], wanted: Sequence[str], far: Flags) -> tuple[float, float]:
    """Per cent with the wrong motion of all frames, and of those that are `far` (NaN for none)."""
    wrong = np.asarray(found) != np.asarray(wanted)
    return 100.0 * float(wrong.mean()), 100.0 * float(wrong[far].mean()) if far.any() else float("nan")


def forecast_errors(captures: Sequence[Capture], means: Sequence[Array], first: int = 1) -> list[Errors]:
    """Errors of forecasts (T or more, 8) from frame `first` on, of the captures that last so long."""
    return [
        errors(c.subject, mean[first : len(c.y)], centred(c.y)[first:])
        for c, mean in zip(captures, means, strict=True)
        if len(c.y) > first
    ]


def rival_errors(
    captures: Sequence[Capture],
    ys: Sequence[Array],
    horizon: int = 1,
    first: int = 1,
    noises: Sequence[Noises] = NOISES,
) -> dict[Noises, list[Errors]]:
    """Errors of constant velocity at each pair of noises, with fixed R, which `predict` could raise."""
    return {
        pair: forecast_errors(captures, [f.mean for f in forecasts(rival(*pair), ys, horizon)], first)
        for pair in noises
    }


def rival(change: float, measured: float) -> SLDS:
    """Constant velocity with noises in degrees: change of speed a frame, and measurement."""
    M = len(POSE_COLUMNS)
    slds = constant_velocity(
        POSE_COLUMNS, np.full(M, np.radians(change)), np.full(M, np.radians(FIRST_SPEED)), FPS
    )
    return replace(slds, R=np.radians(measured) ** 2 * np.eye(M))


def spans(y: Array, gap: int) -> bool:
    """Whether a gap in the middle leaves SIDE frames or more on both sides."""
    return len(y) >= gap + 2 * SIDE


def gappy(y: Array, hole: slice) -> tuple[Array, Array]:
    """Centred poses without the frames of a hole, and the offset to add to the result."""
    blank = y.copy()
    blank[hole] = np.nan
    offset = own_offset(blank)
    return blank - offset, offset


def gap_errors(fill: Fill, capture: Capture, gap: int) -> Errors:
    """Errors of a method on a capture that `spans` a gap of this length in its middle."""
    y, first = capture.y, (len(capture.y) - gap) // 2
    hole = slice(first, first + gap)
    shown, offset = gappy(y, hole)
    return errors(capture.subject, fill(shown)[hole] + offset, y[hole])


def across(degree: int, y: Array) -> Array:
    """Straight lines (1) across the gaps, or a cubic spline (3) through everything measured."""
    t = np.flatnonzero(~np.isnan(y).any(1))
    return np.asarray(make_interp_spline(t, y[t], k=degree)(np.arange(len(y))))


def best_path(slds: SLDS, y: Array) -> Array:
    """Poses smoothed along the papers' best switching path; with one state a motion, a Kalman smoother."""
    return np.asarray(viterbi(slds, y).states.mean[:, : y.shape[1]])


def out_of_range(made: Array, known: Iterable[Array], wider: float) -> Flags:
    """(T,) whether a pose has an angle outside the range of the known poses, widened by a share of it."""
    angles = np.concatenate([centred(y) for y in known])[:, ANGLES]
    low, high = angles.min(0), angles.max(0)
    inside = np.abs(made[:, ANGLES] - 0.5 * (low + high)) <= (0.5 + wider) * (high - low)
    return np.asarray(~inside.all(1))
