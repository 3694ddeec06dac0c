"""Frames ready for registration: what lies between pixels, and where a part's edges are."""

from itertools import pairwise

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import gaussian_filter, map_coordinates

from tracker.picture.pyramid import pyramid, sample

SIGMAS = (3.0, 1.5, 0.8)
H, W = 60, 80
WHOLE = (0, 0, W, H)


@pytest.fixture
def image(rng):
    return rng.integers(0, 256, (H, W, 3)).astype(np.uint8)


@pytest.fixture
def pixels(rng):
    return rng.uniform((0, 0), (W - 1, H - 1), size=(200, 2))


def lab_of(image):
    return cv2.cvtColor(image, cv2.COLOR_RGB2Lab).astype(float)


def between(plane, pixels):
    """scipy's own bilinear interpolation of (h, w) at (P, 2) pixels."""
    return map_coordinates(plane, pixels[:, ::-1].T, order=1, mode="nearest")


def test_values_are_the_blurred_lab_colours_between_pixels(image, pixels):
    for level, sigma in zip(pyramid(image, WHOLE, SIGMAS, colour=True), SIGMAS, strict=True):
        assert level.sigma == sigma
        values, _ = sample(level, pixels)
        for channel in range(3):
            plane, reach = lab_of(image)[..., channel], int(np.ceil(3.0 * sigma))
            soft = gaussian_filter(plane, sigma, mode="mirror", radius=reach)
            # Of 255 grey levels, float32 keeps 2e-5.
            assert_allclose(values[:, channel], between(soft, pixels), atol=0.005)


@pytest.mark.parametrize("sigma", [6.2, 12.5])
@pytest.mark.parametrize("box", [(0, 0, 203, 170), (75, 61, 140, 111)])
def test_a_wide_blur_of_a_reduced_picture_is_that_of_the_whole_one(sigma, box, rng):
    y, x = np.mgrid[:170, :203]
    grey = np.rint(128.0 + 60.0 * np.sin(x / (1.5 * sigma)) * np.cos(y / (2.0 * sigma))).astype(np.uint8)
    (level,) = pyramid(np.repeat(grey[..., None], 3, axis=-1), box, [sigma], colour=True)
    assert level.step == int(sigma // 3.0)
    pixels = rng.uniform((75, 61), (140, 111), size=(300, 2))
    soft = gaussian_filter(lab_of(np.repeat(grey[..., None], 3, axis=-1))[..., 0], sigma, truncate=3.0)
    values, inside = sample(level, pixels)
    assert inside.all()
    # Linear between places a third of sigma apart: 60 (1/3)^2 / 8 (1/1.5^2 + 1/2^2) = 0.6 grey levels; 0.3
    # by rounded colours. Half a pixel beside it they differ by 2.
    assert_allclose(values[:, 0], between(soft, pixels), atol=0.9)


def test_every_channel_goes_through_the_tone_curve(image):
    curve = np.arange(255, -1, -1).astype(np.uint8)
    (found,), (want,) = (pyramid(*of, [1.0], True) for of in ((image, WHOLE), (255 - image, WHOLE)))
    (toned,) = pyramid(image, WHOLE, [1.0], True, curve)
    assert_array_equal(toned.planes, want.planes)
    assert np.abs(found.planes - want.planes).max() > 10.0


def test_a_blur_of_nothing_keeps_the_frame_itself(image):
    rows, columns = np.mgrid[: H - 1, : W - 1]
    pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(float)
    values, _ = sample(pyramid(image, WHOLE, [0.0], colour=True)[0], pixels)
    assert_allclose(values, lab_of(image)[rows, columns].reshape(-1, 3), atol=1e-4)


def test_without_colour_every_channel_is_the_lightness(image, pixels):
    grey, _ = sample(pyramid(image, WHOLE, [2.0], colour=False)[0], pixels)
    colour, _ = sample(pyramid(image, WHOLE, [2.0], colour=True)[0], pixels)
    for channel in range(3):
        assert_allclose(grey[:, channel], colour[:, 0], atol=1e-3)


def test_a_pixel_is_the_same_whatever_part_of_the_frame_it_is_read_from(image, rng):
    pixels = rng.uniform((35, 25), (45, 35), size=(100, 2))
    boxes = [WHOLE, (35, 25, 45, 35), (20, 10, 46, 59), (33, 25, 79, 36)]
    found = [[sample(level, pixels) for level in pyramid(image, box, SIGMAS, colour=True)] for box in boxes]
    for first, second in pairwise(found):
        for a, b in zip(first, second, strict=True):
            assert a[1].all()
            assert b[1].all()
            # Parts reach three sigma beyond their boxes; 0.13 % of a blur's weight lies further off on one
            # side, of white noise of 20 to 60 grey levels, averaged over many pixels.
            assert_allclose(a[0], b[0], atol=0.05)


def test_a_part_reaches_three_sigma_beyond_its_box_and_ends_with_the_frame(image):
    (level,) = pyramid(image, (30, 20, 50, 40), [2.0], colour=True)
    assert level.corner[0] <= 30 - 6
    assert level.corner[1] <= 20 - 6
    assert level.corner[0] + level.planes.shape[1] >= 50 + 6
    assert level.corner[1] + level.planes.shape[0] >= 40 + 6
    (level,) = pyramid(image, (-40, -40, 200, 200), [2.0], colour=True)
    assert_array_equal(level.corner, [0.0, 0.0])
    assert level.planes.shape[:2] == (H, W)


@pytest.mark.parametrize("box", [WHOLE, (30, 20, 50, 40)])
def test_points_beyond_the_part_are_flagged_and_those_on_its_edge_are_not(image, box):
    (level,) = pyramid(image, box, [1.0], colour=True)
    low = np.array(level.corner, dtype=float)
    high = low + np.array(level.planes.shape[1::-1]) - 1.0
    middle = 0.5 * (low + high)
    edge = np.array([low, high, (low[0], high[1]), (high[0], middle[1])])
    beyond = np.array(
        [(low[0] - 1e-6, middle[1]), (middle[0], high[1] + 1e-6), (high[0] + 500.0, middle[1]), low - 1e9]
    )
    values, inside = sample(level, np.concatenate([edge, beyond]))
    assert_array_equal(inside, [True] * 4 + [False] * 4)
    assert np.isfinite(values).all()
    corners = lab_of(image)[edge[:2, 1].astype(int), edge[:2, 0].astype(int)]
    flat, _ = sample(pyramid(image, box, [0.0], colour=True)[0], edge[:2])
    if box == WHOLE:
        # The last pixel is read a thousandth of a pixel inside it.
        assert_allclose(flat, corners, atol=2 * 255 * 1e-3)


BEYOND = [(500, 20, 520, 40), (-90, 20, -60, 40), (20, 400, 30, 500), (10, -80, 30, -50)]


@pytest.mark.parametrize("box", BEYOND)
def test_a_box_beyond_the_frame_still_gives_a_part_of_it(image, box):
    (level,) = pyramid(image, box, [1.0], colour=True)
    height, width = level.planes.shape[:2]
    assert min(height, width) >= 2
    assert 0 <= level.corner[0] <= W - width
    assert 0 <= level.corner[1] <= H - height
    middle = 0.5 * np.array([[box[0] + box[2], box[1] + box[3]]], dtype=float)
    assert not sample(level, middle)[1].any()
