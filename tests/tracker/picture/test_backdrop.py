"""The scene behind the figure: what is known of it, how a frame differs, and how it goes with the camera."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.tracker.painted import Cloth
from tracker.picture.backdrop import (
    ALIKE,
    BLEND,
    MOST,
    NOISE,
    ROBUST,
    STEP,
    UNKNOWN,
    UNSEEN,
    Scenery,
    first_backdrop,
    small,
)

UNIT = 80.0  # pixels: a step is 2
WIDTH, HEIGHT = 160, 120
HERE, THERE = (20.0, 30.0, 59.0, 99.0), (90.0, 30.0, 129.0, 99.0)  # where the figure stands, and later
STILL = np.zeros(2)


def scene(rng, shift=(0, 0)):
    """A painted scene shifted right and down by whole pixels, clear of black and white."""
    x, y = np.meshgrid(np.arange(WIDTH) - shift[0], np.arange(HEIGHT) - shift[1])
    places = np.stack([x, y], axis=-1) / UNIT
    return np.clip(np.round(Cloth(rng, wavelengths=(0.3, 0.9), contrast=10.0)(places)), 60, 190).astype(
        np.uint8
    )


@pytest.fixture
def image(rng):
    return scene(rng)


@pytest.fixture
def begun(image):
    return first_backdrop(image, HERE, UNIT)


def differs(backdrop, box):
    """Of the places wholly within a box of pixels."""
    step = backdrop.scenery.step
    x0, y0, x1, y1 = (int(side) for side in box)
    return backdrop.scenery.differs[-(-y0 // step) : (y1 + 1) // step, -(-x0 // step) : (x1 + 1) // step]


def covered(image, box, by):
    """The picture with grey levels added within a box."""
    x0, y0, x1, y1 = (int(side) for side in box)
    picture = image.astype(int)
    picture[y0 : y1 + 1, x0 : x1 + 1] += by
    return np.clip(picture, 0, 255).astype(np.uint8)


def test_a_step_is_a_share_of_the_leg_and_a_pixel_at_least(image):
    for unit in (5.0, 80.0, 150.0, 160.0):
        step = first_backdrop(image, HERE, unit).scenery.step
        assert step == max(1, round(STEP * unit))


@pytest.mark.parametrize("step", [1, 2, 7])
def test_a_place_is_the_mean_of_its_pixels(step, image):
    found = small(image, step)
    assert found.shape == (-(-HEIGHT // step), -(-WIDTH // step), 3)
    for row, column in ((0, 0), (3, 11), (9, 5)):
        block = image[row * step : (row + 1) * step, column * step : (column + 1) * step]
        mean = np.round(block.mean(axis=(0, 1), keepdims=True)).astype(np.uint8)
        # A mean that rounds the other way, by one, moves Lab by less than two.
        assert_allclose(found[row, column], cv2.cvtColor(mean, cv2.COLOR_RGB2Lab)[0, 0], atol=2.0)


def test_at_first_nothing_is_known_where_the_figure_stands_and_all_beside_it(begun):
    step = begun.scenery.step
    rows, columns = np.indices(begun.known.shape)
    # A place is known unless the box touches it.
    x, y = columns * step, rows * step
    x0, y0, x1, y1 = HERE
    touched = (x + step > x0) & (x <= x1) & (y + step > y0) & (y <= y1)
    assert_array_equal(begun.known, ~touched)
    assert (begun.scenery.differs == UNKNOWN).all()


def test_what_the_figure_has_covered_from_the_start_differs_by_the_unknown_until_it_has_left(begun, image):
    same = begun.follow(image, HERE, STILL)
    assert (same.scenery.differs == UNKNOWN).all()
    left = same.follow(image, THERE, STILL)
    assert left.known[same.known].all()
    assert differs(left, THERE).max() < 0.1
    back = left.follow(image, HERE, STILL)
    assert differs(back, HERE).max() < 0.1


def test_a_place_that_shows_the_scene_differs_little_and_one_that_is_covered_much(begun, image):
    by = np.array([50, -20, -50])
    x0, y0, x1, y1 = THERE
    half = (x0, y0, 0.5 * (x0 + x1), y1)
    found = begun.follow(covered(image, half, by), THERE, STILL)
    inner = (half[0] + 4, half[1] + 4, half[2] - 4, half[3] - 4)
    bare = (half[2] + 4, y0 + 4, x1 - 4, y1 - 4)
    assert differs(found, bare).max() < 0.1
    assert differs(found, inner).min() > 10.0 * differs(found, bare).max()
    assert differs(found, inner).mean() > UNKNOWN
    # Beside the box nothing is asked.
    assert (differs(found, (0.0, 0.0, 80.0, 20.0)) == UNKNOWN).all()


@pytest.mark.parametrize(("places", "bare"), [(1, False), (3, True), (7, True)])
def test_a_place_is_like_the_scene_only_with_all_around_it(places, bare):
    # A scene of one colour, so that a place looks like those beside it.
    begun = first_backdrop(np.full((HEIGHT, WIDTH, 3), 40, np.uint8), HERE, UNIT)
    step = begun.scenery.step
    picture = covered(np.full((HEIGHT, WIDTH, 3), 40, np.uint8), THERE, 80)
    row, column = (int(0.5 * (THERE[i] + THERE[i + 2])) // step for i in (1, 0))
    reach = places // 2
    rows, columns = (slice((n - reach) * step, (n + reach + 1) * step) for n in (row, column))
    picture[rows, columns] = 40  # a hole in what covers the scene
    found = begun.follow(picture, THERE, STILL).scenery
    assert (found.around[row, column] < ALIKE) == bare
    assert found.around[row, column + reach] > UNKNOWN  # its edge is not
    assert found.differs[row, column + reach] < ALIKE


@pytest.mark.parametrize("by", [6.0, 15.0, 200.0])
def test_a_difference_is_the_robust_square_of_the_colours_up_to_a_most(by):
    # A scene of one colour, so that a place looks like those beside it.
    plain = np.full((HEIGHT, WIDTH, 3), 40, np.uint8)
    begun = first_backdrop(plain, HERE, UNIT)
    grey = plain.copy()
    x0, y0, x1, y1 = (int(side) for side in THERE)
    grey[y0 : y1 + 1, x0 : x1 + 1] += np.uint8(by)
    found = begun.follow(grey, THERE, STILL)
    first = found.scene[0, 0]  # not covered: the plain colour in Lab
    lab = begun.follow(grey, HERE, STILL).scene  # takes the covered place over by a share
    now = first + (lab[40, 50] - first) / BLEND
    square = ((now - first) ** 2).sum() / (3.0 * NOISE**2)
    # Half the Cauchy loss of three channels' squared difference, as registration has it.
    want = min(0.5 * ROBUST**2 * np.log(1.0 + square / ROBUST**2), MOST)
    assert_allclose(differs(found, THERE), want, rtol=1e-3)
    assert (want == MOST) == (by > 100.0)


def test_a_common_change_of_light_makes_no_difference(begun, image):
    everywhere = (0.0, 0.0, WIDTH - 1.0, HEIGHT - 1.0)
    pictures = [covered(image, (THERE[0], THERE[1], 109.0, THERE[3]), 40)]
    pictures += [covered(pictures[0], everywhere, by) for by in (25, -25)]
    dim, bright, dark = (differs(begun.follow(picture, THERE, STILL), THERE) for picture in pictures)
    # Grey levels are whole, and Lab's lightness is not quite theirs.
    assert_allclose(bright, dim, atol=0.35)
    assert_allclose(dark, dim, atol=0.35)
    assert np.abs(bright - dim).mean() < 0.1
    alone = first_backdrop(image, HERE, UNIT)
    lit = covered(image, THERE, 25)  # the figure's place alone in another light
    assert differs(alone.follow(lit, THERE, STILL), THERE).mean() > 3.0 * np.abs(bright - dim).mean()


def test_the_scene_is_taken_over_by_a_share_a_frame_and_not_from_under_the_figure(begun, image):
    new = covered(image, (0.0, 0.0, WIDTH - 1.0, HEIGHT - 1.0), 30)
    whole = first_backdrop(new, HERE, UNIT).scene
    once = begun.follow(new, THERE, STILL)
    step = begun.scenery.step
    place = tuple(int(side) // step for side in THERE)
    under = np.zeros_like(begun.known)
    under[place[1] : place[3] + 1, place[0] : place[2] + 1] = True
    assert_array_equal(once.scene[under], begun.scene[under])
    seen = begun.known & ~under
    assert_allclose(once.scene[seen], (begun.scene + BLEND * (whole - begun.scene))[seen], atol=1e-3)
    fresh = ~begun.known & ~under
    assert_allclose(once.scene[fresh], whole[fresh], atol=1e-3)
    assert once.known[~under].all()


@pytest.mark.parametrize("shift", [(8, 4), (-6, 10)])
def test_the_scene_moves_with_the_camera(shift):
    image, moved = (scene(np.random.default_rng(20), by) for by in ((0, 0), shift))
    begun = first_backdrop(image, HERE, UNIT)
    x0, y0, x1, y1 = THERE
    box = (x0 + shift[0], y0 + shift[1], x1 + shift[0], y1 + shift[1])
    followed = begun.follow(moved, box, np.array(shift, dtype=float))
    assert differs(followed, box).max() < 0.1
    assert differs(begun.follow(moved, box, STILL), box).mean() > 0.5
    # Where the figure stood goes along, and what has come into the picture was not known.
    step = begun.scenery.step
    by = tuple(n // step for n in shift)
    here = np.argwhere(~begun.known) + by[::-1]
    still_unknown = begun.follow(moved, (0.0, 0.0, WIDTH, HEIGHT), np.array(shift, dtype=float))
    assert not still_unknown.known[tuple(here.T)].any()
    new = np.indices(begun.known.shape)[::-1]
    w, h = begun.known.shape[::-1]
    came = (new[0] - by[0] < 0) | (new[0] - by[0] >= w) | (new[1] - by[1] < 0) | (new[1] - by[1] >= h)
    assert came.any()
    assert not still_unknown.known[came].any()
    assert still_unknown.known.sum() == (~came).sum() - len(here)


def test_a_camera_that_comes_back_finds_the_scene_where_it_was(begun, image):
    rng = np.random.default_rng(20)
    away = begun.follow(scene(rng, (10, 0)), HERE, np.array([10.0, 0.0]))
    back = away.follow(image, THERE, STILL)
    assert back.place == (0, 0)
    assert differs(back, THERE).max() < 0.1


@pytest.mark.parametrize(
    "box", [(-90.0, 0.0, -5.0, 50.0), (200.0, 0.0, 300.0, 50.0), (0.0, 500.0, 50.0, 600.0)]
)
def test_a_box_out_of_the_picture_asks_nothing_and_covers_nothing(box, image, begun):
    assert first_backdrop(image, box, UNIT).known.all()
    found = begun.follow(image, box, STILL)
    assert (found.scenery.differs == UNKNOWN).all()
    assert found.known.all()


def test_where_nothing_at_all_is_known_every_place_is_unknown(image):
    everywhere = (-10.0, -10.0, 900.0, 900.0)
    found = first_backdrop(image, everywhere, UNIT).follow(image, everywhere, STILL)
    assert not found.known.any()
    assert (found.scenery.differs == UNKNOWN).all()


@pytest.mark.parametrize("size", [(120, 160), (121, 163), (119, 97)])
def test_every_pixel_of_a_picture_has_its_place(size, rng):
    picture = rng.integers(0, 256, (*size, 3)).astype(np.uint8)
    for unit in (40.0, 100.0, 170.0):
        scenery = first_backdrop(picture, HERE, unit).scenery
        rows, columns = (-(-n // scenery.step) for n in size)
        assert scenery.differs.shape == (rows, columns)
    assert UNSEEN.differs[max(size) // UNSEEN.step, 0] == UNKNOWN


def test_a_pixel_is_plain_where_the_frame_is_known_to_show_the_scene(begun, image):
    left, right = (*THERE[:2], 109.0, THERE[3]), np.array([[120.0, 60.0]])
    found = begun.follow(covered(image, left, by=80), THERE, STILL).scenery
    inner, beside = np.array([[100.0, 60.0], [105.0, 70.0]]), np.array([[70.0, 10.0], [45.0, 80.0]])
    # Of those beside one is out of the box, where nothing is asked, and one was covered from the start.
    pixels = np.concatenate([inner, right, beside])
    assert_array_equal(found.plain(pixels), [False, False, True, False, False])
    assert_array_equal(UNSEEN.plain(pixels), False)


@pytest.mark.parametrize(("value", "plain"), [(0.0, True), (0.19, True), (0.21, False), (1.0, False)])
def test_what_hardly_differs_is_plain_and_the_unknown_is_not(value, plain):
    scenery, pixel = Scenery(np.full((4, 6), value, np.float32), 3), np.array([[4.0, 5.0]])
    assert scenery.plain(pixel) == [plain]


@pytest.mark.parametrize("step", [1, 3])
def test_a_pixel_belongs_to_the_place_that_covers_it(step):
    differs = np.full((4, 6), MOST, np.float32)
    differs[1, 2] = 0.0
    scenery = Scenery(differs, step)
    pixels = np.indices((4 * step, 6 * step))[::-1].reshape(2, -1).T.astype(float)
    want = (pixels[:, 0] // step == 2) & (pixels[:, 1] // step == 1)
    for off in (-0.49, 0.0, 0.49):
        assert_array_equal(scenery.plain(pixels + off), want)
