"""How far the joints of an outline are off, told by how it explains the picture.

Of what stands out around the figure an outline covers a share, and of what it covers some does not stand out.
The spread is log-linear in both, as is likeliest beside the true joints of rendered films, taken as the scale
of a Student t with four degrees of freedom: 0.02 leg lengths where all is explained, 0.09 and more in a
twentieth of the frames.
"""

import numpy as np

from kinematics.figure import Array
from tracker.outline.shape import Grid, Shape
from tracker.picture.pyramid import Planes

ALL, COVERED, AGAINST = 0.16, -5.14, 3.25  # log leg lengths: of no share, of a whole one, of a nat against it
LITTLE = 0.01, 0.1  # nats times square leg lengths, square leg lengths, which hold off division by nothing


def spread(shape: Shape, q: Array, odds: Planes, grid: Grid) -> Array:
    """(T,) leg lengths by which the joints of an outline may be off.

    Args:
        q: (T, D) poses on their outlines.
        odds: (T, *grid.shape) log odds around them.
    """
    place, found = grid.density**-2, np.empty(len(q))
    # Frame by frame, as silhouettes of a whole film would take hundreds of megabytes.
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
