"""Paths of bodies through a film in which nobody is marked."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.outline.films import CYCLES, FPS, SHAPE, UNIT, enlarged, film
from tracker.outline.bodies import LARGEST, paths
from tracker.outline.stage import Stage
from tracker.survey.surveyed import survey

EXACT = 0.04  # leg lengths in the mean: what stands out beside a body tells its place more exactly
NEAR = 0.25  # leg lengths: places lie an eighth of one apart, and no body is the mean one


def found_in(stage):
    return paths(stage, SHAPE, CYCLES)


def surveyed(film):
    """The film with the log odds that a survey gives it."""
    seen = survey(iter(film.images), 1.0)
    odds, light, shares = map(np.stack, zip(*seen.seen(film.images), strict=True))
    return Stage(odds, light, seen.up, seen.places, 1, FPS, shares)


def away(path, walk):
    """Leg lengths from a walker's hip in each of the path's frames."""
    return np.hypot(*(path.hips - walk.hips[path.first : path.last + 1]).T) / UNIT


def test_a_walker_is_one_path_from_the_first_frame_to_the_last(walk):
    (path,) = found_in(surveyed(walk))
    assert (path.first, path.last) == (0, len(walk.q) - 1)
    assert away(path, walk).max() < NEAR
    assert away(path, walk).mean() < EXACT
    assert np.all((path.units > 0.75 * UNIT) & (path.units < 1.15 * UNIT))
    assert len(path.score) == len(path.hips)


def test_a_path_is_told_in_the_pixels_of_each_frame_where_the_camera_moves(rng):
    panned = film(rng, frames=20, camera=(2.0, 0.5, 0.0, 0.0))
    (path,) = found_in(panned.stage(rng))
    assert (
        np.ptp(panned.hips[:, 0]) < 0.3 * UNIT < 0.9 * UNIT < np.ptp(panned.hips[:, 0] + 2.0 * np.arange(20))
    )
    assert away(path, panned).max() < NEAR


def test_a_path_begins_where_its_walker_appears_and_ends_where_the_walker_is_gone(walk, rng):
    cover = walk.cover.copy()
    cover[:6], cover[28:] = 0.0, 0.0
    (path,) = found_in(replace(walk, cover=cover).stage(rng))
    # Every other frame is looked at.
    assert abs(path.first - 6) <= 1
    assert abs(path.last - 27) <= 1


def test_two_who_walk_apart_are_two_paths(two, rng):
    left, right = two
    found = found_in(left.behind(right).stage(rng))
    assert len(found) == 2
    assert found[0].score.sum() >= found[1].score.sum()
    one, other = sorted(found, key=lambda path: path.hips[0, 0])
    assert max(away(one, left).max(), away(other, right).max()) < NEAR


@pytest.mark.parametrize("by", [0.5, 2.0])
def test_the_same_two_are_found_whatever_the_size_of_the_first_frame(by, two, rng):
    left, right = two
    stage = left.behind(right).stage(rng)
    for found, same in zip(found_in(stage), found_in(enlarged(stage, by)), strict=True):
        np.testing.assert_allclose(same.hips, found.hips, atol=1e-6)


def test_a_place_is_told_to_a_pixel_in_rows_and_columns_though_their_scales_differ(walk, stage):
    stretched = replace(stage, up=np.diag([4.0, 4.1, 1.0]))
    (found,), (same,) = found_in(stage), found_in(stretched)
    np.testing.assert_allclose(same.hips, found.hips * [4.0, 4.1], atol=0.5)


def test_who_is_of_another_size_is_not_looked_for(walk, stage):
    (path,) = paths(stage, SHAPE, CYCLES, UNIT)
    assert away(path, walk).max() < NEAR
    assert paths(stage, SHAPE, CYCLES, 3.0 * UNIT) == []
    assert paths(stage, SHAPE, CYCLES, 0.1 * UNIT) == []  # smaller than any that is looked for


@pytest.mark.parametrize("mean", [-2.0, -0.5])
def test_what_stands_out_here_and_there_is_nobody(mean, walk, rng):
    shape = 20, *walk.cover.shape[1:]
    noise = replace(walk.part(slice(20)), cover=0.5 + (mean + rng.normal(size=shape)) / 5.0)
    assert found_in(noise.stage(rng)) == []


def test_what_stands_out_everywhere_is_nobody(walk, rng):
    lit = walk.part(slice(20))
    assert found_in(replace(lit, cover=np.ones_like(lit.cover)).stage(rng)) == []


def test_who_is_too_large_for_the_picture_is_not_looked_for(walk, stage):
    cut = slice(70, 120)  # of rows: the leg is four fifths of what is left
    low = replace(stage, odds=stage.odds[:, cut], light=stage.light[:, cut])
    (path,) = found_in(low)
    assert path.units.max() < LARGEST * (cut.stop - cut.start) < 0.7 * UNIT
