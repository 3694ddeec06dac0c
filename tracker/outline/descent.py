"""L-BFGS: Newton's way down a function whose curvature is taken from the last few steps.

Liu and Nocedal (1989), with steps halved until the function falls enough (Armijo).
"""

from collections import deque
from collections.abc import Callable, Iterable

import numpy as np

from kinematics.figure import Array

Cost = Callable[[Array], tuple[float, Array]]
Pair = tuple[Array, Array]

ENOUGH = 1e-4  # share of what the slope promises by which a step must lower the function
HALVINGS = 20  # of a step at most
SMALL = 2e-9  # share of the function by which a step must lower it, or the way ends


def lowest(cost: Cost, z: Array, remembered: int, rounds: int) -> tuple[Array, float]:
    """Where a function is lowest about z (N,), and how low.

    Args:
        cost: its value and slope (N,) at a place (N,).
        remembered: steps that the curvature is taken from.
        rounds: steps at most.
    """
    value, slope = cost(z)
    pairs: deque[Pair] = deque(maxlen=remembered)
    for _ in range(rounds):
        way = -_straightened(slope, pairs)
        share = 1.0 if pairs else 1.0 / max(float(np.linalg.norm(slope)), 1.0)
        fall = float(slope @ way)
        for _ in range(HALVINGS):
            lower, steeper = cost(z + share * way)
            if lower <= value + ENOUGH * share * fall:
                break
            share *= 0.5
        else:
            break
        step, turn, gain = share * way, steeper - slope, value - lower
        if step @ turn > 1e-12 * (turn @ turn):
            pairs.append((step, turn))
        z, value, slope = z + step, lower, steeper
        if gain <= SMALL * max(abs(value), 1.0):
            break
    return z, value


def _straightened(slope: Array, pairs: Iterable[Pair]) -> Array:
    """The slope (N,) times the inverse of the curvature that steps and changes of slope tell of."""
    way, shares = slope.copy(), []
    for step, turn in reversed(newest := list(pairs)):
        share = (step @ way) / (step @ turn)
        shares.append(share)
        way -= share * turn
    if newest:
        step, turn = newest[-1]
        way *= (step @ turn) / (turn @ turn)
    for (step, turn), share in zip(newest, reversed(shares), strict=True):
        way += (share - (turn @ way) / (step @ turn)) * step
    return way
