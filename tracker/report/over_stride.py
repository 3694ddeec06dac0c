"""Joint angles over the stride, as the plots take them: every stride, mean and band, what people have."""

from typing import Any

import numpy as np

from dynamics.gaussian import Array
from kinematics.sides import SIDES
from tracker.gait.curves import over_strides, read_norms, spread
from tracker.gait.figures import Gait
from tracker.gait.strides import BACKWARDS
from tracker.gait.times import STANCE
from tracker.run.track import Track

Drawn = dict[str, Any]


def legs_of(track: Track, gait: Gait, joint: str) -> dict[str, Drawn]:
    """Degrees of each leg that has the joint and whole strides; `off` is when the foot leaves, per cent."""
    legs: dict[str, Drawn] = {}
    for side in SIDES:
        freedom = f"{joint}_{side}"
        if freedom not in track.figure.freedoms:
            continue
        angle = np.degrees(track.q[:, track.figure.index(freedom)])
        curves = over_strides(angle, gait.strides[side].sound, track.first)
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


def norm_of(track: Track, gait: Gait, joint: str) -> Drawn | None:
    """What people have who walk forwards, or run; None where not enough of them were captured."""
    norm = read_norms().get(f"{gait.motion}_{joint}")
    if norm is None or goes_backwards(track):
        return None
    return {"mean": tenths(norm.mean), "sigma": tenths(norm.sigma), "people": norm.people}


def goes_backwards(track: Track) -> bool:
    """Whether the figure goes where its back is."""
    return bool(track.q[-1, 0] - track.q[0, 0] < BACKWARDS)


def tenths(values: Array) -> list[float]:
    """Numbers as the page holds them."""
    return [round(float(value), 1) for value in values]
