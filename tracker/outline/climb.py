"""Every frame's pose fitted to its outline: one optimisation over a whole film.

With s_t(q_t) the sum of R under the outline of pose q_t, and d_t = q_t less the pose of the path and b BENT,

    WEIGHT sum_t s_t(q_t) - 1/2 sum_t |d_t / spread|^2 - 1/2 sum_t |(d_t - d_{t-1}) / change|^2,

less the costs of marks and limits and (b / BEND)^2 / 2, is maximised by L-BFGS. The bend b >= 0 is by how
much the person bends the knees more than usual, in all frames; less hardly anybody can. With U the upper
Cholesky factor of the prior's precision, which has a diagonal and one off-diagonal, U d = z makes the prior
the unit Gaussian of z. The search is over z and sqrt(T) b / BEND, which have about the same curvature.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dtbsv

from kinematics.figure import SCALE, STRETCH, Array, Figure, Flags
from tracker.outline.lbfgs import lowest
from tracker.outline.shape import Grid, Shape, arms_worth
from tracker.picture.pyramid import Planes

GRID = Grid((-1.3, 1.2), 32.0, (76, 84))
WEIGHT = 80.0  # nats for a square leg length of log odds
ROUNDS = 40
SMALL_GAIN = 2e-4  # gain of a round, as a share of the cost, that ends the climb
ANGLE, ANKLE = float(np.radians(12.0)), float(np.radians(20.0))  # spread of angles about the path's
PLACE = 0.1  # spread of the hip, leg lengths
SIZE, SIZE_FOUND = 0.035, 0.05  # spread of the log size with a marked frame, without marks
LENGTH = 0.04  # spread of log lengths
CHANGE = 1.0 / 3.0  # change from frame to frame as a share of a spread, at 30 a second
LASTS = 0.1  # the same for lengths
MARKED_ANGLE, MARKED_PLACE, MARKED_LENGTH = float(np.radians(9.0)), 0.06, 0.06  # marks against outlines
GIVE = 0.05  # spread by which a joint passes its limit, or a bend falls below 0, radians
BEND = float(np.radians(15.0))  # spread of the bend
BENT = {"hip": 0.6, "knee": 1.0}  # angles of a leg with a bend of 1


@dataclass(frozen=True)
class Marked:
    """The marked pose (D,) of a frame, and which of its freedoms are `known` (D,)."""

    frame: int
    q: Array
    known: Flags


def climb(
    odds: Planes, shape: Shape, q: Array, marked: Marked, rounds: int = ROUNDS, often: float = 1.0
) -> tuple[Array, Array, float]:
    """Fit poses to their outlines.

    Args:
        odds: (T, *GRID.shape) log odds around the poses' origin.
        q: (T, D) poses of the path.
        marked: the marked pose.
        rounds: largest number of L-BFGS steps.
        often: frames for each at 30 a second; poses then change less from frame to frame, and the marked
            frame counts for as many.

    Returns:
        (T, D) poses; (T,) log odds under their outlines, nats times leg lengths squared; minus the objective,
        nats.
    """
    T, D = q.shape
    figure = shape.figure
    size = SIZE if marked.known.any() else SIZE_FOUND
    spreads = _by_kind(figure, ANGLE, ANKLE, PLACE, size, LENGTH)
    U = factor(T, spreads, spreads * _by_kind(figure, CHANGE, CHANGE, CHANGE, LASTS, LASTS) / often)
    error = _by_kind(figure, MARKED_ANGLE, MARKED_ANGLE, MARKED_PLACE, MARKED_LENGTH, MARKED_LENGTH)
    low, high = figure.limits
    arms = arms_worth(odds)
    bent = np.array([BENT.get(name.partition("_")[0], 0.0) for name in figure.freedoms])
    bent *= BEND / np.sqrt(T)

    def laid(z: Array) -> Array:
        return np.asarray(q + dtbsv(D, U, z[:-1]).reshape(T, D) + z[-1] * bent)

    def cost(z: Array) -> tuple[float, Array]:
        now = laid(z)
        score, slope = shape.under(now, odds, arms, GRID)
        off = np.where(marked.known, (now[marked.frame] - marked.q) / error, 0.0)
        over = np.maximum(now - high, 0.0) - np.maximum(low - now, 0.0)
        slope = over / GIVE**2 - WEIGHT * slope
        slope[marked.frame] += often * off / error
        lean = np.append(z[:-1], z[-1] / T + min(z[-1], 0.0) * (BEND / GIVE) ** 2)
        value = -WEIGHT * score.sum() + 0.5 * (often * off @ off + (over**2).sum() / GIVE**2 + lean @ z)
        return float(value), np.append(dtbsv(D, U, slope.ravel(), trans=1), slope.sum(0) @ bent) + lean

    z, least = lowest(cost, np.zeros(T * D + 1), rounds, SMALL_GAIN)
    best = laid(z)
    return best, shape.under(best, odds, arms, GRID)[0], least


def factor(T: int, spread: Array, change: Array) -> Array:
    """(D + 1, T D) the factor U for paths of T frames, as LAPACK stores an upper band of a path's row by row.

    Args:
        spread, change: (D,) standard deviations of values about 0 and of their change a frame.
    """
    sides = np.full((T, 1), 2.0)
    sides[[0, -1]] -= 1.0
    diagonal = 1.0 / spread**2 + sides * (T > 1) / change**2
    above = np.zeros_like(diagonal)
    diagonal[0] = np.sqrt(diagonal[0])
    for t in range(1, T):
        above[t] = -1.0 / change**2 / diagonal[t - 1]
        diagonal[t] = np.sqrt(diagonal[t] - above[t] ** 2)
    bands = np.zeros((1 + len(spread), diagonal.size), order="F")
    bands[0], bands[-1] = above.ravel(), diagonal.ravel()
    return bands


def _by_kind(figure: Figure, angle: float, ankle: float, place: float, size: float, length: float) -> Array:
    """(D,) the number for each freedom's kind."""
    kinds = {"ankle": ankle, "root": place, SCALE: size, STRETCH: length, "": angle}
    own = [next(kind for kind in kinds if name.startswith(kind)) for name in figure.freedoms]
    return np.array([kinds[kind] for kind in own])
