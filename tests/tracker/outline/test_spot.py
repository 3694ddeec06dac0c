"""Who moves on the spot is seen by limbs that stand out where they did before."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.outline.films import CYCLES, MIDDLE, UNIT, WALKER
from tracker.outline.spot import PART, spot
from tracker.survey.evidence import NOTHING

LEGS = [i for i, name in enumerate(WALKER.joints) if name.endswith(("knee", "ankle", "toe"))]


@pytest.fixture
def treadmill(walk, rng):
    """The walk with the hip at rest, where what is covered in most frames is the scene; and its joints."""
    film = walk.on_the_spot()
    cover = np.abs(film.cover - (film.cover.mean(0) > 0.5))
    return replace(film, cover=cover).stage(rng), film.joints


def test_legs_that_swing_on_the_spot_tell_where_and_about_how_large(treadmill):
    stage, joints = treadmill
    found = spot(stage)
    assert found.hip == pytest.approx(joints[MIDDLE, 0], abs=0.4 * UNIT)
    assert found.unit == pytest.approx(UNIT, rel=0.2)
    apart = np.ptp(joints[:, LEGS, 0], axis=1)
    assert apart[found.frame] > 0.8 * apart.max()
    placed = found.joints(WALKER, CYCLES, 1)
    assert placed.shape == joints[0].shape
    assert placed[0] == pytest.approx(found.hip)
    assert np.hypot(*(placed - joints[found.frame]).T).mean() < 0.3 * UNIT  # facing left 0.5
    assert found.joints(WALKER, CYCLES, -1)[:, 0] - found.hip[0] == pytest.approx(found.hip[0] - placed[:, 0])


def test_the_film_may_have_more_pixels_than_its_small_pictures(treadmill):
    stage, _ = treadmill
    found, twice = spot(stage), spot(replace(stage, up=np.diag([2.0, 2.0, 1.0])))
    assert twice.hip == pytest.approx(2.0 * found.hip)
    assert twice.unit == pytest.approx(2.0 * found.unit)


def test_who_goes_through_the_picture_is_on_no_spot(walk, rng):
    faster = 3 * (np.arange(len(walk.q)) - MIDDLE)
    stage = walk.carried(np.stack([faster, 0 * faster], axis=1)).stage(rng)
    assert spot(stage) is None
    for everywhere in (0, 50):  # nothing at all, or another scene
        assert spot(replace(stage, odds=np.full_like(stage.odds, NOTHING + everywhere))) is None


def test_a_small_body_is_a_part_and_one_that_leaves_is_not_there(treadmill):
    found = spot(treadmill[0])
    hips, small = np.tile(found.hip, (5, 1)), np.full(5, 0.9 * PART * found.unit)
    assert found.larger(small)
    assert not found.larger(small / 0.8)
    assert found.holds(hips)
    assert not found.holds(hips + np.arange(5)[:, None] * [found.unit, 0.0])
