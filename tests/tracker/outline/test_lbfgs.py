from collections import deque

import numpy as np
import pytest
from scipy.optimize import fmin_l_bfgs_b

from tracker.outline.lbfgs import REMEMBERED, direction, lowest

N = 30
SMALL = 2e-9  # gain with which a search ends


@pytest.fixture
def hessian(rng):
    root = rng.normal(size=(N, N))
    return root @ root.T / N + np.eye(N)


def valley(x):
    """Rosenbrock's function in pairs, whose minimum is where all are 1."""
    a, b = x[::2], x[1::2]
    slope = np.empty_like(x)
    slope[::2], slope[1::2] = -400.0 * a * (b - a**2) - 2.0 * (1.0 - a), 200.0 * (b - a**2)
    return float((100.0 * (b - a**2) ** 2 + (1.0 - a) ** 2).sum()), slope


def test_the_minimum_of_a_quadratic_function_is_where_its_slope_is_zero(rng, hessian):
    side = rng.normal(size=N)
    want = np.linalg.solve(hessian, side)
    found, value = lowest(
        lambda x: (0.5 * x @ hessian @ x - side @ x, hessian @ x - side), np.zeros(N), 200, SMALL
    )
    np.testing.assert_allclose(found, want, atol=1e-3)
    assert value == pytest.approx(-0.5 * side @ want, rel=1e-7)


def test_it_goes_the_way_of_scipys(rng, hessian):
    # Both take every step whole where the first, of length 1, ends neither too soon nor too far.
    bent, side = hessian / 5.0, rng.normal(size=N)
    side /= np.linalg.norm(side)

    def cost(x):
        return 0.5 * x @ bent @ x - side @ x, bent @ x - side

    for rounds in (2, 5, 9):
        want, least, _ = fmin_l_bfgs_b(cost, np.zeros(N), m=REMEMBERED, maxiter=rounds)
        found, value = lowest(cost, np.zeros(N), rounds, SMALL)
        np.testing.assert_allclose(found, want, atol=1e-9)
        assert value == pytest.approx(least, rel=1e-12)


@pytest.mark.filterwarnings("error")
def test_a_step_so_far_that_the_cost_is_no_number_is_halved():
    def cost(x):
        wall = np.exp(1000.0 * x)
        return float((wall - 1e4 * x).sum()), 1000.0 * wall - 1e4

    found, _ = lowest(cost, np.zeros(1), 100, SMALL)
    np.testing.assert_allclose(found, np.log(10.0) / 1000.0, rtol=1e-3)


def test_a_bent_valley_is_followed_to_its_end(rng):
    start = rng.normal(size=N)
    found, value = lowest(valley, start, 500, SMALL)
    np.testing.assert_allclose(found, 1.0, atol=1e-2)
    costs = [lowest(valley, start, rounds, SMALL)[1] for rounds in (0, 1, 5, 25)]
    assert costs[0] == valley(start)[0]
    assert np.all(np.diff([*costs, value]) < 0.0)


def test_the_direction_is_that_of_the_inverse_that_bfgs_updates(rng, hessian):
    moved = [rng.normal(size=N) for _ in range(4)]
    steps = deque((s, hessian @ s, float(s @ hessian @ s)) for s in moved)
    _, y, sy = steps[-1]
    inverse = np.eye(N) * sy / (y @ y)
    for s, y, sy in steps:  # Nocedal and Wright (2006), equation 6.17
        less = np.eye(N) - np.outer(s, y) / sy
        inverse = less @ inverse @ less.T + np.outer(s, s) / sy
    slope = rng.normal(size=N)
    np.testing.assert_allclose(direction(slope, steps), -inverse @ slope, rtol=1e-9, atol=1e-9)


def test_a_search_ends_with_a_round_that_gains_little(rng):
    start = rng.normal(size=N)
    early, whole = (lowest(valley, start, 500, small)[1] for small in (1e-2, SMALL))
    assert whole < early < valley(start)[0]


def test_a_search_that_begins_at_the_minimum_stays_there():
    found, value = lowest(lambda x: (float(x @ x), 2.0 * x), np.zeros(N), 5, SMALL)
    assert not found.any()
    assert value == 0.0
