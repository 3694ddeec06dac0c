"""A smooth function's minimum by L-BFGS (Liu and Nocedal 1989), without bounds.

The direction is algorithm 7.4 of Nocedal and Wright (2006). SciPy has the method too, but importing it takes
an eighth of a second and 20 MB.
"""

from collections import deque
from collections.abc import Callable

import numpy as np

from kinematics.figure import Array

REMEMBERED = 6  # latest steps from which the curvature is estimated
ENOUGH = 1e-3  # least decrease of the cost as a share of the decrease that the slope predicts
HALVINGS = 20  # largest number of halvings of a step

Cost = Callable[[Array], tuple[float, Array]]
Step = tuple[Array, Array, float]  # a step (N,), the change (N,) of the slope over it, and their product


def lowest(cost: Cost, x: Array, rounds: int, small: float) -> tuple[Array, float]:
    """A local minimum (N,), and its cost.

    Args:
        cost: gives the cost at a point (N,) and its slope (N,).
        x: (N,) start of the search.
        rounds: largest number of steps.
        small: gain of a round, as a share of the cost, that ends the search.
    """
    steps: deque[Step] = deque(maxlen=REMEMBERED)
    value, slope = cost(x)
    for _ in range(rounds):
        way = direction(slope, steps)
        promise = float(slope @ way)
        # The first step has length 1, since the curvature is not known.
        share = 1.0 if steps else 1.0 / max(float(np.sqrt(-promise)), 1e-9)
        for _ in range(HALVINGS):
            with np.errstate(over="ignore", invalid="ignore"):  # much too far the cost may be no number
                lower, there = cost(x + share * way)
            if lower <= value + ENOUGH * share * promise:
                break
            share *= 0.5
        else:
            break
        step, change = share * way, there - slope
        if (curvature := float(step @ change)) > 0.0:  # else the Hessian would be indefinite
            steps.append((step, change, curvature))
        gain, x, value, slope = value - lower, x + step, lower, there
        if gain <= small * max(abs(value), 1.0):
            break
    return x, value


def direction(slope: Array, steps: deque[Step]) -> Array:
    """Minus the slope (N,) times the inverse Hessian estimated from the last steps."""
    way, shares = -slope, []
    for step, change, curvature in reversed(steps):
        shares.append(float(step @ way) / curvature)
        way = way - shares[-1] * change
    if steps:
        _, change, curvature = steps[-1]
        way = way * (curvature / float(change @ change))
    for step, change, curvature in steps:
        way = way + (shares.pop() - float(change @ way) / curvature) * step
    return way
