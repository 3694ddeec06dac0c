"""How far an outline may be off: its formula place by place, and what explains all is doubted least."""

import numpy as np
import pytest

from tests.tracker.outline.films import GRID, SHAPE, blobs, random_poses
from tracker.outline.doubt import AGAINST, ALL, COVERED, LITTLE, in_standard_errors, spread

OUT, NOT_OUT = 3.0, -3.0  # nats


def standing_out(q):
    """Log odds where poses stand out from the scene and nothing else does."""
    body, arms = SHAPE.painted(q, GRID)
    return np.where(body + arms > 0.5, OUT, NOT_OUT).astype(np.float32)


def test_the_spread_is_what_its_formula_says_place_by_place(rng):
    q, odds = random_poses(rng, 2), blobs(rng, 2)
    body, arms = SHAPE.painted(q, GRID)
    for t, found in enumerate(spread(SHAPE, q, odds, GRID)):
        within = beside = against = covered = 0.0
        for b, a, r in zip(body[t].flat, arms[t].flat, odds[t].flat, strict=True):
            within += b * max(r, 0.0)
            beside += (1.0 - max(a, b)) * max(r, 0.0)
            against += b * max(-r, 0.0)
            covered += b
        within, beside, against, covered = np.array([within, beside, against, covered]) / GRID.density**2
        share, not_out = within / (within + beside + LITTLE[0]), against / max(covered, LITTLE[1])
        assert found == pytest.approx(np.exp(ALL + COVERED * share + AGAINST * not_out), rel=1e-5)


def test_an_outline_is_doubted_where_it_covers_what_does_not_stand_out_or_leaves_out_what_does(rng):
    q = random_poses(rng, 20)
    seen = standing_out(q)
    right, other = spread(SHAPE, q, seen, GRID), spread(SHAPE, q[::-1], seen, GRID)
    assert np.median(other) > 3.0 * np.median(right)
    beside = seen.copy()
    beside[:, :, :12] = OUT
    assert (spread(SHAPE, q, beside, GRID) > 1.2 * right).all()
    beneath = np.where(np.arange(GRID.shape[0])[:, None] > 40, NOT_OUT, seen)
    assert (spread(SHAPE, q, beneath, GRID) > 1.2 * right).all()


def test_where_nothing_is_known_joints_may_be_anywhere(rng):
    q = random_poses(rng, 1)
    assert spread(SHAPE, q, np.zeros((1, *GRID.shape), np.float32), GRID)[0] > 1.0


def test_evidence_without_meaning_is_a_standard_error_away_from_nothing(rng):
    white = rng.normal(size=(2000, 60))
    found = np.array([in_standard_errors(each, 1.0) for each in white])
    assert found.mean() == pytest.approx(0.0, abs=0.07)
    assert found.std() == pytest.approx(1.0, abs=0.05)
    slow = np.repeat(white, 4, axis=1)
    assert np.std([in_standard_errors(each, 4.0) for each in slow]) == pytest.approx(1.0, abs=0.05)


def test_a_difference_that_lasts_counts_as_often_as_frames_are_independent():
    assert in_standard_errors(np.full(40, 0.1), 8.0) == pytest.approx(np.sqrt(5.0))
    assert in_standard_errors(np.full(40, -9.0), 8.0) == pytest.approx(-np.sqrt(5.0))


def test_too_few_frames_tell_nothing():
    assert in_standard_errors(np.ones(7), 8.0) == 0.0
    assert in_standard_errors(np.zeros(0), 3.0) == 0.0
    assert in_standard_errors(np.zeros(9), 3.0) == 0.0
