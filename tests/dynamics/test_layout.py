"""The layout of a state, against what its entries mean one by one."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from dynamics.layout import Layout, among

NAMES, TRAVELLING = ("x", "hip", "y"), ("x", "y")


@pytest.fixture(params=[(1, ()), (1, ("scale",)), (2, ()), (2, ("scale", "light"))], ids=str)
def layout(request):
    order, drifts = request.param
    return Layout(NAMES, TRAVELLING, order, drifts)


def state(layout, now, before, drifts):
    return np.concatenate([now, *([before] if layout.order == 2 else []), drifts])


@pytest.fixture
def parts(layout, rng):
    """Two poses, the later first, and the drifts."""
    return rng.normal(size=3), rng.normal(size=3), rng.normal(size=len(layout.drifts))


def test_among_marks_the_chosen_names_in_their_place():
    assert_array_equal(among(NAMES, ("y", "z")), [False, False, True])


def test_a_state_has_a_pose_a_pose_before_and_drifts(layout, parts):
    now, before, drifts = parts
    x = state(layout, now, before, drifts)
    assert len(x) == layout.N
    assert_array_equal(layout.pose @ x, now)
    if layout.order == 2:
        assert_array_equal(layout.before @ x, before)


def test_from_here_counts_all_poses_from_the_present_place_and_leaves_drifts(layout, parts):
    now, before, drifts = parts
    here = np.array([now[0], 0.0, now[2]])
    want = state(layout, now - here, before - here, drifts)
    assert_array_equal(layout.from_here @ state(layout, now, before, drifts), want)


def test_a_shift_moves_all_poses_and_the_drifts_alike(layout, parts):
    now, _, drifts = parts
    want = state(layout, now, now, drifts)
    assert_array_equal(layout.shift @ np.concatenate([now, drifts]), want)


def test_turned_in_time_the_pose_after_is_the_pose_before(layout, parts, rng):
    now, before, drifts = parts
    after, later = rng.normal(size=3), rng.normal(size=len(drifts))
    here, there = state(layout, now, before, drifts), state(layout, after, now, later)
    assert_array_equal(layout.turned @ np.concatenate([here, there]), state(layout, now, after, drifts))


def test_the_dynamics_regard_all_but_the_place_and_the_drifts(layout, parts):
    now, before, drifts = parts
    got = layout.regard @ state(layout, now, before, drifts)
    want = [now[1]] if layout.order == 1 else [now[1], before[1], now[0] - before[0], now[2] - before[2]]
    assert_array_equal(got, want)


def test_what_is_carried_and_steady_coefficients_of_what_is_regarded_go_on_as_before(layout, parts):
    now, before, drifts = parts
    x = state(layout, now, before, drifts)
    got = layout.carry @ x + layout.steady @ np.append(layout.regard @ x, 1.0)
    np.testing.assert_allclose(got, now if layout.order == 1 else 2.0 * now - before, atol=1e-15)
