"""Priors taken from the data, in any units."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.layout import Layout
from dynamics.learning.options import Options
from dynamics.learning.prior import data_prior
from tests.dynamics.learning.systems import drawn
from tests.oracles import random_slds


@pytest.mark.parametrize("order", [1, 2])
def test_the_prior_of_noise_is_a_tenth_of_the_change_that_the_dynamics_explain(order, rng):
    ys = drawn(random_slds(1, d=3, order=order, rng=rng), (30, 40), rng)
    got = data_prior(ys, Layout(("a", "b", "c"), ("a",), order), Options(order=order))
    differences = np.concatenate([np.diff(y, n=order, axis=0) for y in ys])
    assert_allclose(got.ridge.noise, 0.1 * differences.var(axis=0), rtol=1e-6)


def test_priors_scale_with_the_units(rng):
    y = rng.normal(size=(12, 2)).cumsum(axis=0)
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
