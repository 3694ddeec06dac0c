from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.outline.films import FPS, film, moved
from tracker.outline.shape import Grid
from tracker.outline.stage import Stage
from tracker.picture.small import to_film
from tracker.survey.evidence import NOTHING, UNITS

GRID = Grid((-0.5, 0.25), 20.0, (13, 21))
UP = to_film((120, 80), (240, 160))
HIPS, UNITS_SEEN = np.array([[100.3, 70.8], [120.0, 81.5]]), np.array([40.0, 30.0])


def ramp(across, down):
    return across * np.arange(120) + down * np.arange(80)[:, None] + 10


@pytest.mark.parametrize("density", [20.0, 9.0, 6.0, 4.4])  # small pictures blurred by 1 to 4 pixels
@pytest.mark.parametrize("facing", [1, -1])
def test_log_odds_around_a_hip_are_those_of_the_pixels_that_the_grid_lies_on(facing, density):
    odds = np.stack([ramp(1, 1), ramp(0, 3)]).astype(np.uint8)
    stage = Stage(odds, odds, UP, np.tile(np.eye(3), (2, 1, 1)), facing, FPS, np.ones(2))
    grid = replace(GRID, density=density, shape=(5, 5))
    found = stage.around(HIPS, UNITS_SEEN, grid)
    for t, (across, down) in enumerate([(1, 1), (0, 3)]):
        for i, j in np.ndindex(grid.shape):
            x, y = grid.corner[0] + j / density, grid.corner[1] - i / density
            pixel = HIPS[t] + UNITS_SEEN[t] * np.array([facing * x, -y])
            column, row = 0.5 * pixel - 0.25  # of a picture half as large
            want = (across * column + down * row + 10.0 - NOTHING) / UNITS
            assert found[t, i, j] == pytest.approx(want, abs=0.75 / UNITS)


def test_log_odds_beyond_the_picture_are_nought():
    odds = np.full((1, 80, 120), NOTHING + 100, np.uint8)
    stage = Stage(odds, odds, UP, np.eye(3)[None], 1, FPS, np.ones(1))
    found = stage.around(np.array([[0.0, 80.0]]), np.array([60.0]), GRID)[0]
    assert np.all(found[:, :9] == 0.0)
    assert np.all(found[:, -9:] == 2.0)


@pytest.mark.parametrize("facing", [1, -1])
def test_the_light_of_a_place_is_that_of_its_pixel(facing):
    light = np.stack([ramp(1, 1), ramp(0, 2)[::-1]]).astype(np.uint8)
    stage = Stage(light, light, UP, np.tile(np.eye(3), (2, 1, 1)), facing, FPS, np.ones(2))
    small = np.array([[[30, 50], [61, 20]], [[100, 11], [47, 70]]])
    places = (2.0 * small + 0.5 - HIPS[:, None]) / UNITS_SEEN[:, None, None] * (facing, -1.0)
    want = [[light[t, y, x] for x, y in small[t]] for t in range(2)]
    np.testing.assert_allclose(stage.at(stage.light, HIPS, UNITS_SEEN, places), want, atol=1e-3)


def test_the_first_frames_pixels_are_found_by_each_frames_place_and_back(rng):
    places = film(rng, frames=6, camera=(3.0, -1.0, 0.02, 0.03), walker=False).places
    still = np.zeros((6, 8, 8), np.uint8)
    stage = Stage(still, still, np.eye(3), places, 1, FPS, np.ones(len(places)))
    pixels = rng.uniform(0.0, 200.0, (6, 2))
    scene = stage.in_scene(pixels)
    np.testing.assert_allclose(scene, moved(places, pixels[:, None])[:, 0])
    np.testing.assert_allclose(stage.in_frames(scene), pixels)
    assert np.abs(replace(stage, places=places[::-1]).in_frames(scene) - pixels).max() > 1.0
