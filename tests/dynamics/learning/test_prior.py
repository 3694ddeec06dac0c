"""Priors taken from the data: differences of what was measured, in any units."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.layout import Layout
from dynamics.learning.options import Options
from dynamics.learning.prior import changes, data_prior
from tests.dynamics.learning.systems import drawn
from tests.oracles import random_slds


@pytest.mark.parametrize("order", [1, 2])
def test_priors_are_those_of_what_was_measured(order, rng):
    ys = drawn(random_slds(1, d=3, order=order, rng=rng), (30, 40), rng)
    layout, options = Layout(("a", "b", "c"), ("a",), order), Options(order=order)
    cut = [ys[0][:20], ys[1][5:]]
    holes = [y.copy() for y in ys]
    holes[0][20:], holes[1][:5] = np.nan, np.nan
    want, got = data_prior(cut, layout, options), data_prior(holes, layout, options)
    for name in ("R", "start"):
        assert_allclose(getattr(got, name), getattr(want, name), rtol=1e-12)  # the same sums
    assert_allclose(got.ridge.noise, want.ridge.noise, rtol=1e-12)
    # A state's regressors are counted in all frames; at second order one more is seen at each edge.
    assert_allclose(got.ridge.strength / 70, want.ridge.strength / 55, rtol=1e-12 if order == 1 else 0.1)
    # Single entries: the freedom's own differences, and no other freedom's.
    holes = [y.copy() for y in ys]
    holes[0][10, 1] = np.nan
    got, plain = data_prior(holes, layout, options), data_prior(ys, layout, options)
    differences = np.concatenate([np.diff(y[:, 1], n=order) for y in holes])
    assert np.isnan(differences).sum() == order + 1
    assert got.ridge.noise[1] == pytest.approx(0.1 * np.nanvar(differences), rel=1e-6)
    assert_array_equal(got.ridge.noise[[0, 2]], plain.ridge.noise[[0, 2]])


def test_changes_never_measured_in_a_row_are_taken_from_a_lower_difference():
    y = np.array([[0.0, 1.0], [1.0, np.nan], [3.0, 4.0], [5.0, np.nan], [8.0, 2.0]])
    got = changes([y], 2)
    assert got[0] == pytest.approx(np.var([1.0, 0.0, 1.0]), rel=1e-8)
    assert got[1] == pytest.approx(np.var([1.0, 4.0, 2.0]), rel=1e-8)
    assert changes([y[:2]], 2) == pytest.approx([np.var([0.0, 1.0]), 0.0], abs=1e-9)
    for order in (1, 2):
        prior = data_prior([y], Layout(("a", "b"), ("b",), order), Options(order=order))
        assert prior.ridge.strength.min() > 0.0


def test_priors_scale_with_the_units_even_of_what_was_never_measured_in_a_row(rng):
    y = rng.normal(size=(12, 2)).cumsum(axis=0)
    y[1::2, 1] = np.nan
    layout = Layout(("a", "b"), ("b",), 2)
    one, ten = (data_prior([y * [1.0, size]], layout, Options()) for size in (1.0, 10.0))
    scale = np.array([1.0, 1.0, 100.0, 1.0])  # a, a before, the change of b, the offset
    # Freedoms that never move spread by an absolute 1e-5.
    assert_allclose(ten.ridge.strength, scale * one.ridge.strength, rtol=1e-8)
    assert_allclose(ten.R, np.array([1.0, 100.0]) * one.R, rtol=1e-8)


def test_a_travelling_freedom_starts_near_its_first_place(rng):
    y = np.column_stack([np.arange(50.0), rng.normal(size=50)])
    start = data_prior([y], Layout(("a", "b"), ("a",), 2), Options(order=2)).start
    assert_allclose(start[::2], 0.1, rtol=1e-8)  # a tenth of its squared speed, though it goes far
    assert_allclose(start[1::2], 0.1 * y[:, 1].var(), rtol=1e-8)
    assert_allclose(data_prior([y], Layout(("a", "b"), (), 2), Options()).start[::2], 0.1 * y[:, 0].var())
