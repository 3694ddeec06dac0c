"""L-BFGS against scipy's."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import fmin_l_bfgs_b, rosen, rosen_der

from tests.oracles import random_covariance
from tracker.outline.descent import lowest


def valley(z):
    return float(rosen(z)), rosen_der(z)


def test_the_bottom_of_a_bent_valley_is_found_in_about_as_many_steps_as_scipy_takes():
    asked = []
    start = np.array([1.3, 0.7, 0.8, 1.9])
    z, value = lowest(lambda z: asked.append(z) or valley(z), start, 6, 200)
    theirs = fmin_l_bfgs_b(valley, start, m=6)[2]["funcalls"]
    # The slope is that of a function of about 1e-9 along the valley's floor.
    assert_allclose(z, 1.0, atol=1e-3)
    assert value < 1e-7
    assert len(asked) < 1.5 * theirs


def test_a_bowl_is_left_as_deep_after_so_many_rounds_as_scipy_leaves_it(rng):
    H, slope = random_covariance(30, rng), rng.normal(size=30)

    def bowl(z):
        return float(0.5 * z @ H @ z + slope @ z), H @ z + slope

    _, value = lowest(bowl, np.zeros(30), 6, 15)
    _, theirs, _ = fmin_l_bfgs_b(bowl, np.zeros(30), m=6, maxiter=15)
    assert value < 0.95 * theirs
    _, value = lowest(bowl, np.zeros(30), 6, 1000)
    assert value == pytest.approx(-0.5 * slope @ np.linalg.solve(H, slope), rel=1e-6)


def test_where_a_function_is_lowest_already_no_step_is_taken():
    z, value = lowest(valley, np.ones(3), 6, 10)
    assert_allclose(z, 1.0)
    assert value == 0.0
