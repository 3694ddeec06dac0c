"""Sequences that a system draws, and whether two systems are the same."""

from numpy.testing import assert_allclose

from tests.oracles import sample

FIELDS = ("pi0", "Pi", "A", "b", "Q", "R", "mean0", "cov0")


def drawn(slds, lengths, rng):
    """Sequences of these lengths."""
    return [sample(slds, T, rng)[2] for T in lengths]


def assert_same_system(one, other, *, rtol, atol=1e-12):
    for name in (*FIELDS, "C"):
        assert_allclose(getattr(one, name), getattr(other, name), rtol=rtol, atol=atol, err_msg=name)
