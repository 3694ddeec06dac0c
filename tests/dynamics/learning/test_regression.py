"""The regression against least squares on data that are known exactly, and what its form allows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.layout import Layout
from dynamics.learning.regression import Ridge, companion, maximum_likelihood, solve

NAMES = ("x", "y", "hip", "knee")
TRAVELLING = ("x", "y")


def moments(v):
    return (v.T @ v)[None], np.array([float(len(v))])


def exact_steps(order, rng, T=60):
    """Rows [pose_t; x_{t-1}; 1] of a random series."""
    q = rng.normal(size=(T, 4)).cumsum(axis=0)
    x = q if order == 1 else np.hstack([q[1:], q[:-1]])
    target = q[1:] if order == 1 else q[2:]
    return np.hstack([target, x[:-1], np.ones((len(target), 1))])


@pytest.mark.parametrize("order", [1, 2])
def test_without_travelling_freedoms_it_is_least_squares(order, rng):
    v = exact_steps(order, rng)
    layout = Layout(NAMES, (), order)
    A, b, Q = solve(*moments(v), layout, maximum_likelihood(layout))
    B = np.linalg.lstsq(v[:, 4:], v[:, :4], rcond=None)[0].T
    residual = v[:, :4] - v[:, 4:] @ B.T
    # Normal equations with a condition number near 1e4.
    assert_allclose(np.hstack([A[0, :4], b[0, :4, None]]), B, atol=1e-9)
    assert_allclose(Q[0, :4, :4], residual.T @ residual / len(v), atol=1e-9)


@pytest.mark.parametrize("order", [1, 2])
def test_the_next_pose_shifts_with_the_place_of_the_figure(order, rng):
    layout = Layout(NAMES, TRAVELLING, order)
    A, _, _ = solve(*moments(exact_steps(order, rng)), layout, maximum_likelihood(layout))
    shift = np.tile([3.0, -2.0, 0.0, 0.0], order)
    assert_allclose(A[0] @ shift, shift, atol=1e-12)  # sums of a few coefficients near 1


def test_at_first_order_a_travelling_freedoms_offset_is_its_mean_speed(rng):
    v = exact_steps(1, rng)
    layout = Layout(NAMES, NAMES, 1)
    _, b, Q = solve(*moments(v), layout, maximum_likelihood(layout))
    change = v[:, :4] - v[:, 4:8]
    # Sums of 60 numbers near 100.
    assert_allclose(b[0], change.mean(0), atol=1e-11)
    assert_allclose(Q[0], np.cov(change.T, bias=True), atol=1e-10)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("travelling", [(), TRAVELLING])
def test_steady_coefficients_are_constant_velocity_in_companion_form(order, travelling):
    layout = Layout(NAMES, travelling, order)
    A, b, Q = companion(layout, np.stack([layout.steady] * 2), np.stack([np.diag([1.0, 2.0, 3.0, 4.0])] * 2))
    eye = np.eye(4)
    want = eye if order == 1 else np.block([[2.0 * eye, -eye], [eye, 0.0 * eye]])
    assert_array_equal(A, [want, want])
    assert_array_equal(b, 0.0)
    assert_array_equal(Q[1, :4, :4], np.diag([1.0, 2.0, 3.0, 4.0]))
    assert_array_equal(Q.sum((1, 2)), 10.0)


@pytest.mark.parametrize("order", [1, 2])
def test_a_state_without_steps_takes_the_prior(order, rng):
    layout = Layout(NAMES, TRAVELLING, order)
    V, _ = moments(exact_steps(order, rng))
    scales = rng.uniform(0.1, 1.0, layout.steady.shape[1])
    ridge = Ridge(scales, rng.uniform(0.1, 1.0, 4), 3.0)
    A, b, Q = solve(0.0 * V, np.zeros(1), layout, ridge)
    want = companion(layout, layout.steady[None], np.diag(ridge.noise / (3.0 + len(scales)))[None])
    for got, prior in zip((A, b, Q), want, strict=True):
        assert_allclose(got, prior, atol=1e-14)  # a diagonal solve
