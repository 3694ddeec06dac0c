"""The outline of a figure: each link a tapered, rounded bar, the arms a zone round the trunk.

A point u along a link and v across it lies inside by

    s = h(w) - |(u, v) - (w, 0)|,   w = u clipped to the bar,   h from `start` to `tip` half widths,

and belongs to the link by m = SURE times a smooth step of s / SOFT (`tracker.outline.kernel`). Of all bars together S = 1 - prod (1 - m).
Lengths scale with the figure's common scale, those along the link with the link's own length.
"""

from dataclasses import dataclass

import numpy as np

from kinematics.figure import Array, Figure
from tracker.picture.pyramid import Planes


@dataclass(frozen=True)
class Bar:
    """The outline of one link.

    first, last : where its axis begins and ends, shares of the link's length
    start, tip  : its half widths there, leg lengths
    """

    first: float
    last: float
    start: float
    tip: float


BARS = {
    "torso": Bar(0.0, 0.88, 0.14, 0.14),
    "head": Bar(0.0, 0.66, 0.075, 0.125),
    "thigh": Bar(0.0, 1.0, 0.125, 0.085),
    "shank": Bar(0.0, 1.0, 0.08, 0.05),
    "foot": Bar(-0.2, 0.86, 0.05, 0.04),
}
ARMS = Bar(-0.35, 0.85, 0.42, 0.25)  # where a trunk's arms may be
ARM_SHARE = 0.35  # of that zone, arms cover about so much


def bars(figure: Figure) -> Array:
    """(L, 4) of each link: first, last, start, tip; a link of no known kind is as wide as the figure says."""
    found = []
    for link in figure.links:
        half = 0.5 * link.width
        bar = BARS.get(link.kind, Bar(0.0, 1.0, half, half * link.taper))
        found.append([bar.first, bar.last, bar.start, bar.tip])
    return np.array(found)


def arms_worth(odds: Planes) -> Planes:
    """What log odds R are worth where arms may be and cover ARM_SHARE: log (1 - share + share e^R)."""
    return np.log1p(np.float32(ARM_SHARE) * np.expm1(odds))
