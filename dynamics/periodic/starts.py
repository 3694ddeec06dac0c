"""Where the search of phase, phase speed and its bend begins: the peaks of a grid, judged by the mean stride.

The frames count as SHARE of independent ones, and a person's own manner as noise.
"""

from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array
from dynamics.stride import Stride, harmonics

SPEEDS, PHASES = 24, 24
REACH = 2.8  # deviations of the phase speed either way
BENDS = (-1.5, -0.75, 0.0, 0.75, 1.5)  # deviations
SHARE = 0.15
TABLE = 120  # phases at which the mean stride is tabled
SLOWEST = 2.0  # radians a second


@dataclass(frozen=True)
class Start:
    """Phase at the origin (radians), phase speed, its bend, and the score in nats."""

    phase: float
    speed: float
    bend: float
    score: float


def starts(stride: Stride, k: int, t: Array, y: Array, most: int) -> list[Start]:
    """The `most` best peaks of the grid for motion k, the best first.

    At times t (T,) seconds from the origin; NaN entries of y (T, M) were not measured. Freedoms that travel
    are not looked at.
    """
    centre, deviation = _speed(stride, k)
    speeds = np.linspace(centre - REACH * deviation, centre + REACH * deviation, SPEEDS)
    speeds = speeds[speeds > SLOWEST]
    phases = 2.0 * np.pi * np.arange(PHASES) / PHASES
    bends = np.array(BENDS)
    rows = np.flatnonzero(np.isfinite(y[:, ~stride.travels]).any(1))
    d = t[rows]
    phase = phases[:, None] + speeds[:, None, None, None] * d + (bends * stride.bend[k])[:, None, None] * d**2
    score = SHARE * _fits(stride, k, phase, y[rows])
    score -= 0.5 * (((speeds - centre) / deviation) ** 2)[:, None, None] + 0.5 * bends[:, None] ** 2
    best = score.max(1)
    found = [
        Start(phases[j], speeds[i], bends[score[i, :, j].argmax()] * stride.bend[k], best[i, j])
        for i, j in _peaks(best)
    ]
    return sorted(found, key=lambda start: -start.score)[:most]


def _speed(stride: Stride, k: int) -> tuple[float, float]:
    """Mean and deviation of the phase speed over the population."""
    at = len(stride.names) * stride.basis
    return float(stride.mean[k, at]), float(np.linalg.norm(stride.root[k, at]))


def _fits(stride: Stride, k: int, phase: Array, y: Array) -> Array:
    """(...) log density of poses (T, M) at phases (..., T), as if frames and freedoms were independent."""
    size = stride.basis
    table = harmonics(2.0 * np.pi * np.arange(TABLE) / TABLE, size)
    at = np.round(phase * (TABLE / (2.0 * np.pi))).astype(np.intp) % TABLE
    spread = np.diagonal(stride.quick[k] + stride.slow[k] + stride.R[k])
    total = np.zeros(phase.shape[:-1])
    for m in np.flatnonzero(~stride.travels):
        own = slice(m * size, (m + 1) * size)
        manner = ((table @ stride.root[k, own]) ** 2).sum(1).mean()
        apart = y[:, m] - (table @ stride.mean[k, own])[at]
        total -= 0.5 * np.nansum(apart**2, axis=-1) / (manner + spread[m])
    return total


def _peaks(score: Array) -> list[tuple[int, int]]:
    """Entries (speed, phase) that none of their eight neighbours exceeds; phases are a circle."""
    padded = np.pad(score, ((1, 1), (0, 0)), constant_values=-np.inf)
    around = [
        np.roll(padded[1 + i : len(padded) - 1 + i], j, axis=1)
        for i in (-1, 0, 1)
        for j in (-1, 0, 1)
        if (i, j) != (0, 0)
    ]
    return [(int(i), int(j)) for i, j in np.argwhere(score >= np.max(around, axis=0))]
