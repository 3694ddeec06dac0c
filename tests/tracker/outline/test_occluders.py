"""What stands in front of a walker is unknown to the fit; all else stays known."""

import numpy as np
import pytest

from tests.tracker.outline.films import FRAMES, HIP, MIDDLE, SIZE, UNIT, film, moved
from tracker.outline.bodies import Path
from tracker.outline.occluders import DENSITY, ENDS, forget_occluders
from tracker.survey.evidence import NOTHING, UNITS

SCENE = NOTHING - round(2.5 * UNITS)
WIDE = 0.3 * UNIT
BRIM = 2.5 * UNIT / DENSITY  # places whose neighbours are forgotten


def path(walker):
    return Path(0, walker.hips, walker.units, np.ones(FRAMES))


def off(walker, middle, top):
    """(T, h, w) pixels from a bush in the scene that is WIDE and reaches down from `top`; 0 inside."""
    pixels = np.stack(np.meshgrid(*(np.arange(n, dtype=float) for n in SIZE)), axis=-1).reshape(-1, 2)
    x, y = np.moveaxis(moved(walker.places, pixels), -1, 0).reshape(2, FRAMES, *SIZE[::-1])
    return np.maximum(np.abs(x - middle) - 0.5 * WIDE, 0.0) + np.maximum(top - y, 0.0)


@pytest.mark.parametrize("camera", [(0.0, 0.0, 0.0, 0.0), (1.5, 0.3, 0.0, 0.004)])
@pytest.mark.parametrize("top", [HIP - 2.0 * UNIT, HIP + 0.2 * UNIT])
def test_what_hides_a_walker_is_forgotten_and_nothing_else(rng, camera, top):
    walker = film(rng, camera=camera)
    away = off(walker, SIZE[0] / 2 + 4.0, top)
    stage = walker.stage(rng)
    stage.odds[away == 0.0] = SCENE
    before = stage.odds.copy()
    forget_occluders(stage, path(walker))
    hidden = (walker.cover > 0.9) & (away == 0.0)
    assert hidden.sum() > 200
    assert (stage.odds[hidden] == NOTHING).mean() > 0.75
    np.testing.assert_array_equal(stage.odds[away > BRIM], before[away > BRIM])


@pytest.mark.parametrize("camera", [(0.0, 0.0, 0.0, 0.0), (1.5, 0.3, 0.0, 0.004)])
def test_all_of_who_is_in_full_sight_stays_known(rng, camera):
    walker = film(rng, camera=camera)
    stage = walker.stage(rng)
    before = stage.odds.copy()
    forget_occluders(stage, path(walker))
    np.testing.assert_array_equal(stage.odds, before)


def test_near_the_end_of_a_path_nothing_is_told(rng):
    walker = film(rng)
    stage = walker.stage(rng)
    stage.odds[off(walker, walker.hips[-1, 0] - 0.5 * ENDS * UNIT, HIP) == 0.0] = SCENE
    before = stage.odds.copy()
    forget_occluders(stage, path(walker))
    np.testing.assert_array_equal(stage.odds, before)


def test_what_others_hide_is_no_occluder(rng):
    walker = film(rng)
    stage = walker.stage(rng)
    stage.odds[off(walker, walker.hips[MIDDLE, 0], 0.0) == 0.0] = NOTHING
    before = stage.odds.copy()
    forget_occluders(stage, path(walker))
    np.testing.assert_array_equal(stage.odds, before)
