"""The uncertainty of an outline's joints, from how well it explains the picture.

Two measures are used: the share of the foreground around the figure that the outline covers, and the part of
the outline that covers background. The spread is log-linear in both, fitted to the true joints of rendered
films as the scale of a Student t with four degrees of freedom: 0.02 leg lengths where all is explained, 0.09
and more in a twentieth of the frames.
"""

import numpy as np

from kinematics.figure import Array
from tracker.outline.shape import Grid, Shape
from tracker.picture.pyramid import Planes

ALL, COVERED, AGAINST = 0.16, -5.14, 3.25  # log leg lengths: constant, for the share, for a nat against
LITTLE = 0.01, 0.1  # nats times square leg lengths, and square leg lengths, that prevent division by 0


def spread(shape: Shape, q: Array, odds: Planes, grid: Grid) -> Array:
    """(T,) spread of the joints of poses (T, D), leg lengths, by the log odds (T, *grid.shape) there."""
    place, found = grid.density**-2, np.empty(len(q))
    # Frame by frame, since silhouettes of a whole film would take hundreds of megabytes.
    for t, seen in enumerate(odds):
        (body,), (arms,) = shape.painted(q[t : t + 1], grid)
        out = np.maximum(seen, 0.0)
        within = place * (out * body).sum()
        beside = place * (out * (1.0 - np.maximum(body, arms))).sum()
        not_out = place * (np.maximum(-seen, 0.0) * body).sum()
        share = within / (within + beside + LITTLE[0])
        against = not_out / max(place * body.sum(), LITTLE[1])
        found[t] = np.exp(ALL + COVERED * share + AGAINST * against)
    return found


def in_standard_errors(evidence: Array, together: float) -> float:
    """The mean of frames' evidence (n,) in the standard errors that it has if its true mean is zero.

    So measured, a difference that lasts counts no more than chance could make it last: at most
    sqrt(n / together), for so many neighbouring frames with correlated errors; 0 for fewer frames.
    """
    if len(evidence) < together:
        return 0.0
    square = float(np.square(evidence).mean())
    return float(evidence.mean() / (np.sqrt(square * together / len(evidence)) + 1e-9))
