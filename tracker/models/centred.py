"""What no motion model knows of poses: where the figure stands, and how it carries its head.

It is taken off before a model is shown the poses, and put back afterwards.
"""

import numpy as np

from dynamics.gaussian import Array
from kinematics.figure import ROOT, Figure
from kinematics.figure_file import WALKER

ANGLES = slice(len(ROOT), None)  # of learned freedoms


def centred(y: Array, figure: Figure = WALKER) -> Array:
    """Poses (T, M) of a figure's learned freedoms less their `own_offset`; NaN entries were not measured."""
    return y - own_offset(y, figure)


def rootless(y: Array) -> Array:
    """The angles alone: poses (T, M) of which the root was not measured."""
    blank = y.copy()
    blank[:, : len(ROOT)] = np.nan
    return blank


def own_offset(y: Array, figure: Figure = WALKER) -> Array:
    """(M,) `first_place`, and the means of what was measured of a figure's own freedoms, such as the neck."""
    offset, names = first_place(y), figure.learned_freedoms
    for column in [names.index(name) for name in figure.offsets("marked") if name in names]:
        measured = y[np.isfinite(y[:, column]), column]
        offset[column] = measured.mean() if len(measured) else 0.0
    return offset


def first_place(y: Array) -> Array:
    """(M,) where the root of poses (T, M) is first measured, 0 where it never is; 0 for the angles."""
    seen = np.isfinite(y)
    first = y[seen.argmax(axis=0), np.arange(y.shape[1])]
    return np.where(seen.any(axis=0) & (np.arange(y.shape[1]) < len(ROOT)), first, 0.0)
