import numpy as np
import pytest
from scipy.optimize import fmin_l_bfgs_b

from tracker.outline.lbfgs import REMEMBERED, lowest

N = 30
SMALL = 2e-9  # gain with which a search ends


def valley(x):
    """Rosenbrock's function in pairs, whose minimum is where all are 1."""
    a, b = x[::2], x[1::2]
    slope = np.empty_like(x)
    slope[::2], slope[1::2] = -400.0 * a * (b - a**2) - 2.0 * (1.0 - a), 200.0 * (b - a**2)
    return float((100.0 * (b - a**2) ** 2 + (1.0 - a) ** 2).sum()), slope


def test_it_goes_the_way_of_scipys(rng):
    # Both take every step whole where the first, of length 1, ends neither too soon nor too far.
    root, side = rng.normal(size=(N, N)), rng.normal(size=N)
    bent = (root @ root.T / N + np.eye(N)) / 5.0
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


def test_a_search_ends_with_a_round_that_gains_little(rng):
    start = rng.normal(size=N)
    early, whole = (lowest(valley, start, 500, small)[1] for small in (1e-2, SMALL))
    assert whole < early < valley(start)[0]


def test_a_search_that_begins_at_the_minimum_stays_there():
    found, value = lowest(lambda x: (float(x @ x), 2.0 * x), np.zeros(N), 5, SMALL)
    assert not found.any()
    assert value == 0.0
