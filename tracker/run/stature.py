"""The height of a tracked figure, from its links.

The links reach from the head's top to the ankles, and ankles are 0.039 H above the floor (Winter 2009, figure
4.1), so for a person of height H

    0.961 H = head top to neck + neck to hip + hip to knee + knee to ankle,

with the median over the frames; there is one height for the whole clip.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array
from kinematics.sides import SIDES

ANKLE_HEIGHT = 0.039  # share of the person's height
TRUNK = ("head_top", "neck", "hip")
LEGS = tuple(("hip", f"{side}_knee", f"{side}_ankle") for side in SIDES)


def stature(places: Array, names: Sequence[str], seen: NDArray[np.bool_]) -> float:
    """Height from the floor to the head's top, in the unit of the places; NaN if a link was never measured.

    Places are (T, J, 2) of the joints of these names; `seen` (T,) says which frames count.
    """
    trunk, legs = (_median(places[seen], names, chains) for chains in ([TRUNK], LEGS))
    return (trunk + legs) / (1.0 - ANKLE_HEIGHT)


def along(places: Array, names: Sequence[str], chain: Sequence[str]) -> Array:
    """(T,) length of a chain of joints, in the unit of the places (T, J, 2) of the joints of these names."""
    joints = places[:, [names.index(name) for name in chain]]
    return np.asarray(np.linalg.norm(np.diff(joints, axis=1), axis=-1).sum(axis=-1))


def _median(places: Array, names: Sequence[str], chains: Sequence[Sequence[str]]) -> float:
    """The median length of the figure's chains; NaN if none was measured."""
    lengths = np.array([along(places, names, chain) for chain in chains if set(chain) <= set(names)])
    known = lengths[np.isfinite(lengths)]
    return float(np.median(known)) if known.size else float("nan")
