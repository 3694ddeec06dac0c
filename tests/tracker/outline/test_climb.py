from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg.blas import dtbsv

from tests.tracker.outline.films import CYCLES, MIDDLE, SHAPE, WALK, WALKER
from tracker.outline.climb import (
    ANGLE,
    ANKLE,
    BEND,
    BENT,
    CHANGE,
    GIVE,
    GRID,
    MARKED_ANGLE,
    WEIGHT,
    Marked,
    climb,
    factor,
)
from tracker.outline.cycles import at_phases, columns_of, poses
from tracker.outline.shape import arms_worth

HERE = 4  # the marked frame among those around it
PART = slice(MIDDLE - HERE, MIDDLE + HERE + 1)
UNKNOWN = Marked(HERE, np.zeros(len(WALKER.freedoms)), np.zeros(len(WALKER.freedoms), bool))
SPREADS, CHANGES = np.array([0.2, 1.5]), np.array([0.1, 0.7])
KNEE, TOE = WALKER.index("knee_near"), WALKER.index("ankle_near")


@pytest.fixture(scope="module")
def odds(walk, stage):
    return stage.around(walk.hips, walk.units, GRID)[PART]


@pytest.fixture(scope="module")
def path(walk):
    """Poses a little after the true ones."""
    return poses(WALKER, at_phases(CYCLES.pose[WALK], walk.phase[PART] + 2.5))


def score(odds, q):
    return SHAPE.under(q, odds, arms_worth(odds), GRID)[0]


def test_a_climb_ends_nearer_to_the_outline_and_to_the_truth(walk, odds, path):
    found, of_found, cost = climb(odds, SHAPE, path, UNKNOWN)
    assert cost < -WEIGHT * score(odds, path).sum()
    np.testing.assert_allclose(of_found, score(odds, found), rtol=1e-9)
    assert of_found.sum() > score(odds, path).sum()
    off, was = (np.abs(q - walk.q[PART])[:, columns_of(WALKER)].mean() for q in (found, path))
    assert off < 0.7 * was


def test_more_rounds_climb_higher_and_every_one_of_them_climbs(odds, path):
    costs = [climb(odds, SHAPE, path, UNKNOWN, rounds)[2] for rounds in (1, 2, 4, 8, 40)]
    assert -WEIGHT * score(odds, path).sum() > costs[0]
    assert np.all(np.diff(costs) < 0.0)


@pytest.mark.parametrize("degrees", [8.0, -8.0])
@pytest.mark.parametrize(("column", "spread"), [(KNEE, ANGLE), (TOE, ANKLE)])
def test_where_nothing_is_seen_a_marked_angle_spreads_as_the_prior_says(column, spread, degrees, path):
    T, off = len(path), np.radians(degrees)
    marked = replace(UNKNOWN, q=path[HERE].copy(), known=np.arange(len(UNKNOWN.q)) == column)
    marked.q[column] += off
    bent = np.array([BENT.get(name.partition("_")[0], 0.0) for name in WALKER.freedoms])
    # The unknowns are the changes of T frames, and the bend, which hardly falls below 0.
    rows = np.zeros((2 * T + 2, T + 1))
    rows[:T, :T], rows[T : 2 * T - 1, :T] = np.eye(T) / spread, np.diff(np.eye(T), axis=0) / (CHANGE * spread)
    rows[2 * T - 1, [HERE, T]] = 1.0 / MARKED_ANGLE, bent[column] / MARKED_ANGLE
    rows[2 * T, T], rows[2 * T + 1, T] = 1.0 / BEND, (degrees < 0.0) * np.sqrt(T) / GIVE
    sides = off / MARKED_ANGLE * (np.arange(2 * T + 2) == 2 * T - 1)
    *change, bend = np.linalg.lstsq(rows, sides, rcond=None)[0]
    found, *_ = climb(np.zeros((T, *GRID.shape), np.float32), SHAPE, path, marked)
    want = np.outer(change, np.arange(len(bent)) == column) + bend * bent
    np.testing.assert_allclose(found - path, want, atol=1e-4)


def test_a_mark_against_the_outline_moves_what_was_marked_and_hardly_the_other_knee(odds, path):
    known = np.arange(len(WALKER.freedoms)) == KNEE
    free = climb(odds, SHAPE, path, UNKNOWN)[0][HERE]
    held = climb(odds, SHAPE, path, Marked(HERE, free + np.radians(10.0), known))[0][HERE]
    moved = np.abs(held - free)
    assert np.radians(0.5) < moved[KNEE] < np.radians(10.0)
    assert moved[WALKER.index("knee_far")] < 0.2 * moved[KNEE]


@pytest.mark.parametrize("side", [0, 1])
def test_joints_pass_their_limits_by_little(side, odds, path):
    limit = WALKER.limits[side][KNEE]
    beyond = path.copy()
    beyond[:, KNEE] = limit + (-1.0, 1.0)[side] * np.radians(15.0)
    found = climb(np.zeros_like(odds), SHAPE, beyond, UNKNOWN)[0]
    # All frames alike: their spread about the path and the bend's, which is hardly below 0, against GIVE.
    bend = 1.0 / (1.0 / (len(path) * BEND**2) + side / GIVE**2)
    over = np.radians(15.0) / (1.0 + (ANGLE**2 + bend) / GIVE**2)
    np.testing.assert_allclose(np.abs(found[:, KNEE] - limit), over, atol=1e-4)


def precision(T, k):
    """Of a path near 0 and near itself a frame before."""
    change = np.diff(np.eye(T), axis=0) / CHANGES[k]
    return np.eye(T) / SPREADS[k] ** 2 + change.T @ change


@pytest.mark.parametrize("T", [1, 2, 7])
def test_paths_and_slopes_go_through_the_factor_of_the_precision(T, rng):
    U, z, slope = factor(T, SPREADS, CHANGES), rng.normal(size=(T, 2)), rng.normal(size=(T, 2))
    paths, slopes = dtbsv(2, U, z.ravel()).reshape(T, 2), dtbsv(2, U, slope.ravel(), trans=1).reshape(T, 2)
    for k in range(2):
        upper = np.linalg.cholesky(precision(T, k)).T
        np.testing.assert_allclose(upper @ paths[:, k], z[:, k], atol=1e-12)
        np.testing.assert_allclose(upper.T @ slopes[:, k], slope[:, k], atol=1e-12)
