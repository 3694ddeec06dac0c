"""Parts of poses that no motion model includes: the figure's place, and constants such as the neck's angle.

They are subtracted before a model gets the poses, and added to its results.
"""

import numpy as np

from dynamics.gaussian import Array
from kinematics.figure import ROOT, Figure
from kinematics.figure_file import WALKER

ANGLES = slice(len(ROOT), None)  # of learned freedoms


def centred(y: Array, figure: Figure = WALKER) -> Array:
    """Poses (T, M) of a figure's learned freedoms minus their `own_offset`; NaN entries were not measured."""
    return y - own_offset(y, figure)


def rootless(y: Array) -> Array:
    """Poses (T, M) with the root set to not measured, so that only the angles count."""
    blank = y.copy()
    blank[:, : len(ROOT)] = np.nan
    return blank


def own_offset(y: Array, figure: Figure = WALKER) -> Array:
    """(M,) `first_place`, and the measured means of freedoms with a constant, such as the neck."""
    offset, names = first_place(y), figure.learned_freedoms
    for column in [names.index(name) for name in figure.offsets("marked") if name in names]:
        measured = y[np.isfinite(y[:, column]), column]
        offset[column] = measured.mean() if len(measured) else 0.0
    return offset


def first_place(y: Array) -> Array:
    """(M,) first measured place of the root of poses (T, M), 0 if there is none; 0 for the angles."""
    seen = np.isfinite(y)
    first = y[seen.argmax(axis=0), np.arange(y.shape[1])]
    return np.where(seen.any(axis=0) & (np.arange(y.shape[1]) < len(ROOT)), first, 0.0)
