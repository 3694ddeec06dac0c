"""Parts of poses that no motion model includes: the figure's place, and constants such as the neck's angle.

They are subtracted before a model gets the poses, and added to its results.
"""

import numpy as np

from dynamics.gaussian import Array, measured_first, measured_mean
from dynamics.layout import among
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
    constant = among(figure.learned_freedoms, figure.marked_offsets)
    return np.where(constant, measured_mean(y), first_place(y))


def first_place(y: Array) -> Array:
    """(M,) first measured place of the root of poses (T, M), 0 if there is none; 0 for the angles."""
    return np.where(np.arange(y.shape[1]) < len(ROOT), measured_first(y), 0.0)
