"""The tone curve: grey levels around the figure spread, monotone, and worked out there alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tracker.picture.tone import tone_curve

EVERYWHERE = (0.0, 0.0, 63.0, 63.0)


def grey(levels):
    return np.repeat(np.asarray(levels, np.uint8)[..., None], 3, axis=-1)


@pytest.fixture
def haze():
    """Grey levels from 100 to 139, each on as many pixels."""
    return grey(np.random.default_rng(0).permuted(np.resize(np.arange(100, 140), 64 * 64)).reshape(64, 64))


def test_levels_that_are_equally_frequent_are_spread_over_the_whole_range(haze):
    curve = tone_curve(haze, EVERYWHERE, 1.0).astype(float)
    # Equalised, the share of pixels up to a level is its place in the range, but where the ends are smoothed.
    inner = np.arange(110, 130)
    assert_allclose(curve[inner], 255.0 * (inner - 99) / 40.0, atol=1.5)
    assert_allclose(curve[[0, 255]], [0.0, 255.0])


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_the_curve_goes_a_share_of_the_way_and_never_turns_back(haze, share):
    whole = tone_curve(haze, EVERYWHERE, 1.0).astype(float)
    curve = tone_curve(haze, EVERYWHERE, share).astype(float)
    assert_allclose(curve, (1.0 - share) * np.arange(256) + share * whole, atol=1.0)
    assert (np.diff(curve) >= 0.0).all()


def test_only_what_is_around_the_figure_counts(haze):
    framed = np.full((200, 300, 3), 250, np.uint8)
    framed[50:114, 80:144] = haze
    beside = tone_curve(framed, (80.0, 50.0, 143.0, 113.0), 0.5)
    assert_array_equal(beside, tone_curve(haze, EVERYWHERE, 0.5))


@pytest.mark.parametrize("box", [(-50.0, -20.0, 900.0, 900.0), (-90.0, -90.0, -10.0, -10.0)])
def test_a_figure_at_the_edge_has_a_curve_too(haze, box):
    curve = tone_curve(haze, box, 0.5)
    assert curve.shape == (256,)
    assert (np.diff(curve.astype(int)) >= 0).all()
