"""Corners of a picture against a saddle worked out by hand."""

import numpy as np
import pytest

from tracker.picture.camera import sharpest, sharpness


def test_sharpness_is_the_mean_square_of_the_slope_along_the_weaker_direction_and_an_edge_has_none():
    a = 0.5
    x, y = np.meshgrid(np.arange(-10.0, 11.0), np.arange(-10.0, 11.0))
    # The slope of 128 + a x y is a (y, x); over 7 x 7 pixels about 0 the mean of x^2 and y^2 is 4, of x y 0.
    assert sharpness(128.0 + a * x * y)[10, 10] == pytest.approx(4.0 * a * a, rel=1e-5)
    assert np.abs(sharpness(128.0 + 5.0 * x)).max() < 1e-3


def test_every_cell_has_its_sharpest_corner_if_it_is_sharp_enough():
    sharp = np.zeros((40, 48), np.float32)
    sharp[3, 4], sharp[7, 7], sharp[12, 47], sharp[18, 3] = 11.0, 12.0, 16.0, 8.9
    assert sharpest(sharp).tolist() == [[7.0, 7.0], [47.0, 12.0]]
