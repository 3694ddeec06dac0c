"""Sequences that a system draws, and whether two systems are the same."""

import numpy as np
from numpy.testing import assert_allclose

from tests.oracles import sample

FIELDS = ("pi0", "Pi", "A", "b", "Q", "R", "mean0", "cov0")


def drawn(slds, lengths, rng, *, gaps=False):
    """Sequences; with gaps a few entries are missing of each, and a whole row.

    That row is the first, of every other sequence the last but one. All of the last row is measured.
    """
    ys = [sample(slds, T, rng)[2] for T in lengths]
    for n, y in enumerate(ys if gaps else []):
        y[rng.random(y.shape) < 0.2] = np.nan
        y[-2 if n % 2 else 0] = np.nan
        y[-1] = np.where(np.isnan(y[-1]), 0.1 * n, y[-1])
    return ys


def assert_same_system(one, other, *, rtol, atol=1e-12):
    for name in (*FIELDS, "C"):
        assert_allclose(getattr(one, name), getattr(other, name), rtol=rtol, atol=atol, err_msg=name)
