"""What stands in front of a walker is unknown to the fit; all else stays known."""

import numpy as np
import pytest

from tests.tracker.outline.films import FRAMES, HIP, MIDDLE, SIZE, UNIT, film, moved
from tracker.outline.bodies import Path
from tracker.outline.occluders import DENSITY, forget_occluders
from tracker.survey.evidence import NOTHING, UNITS

SCENE = NOTHING - round(2.5 * UNITS)
WIDE = 0.3 * UNIT
CAMERAS = (0.0, 0.0, 0.0, 0.0), (1.5, 0.3, 0.0, 0.004)
BRIM = 2.5 * UNIT / DENSITY  # places whose neighbours are forgotten


def off(walker, middle, top):
    """(T, h, w) pixels from a bush in the scene that is WIDE and reaches down from `top`; 0 inside."""
    pixels = np.stack(np.meshgrid(*(np.arange(n, dtype=float) for n in SIZE)), axis=-1).reshape(-1, 2)
    x, y = np.moveaxis(moved(walker.places, pixels), -1, 0).reshape(2, FRAMES, *SIZE[::-1])
    return np.maximum(np.abs(x - middle) - 0.5 * WIDE, 0.0) + np.maximum(top - y, 0.0)


def forgotten(walker, stage):
    """(T, h, w) what is unknown only once occluders are forgotten; nothing else changes."""
    before = stage.odds.copy()
    forget_occluders(stage, Path(0, walker.hips, walker.units, np.ones(FRAMES)))
    changed = stage.odds != before
    assert (stage.odds[changed] == NOTHING).all()
    return changed


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("top", [HIP - 2.0 * UNIT, HIP + 0.2 * UNIT])
def test_what_hides_a_walker_is_forgotten_and_nothing_else(rng, camera, top):
    walker = film(rng, camera=camera)
    away = off(walker, SIZE[0] / 2 + 4.0, top)
    stage = walker.stage(rng)
    stage.odds[away == 0.0] = SCENE
    hidden = (walker.cover > 0.9) & (away == 0.0)
    assert hidden.sum() > 200
    changed = forgotten(walker, stage)
    assert changed[hidden].mean() > 0.75
    assert not changed[away > BRIM].any()


@pytest.mark.parametrize("camera", CAMERAS)
def test_all_of_who_is_in_full_sight_stays_known(rng, camera):
    walker = film(rng, camera=camera)
    assert not forgotten(walker, walker.stage(rng)).any()


@pytest.mark.parametrize(
    ("frame", "shown", "during"),
    [(FRAMES - 5, SCENE, slice(None)), (MIDDLE, NOTHING, slice(MIDDLE - 8, MIDDLE + 9))],
    ids=["near the end of a path", "where others are for a while"],
)
def test_elsewhere_nothing_is_told(rng, frame, shown, during):
    walker = film(rng)
    stage = walker.stage(rng)
    stage.odds[during][off(walker, walker.hips[frame, 0], HIP)[during] == 0.0] = shown
    assert not forgotten(walker, stage).any()
