"""Joint angles over the stride for plots, from a foot's strike, at 0 per cent, to its next, at 100.

Every stride is sampled at the same 101 shares of its duration, so that strides of any duration and frame rate
can be overlaid and averaged. The reference bands come from captures, by `tests.benchmarks.gait.norms`.
"""

from collections.abc import Iterable
from importlib import resources
from typing import Any

import numpy as np

from dynamics.gaussian import Array
from kinematics.sides import SIDES
from tracker.gait.figures import Gait
from tracker.gait.strides import Stride
from tracker.gait.times import STANCE
from tracker.run.track import Track

Drawn = dict[str, Any]
SHARES = np.linspace(0.0, 1.0, 101)


def legs_of(track: Track, gait: Gait, joint: str) -> dict[str, Drawn]:
    """Curves in degrees for each leg with this joint and whole strides; `off` is the foot's leaving, per
    cent."""
    legs: dict[str, Drawn] = {}
    for side in SIDES:
        freedom = f"{joint}_{side}"
        if freedom not in track.figure.freedoms:
            continue
        angle = np.degrees(track.q[:, track.figure.index(freedom)])
        curves = over_strides(angle, gait.strides[side].sound, track.times, track.first)
        if len(curves):
            sigma, stance = spread(curves), gait.named(STANCE)
            off = None if stance is None else getattr(stance, side)
            legs[side] = {
                "strides": [tenths(curve) for curve in curves],
                "mean": tenths(curves.mean(axis=0)),
                "sigma": None if sigma is None else tenths(sigma),
                "off": None if off is None else round(off.mean, 1),
            }
    return legs


def norm_of(gait: Gait, joint: str) -> Drawn | None:
    """The reference band of people who walk forwards, or run: mean of their means over all strides, and
    standard deviation between them, degrees; None if too few of them were captured."""
    source, name = resources.files("tracker.gait") / "norms.npz", f"{gait.motion}_{joint}"
    with resources.as_file(source) as file, np.load(file) as stored:
        if gait.backwards or name not in stored:
            return None
        people, mean, sigma = np.split(stored[name], [1, 102])
    return {"mean": tenths(mean), "sigma": tenths(sigma), "people": int(people[0])}


def tenths(values: Array) -> list[float]:
    """Numbers to one decimal, as stored in the report's page."""
    return [round(float(value), 1) for value in values]


def over_strides(angle: Array, strides: Iterable[Stride], times: Array, first: int = 0) -> Array:
    """(S, 101) an angle (T,) over each of S strides, in its unit, at even shares of their time.

    `times` (T,) in seconds are those of the clip's frames from `first` on.
    """
    frames = first + np.arange(len(angle))
    spans = (np.interp([s.strike.at, s.end.at], frames, times) for s in strides)
    found = [np.interp(start + SHARES * (end - start), times, angle) for start, end in spans]
    return np.array(found).reshape(-1, len(SHARES))


def spread(curves: Array) -> Array | None:
    """Standard deviation (101,) of curves (S, 101); None for fewer than two."""
    return np.std(curves, axis=0, ddof=1) if len(curves) > 1 else None
