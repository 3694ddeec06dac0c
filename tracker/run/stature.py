"""How tall a tracked figure is, from its links.

They reach from the head's top to the ankles, and ankles are 0.039 H above the floor (Winter 2009, figure
4.1), so of a person of height H

    0.961 H = head top to neck + neck to hip + hip to knee + knee to ankle,

at the median over the frames; it is one number for the whole clip.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array

ANKLE_HEIGHT = 0.039  # of the person's height
TRUNK = (("head_top", "neck"), ("neck", "hip"))
LEGS = tuple((("hip", f"{side}_knee"), (f"{side}_knee", f"{side}_ankle")) for side in ("near", "far"))


def stature(places: Array, names: Sequence[str], seen: NDArray[np.bool_]) -> float:
    """From the floor to the head's top, in the unit of the places; NaN where nothing was seen of a link.

    Places are (T, J, 2) of the joints of these names; `seen` (T,) says which frames count.
    """

    def long(chain: Sequence[tuple[str, str]]) -> Array:
        if not {name for link in chain for name in link} <= set(names):
            return np.zeros(0)
        pairs = [(names.index(one), names.index(other)) for one, other in chain]
        apart = [np.linalg.norm(places[seen, i] - places[seen, j], axis=-1) for i, j in pairs]
        lengths = np.sum(apart, axis=0)
        return np.asarray(lengths[np.isfinite(lengths)])

    trunk, legs = long(TRUNK), np.concatenate([long(leg) for leg in LEGS])
    if not (trunk.size and legs.size):
        return float("nan")
    return float(np.median(trunk) + np.median(legs)) / (1.0 - ANKLE_HEIGHT)
