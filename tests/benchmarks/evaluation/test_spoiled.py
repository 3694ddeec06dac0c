"""Spoiled points: as much damage as asked for, the marks beneath it, and rivals that work."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.benchmarks.evaluation.spoiled import (
    Damage,
    by_frame,
    constant_velocity,
    filled,
    median,
    splined,
    spoil,
    twins,
)
from tests.oracles import condition
from tracker.foreign.points import Points
from tracker.tables.keypoints import Mark

NAMES = ("head_top", "hip", "near_knee", "near_ankle", "far_knee", "far_ankle")
T = 200
STILL = Damage(jitter=0.0)


@pytest.fixture
def points():
    """Every joint goes straight, each at its own place and speed."""
    place = np.arange(6)[:, None] * [30.0, 17.0]
    speed = np.arange(1, 7)[:, None] * [0.5, -0.2]
    places = place + np.arange(T)[:, None, None] * speed
    return Points(NAMES, places, np.ones((T, 6)))


def test_a_path_goes_through_every_mark_and_no_further_than_them():
    marks = {t: {"hip": Mark(float(t), np.sin(t)), "neck": Mark(5.0, 2.0 * t)} for t in (0, 3, 7, 9)}
    marks[3]["near_toe"] = Mark(0.0, 0.0)
    del marks[9]["neck"]
    marks[1] = {"neck": Mark(5.0, 2.0)}
    path = splined(marks)
    assert path.names == ("neck", "hip")
    assert len(path) == 10
    assert_allclose([path.places[t, 1] for t in (0, 3, 7, 9)], [[t, np.sin(t)] for t in (0, 3, 7, 9)])
    assert_allclose(path.places[:8, 0, 1], 2.0 * np.arange(8))
    assert np.isnan(path.places[8:, 0]).all()
    assert_array_equal(path.likelihood[8:, 0], 0.0)


def test_exchanged_are_as_many_frames_as_asked_and_legs_alone(points):
    bad = spoil(points, Damage(jitter=0.0, exchanged=0.1), np.random.default_rng(0))
    other = [0, 1, 4, 5, 2, 3]
    assert_array_equal(twins(NAMES), other)
    assert len(bad.exchanged) == 20
    for t in range(T):
        want = points.places[t, other] if t in bad.exchanged else points.places[t]
        assert_array_equal(bad.points.places[t], want)
    stretch = spoil(points, Damage(jitter=0.0, stretch=10), np.random.default_rng(0)).exchanged
    assert sorted(stretch) == list(range(95, 105))


def test_missing_are_as_many_points_as_asked_or_all_in_the_hole(points):
    bad = spoil(points, Damage(jitter=0.0, missing=0.1), np.random.default_rng(0)).points
    gone = np.isnan(bad.places).any(-1)
    assert gone.sum() == 120
    assert_array_equal(bad.likelihood, np.where(gone, 0.0, 1.0))
    hole = np.isnan(spoil(points, Damage(jitter=0.0, hole=10), np.random.default_rng(0)).points.places)
    assert_array_equal(np.flatnonzero(hole.any((1, 2))), range(95, 105))
    assert hole[95:105].all()


def test_the_far_leg_takes_the_near_one_s_points_in_as_many_frames_as_asked(points):
    bad = spoil(points, Damage(jitter=0.0, both=0.2), np.random.default_rng(0)).points
    merged = (bad.places[:, 4] == bad.places[:, 2]).all(-1)
    assert merged.sum() == 40
    assert_array_equal(bad.places[:, :4], points.places[:, :4])
    assert_array_equal(bad.places[merged][:, 5], points.places[merged][:, 3])


def test_jitter_is_as_large_as_asked_and_the_same_seed_gives_the_same(points):
    bad = [spoil(points, Damage(), np.random.default_rng(seed)).points.places for seed in (0, 0, 1)]
    # The standard deviation of 2400 numbers is known to 1.4 %.
    assert (bad[0] - points.places).std() == pytest.approx(5.0, rel=0.06)
    assert_array_equal(bad[0], bad[1])
    assert (bad[0] != bad[2]).all()


def test_gaps_are_filled_by_lines_and_the_median_drops_what_stands_alone(points):
    bad = spoil(points, Damage(jitter=0.0, missing=0.1), np.random.default_rng(0)).points
    inner = slice(5, -5)
    assert_allclose(filled(bad).places[inner], points.places[inner], atol=1e-9)
    jump = points.places.copy()
    jump[50] += 100.0
    freed = median(Points(NAMES, jump, points.likelihood)).places
    assert np.abs(freed[inner] - points.places[inner]).max() < 10.0
    seen = np.isfinite(bad.places[7, :, 0])
    assert list(by_frame(bad)[7]) == [name for name, there in zip(NAMES, seen, strict=True) if there]


def test_the_smoother_conditions_each_path_on_all_its_points():
    rng, n, acceleration, jitter = np.random.default_rng(2), 7, 1.5, 3.0
    y = rng.normal(size=n).cumsum() * 4.0
    y[3] = np.nan
    places = np.stack([y, y], axis=1)[:, None]
    found = constant_velocity(Points(("hip",), places, np.ones((n, 1))), acceleration, jitter).places[:, 0, 0]
    # Place and speed of the first frame and every frame's own noise are what all that follows comes from.
    A, sources = np.array([[1.0, 1.0], [0.0, 1.0]]), 2 * n
    rows, state = [], np.eye(2, sources)
    for t in range(n):
        rows.append(state[0])
        if t + 1 < n:
            state = A @ state + np.eye(2, sources, k=2 * (t + 1))
    variance = np.r_[9.0 * jitter**2, 400.0, np.tile([1e-3 * acceleration**2, acceleration**2], n - 1)]
    C, seen = np.array(rows), np.isfinite(y)
    first = np.zeros(sources)
    first[0] = y[0]
    mean, _, _ = condition(first, np.diag(variance), C[seen], jitter**2 * np.eye(6), y[seen])
    assert_allclose(found, C @ mean, atol=1e-6)
