import numpy as np
import pytest

from kinematics.spm import skeleton
from tests.oracles import central_difference
from tests.tracker.outline.films import GRID, SHAPE, WALKER, blobs, random_poses
from tracker.outline.rasters import SURE, _window
from tracker.outline.shape import ARM_SHARE, SOFT, Grid, arms_worth

assert SHAPE.bars[:, 4].any()  # some bars lie beside their links


def member(bar, bones, link, place):
    """m of one place and bar, written out."""
    first, last, start, tip, beside = bar
    length, size = bones.length[link], bones.size
    away = place - bones.start[link]
    u, v = away @ bones.direction[link], away @ bones.normal[link] - size * beside
    w = np.clip(u, first * length, last * length)
    half = size * (start + (tip - start) * (w / length - first) / (last - first))
    edge = np.clip((half - np.hypot(u - w, v)) / (SOFT * size), -1.0, 1.0)
    return SURE * (0.5 + 0.75 * edge - 0.25 * edge**3)


def test_a_silhouette_is_what_its_formula_says_place_by_place(rng):
    q = random_poses(rng, 1)
    body, arms = SHAPE.painted(q, GRID)
    bones = skeleton(WALKER, q[0])
    for i, j in rng.integers(0, 60, size=(300, 2)):
        place = np.array([GRID.corner[0] + j / GRID.density, GRID.corner[1] - i / GRID.density])
        clear = np.prod([1.0 - member(SHAPE.bars[k], bones, k, place) for k in range(len(WALKER.links))])
        zone = member(SHAPE.bars[-1], bones, SHAPE.trunk, place)
        assert body[0, i, j] == pytest.approx(1.0 - clear, abs=1e-6)
        assert arms[0, i, j] == pytest.approx(clear * zone, abs=1e-6)


def test_no_row_of_a_bar_leaves_the_grid_wherever_the_bar_lies(rng):
    step, corner, (h, w) = 1.0 / GRID.density, np.asarray(GRID.corner), GRID.shape
    for q in rng.normal(size=(40, len(WALKER.freedoms))) * 2.0:
        bars = SHAPE._laid(skeleton(WALKER, q[None]))[0]
        for bar in bars:
            i0, i1, j0, j1 = _window((h, w), corner, step, bar)
            assert 0 <= i0 <= i1 <= h
            assert 0 <= j0 <= j1 <= w


@pytest.mark.parametrize("shift", [(0, 0), (-1.4, 0.2), (1.5, 0.0), (0.1, -1.6), (0.0, 2.2), (-2.0, -2.0)])
def test_the_sum_is_of_log_odds_under_the_silhouette_and_beside_it_as_far_as_the_grid_reaches(shift, rng):
    q, odds = random_poses(rng, 4), blobs(rng, 4)
    q[:, :2] += shift
    more, inside = 4 * int(GRID.density), slice(4 * int(GRID.density), -4 * int(GRID.density))
    rows, columns = GRID.shape
    wide = Grid(
        (GRID.corner[0] - 4.0, GRID.corner[1] + 4.0), GRID.density, (rows + 2 * more, columns + 2 * more)
    )
    body, arms = (each[:, inside, inside] for each in SHAPE.painted(q, wide))
    np.testing.assert_allclose(SHAPE.painted(q, GRID)[0], body, atol=1e-6)
    want = (odds * body + arms_worth(odds) * arms).sum((1, 2)) / GRID.density**2
    found, slope = SHAPE.under(q, odds, arms_worth(odds), GRID)
    np.testing.assert_allclose(found, want, rtol=1e-5, atol=1e-6)
    worth = arms_worth(odds)
    steep = central_difference(lambda z: SHAPE.under(z[None], odds[:1], worth[:1], GRID)[0], q[0], step=1e-5)
    # The second derivative jumps where a place enters the soft edge: step times that jump is left.
    np.testing.assert_allclose(slope[0], steep[0], atol=1e-5)


def test_where_arms_may_be_log_odds_are_those_of_a_mixture():
    odds = np.linspace(-2.5, 2.5, 11, dtype=np.float32)
    want = np.log((1.0 - ARM_SHARE) + ARM_SHARE * np.exp(odds))
    np.testing.assert_allclose(arms_worth(odds), want, atol=1e-6)
