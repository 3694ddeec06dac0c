"""Films made of others do what their names say, and marks stay on their pictures."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.benchmarks.evaluation.disturbances import Film
from tests.benchmarks.evaluation.films import (
    FILMS,
    against_light,
    backwards,
    between,
    doubled,
    hazy,
    panned,
    slowed,
)
from tracker.tables.keypoints import Mark

SPOT = (40, 30)


def picture(x, y):
    """A smooth spot on grey."""
    rows, columns = np.mgrid[:60, :120]
    spot = 120.0 * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / 60.0)
    return np.repeat(np.rint(60.0 + spot)[..., None], 3, axis=-1).astype(np.uint8)


@pytest.fixture
def film():
    """A spot with its mark that goes right by two pixels a frame."""
    places = [(20.0 + 2.0 * t, 30.0) for t in range(31)]
    marks = {t: {"hip": Mark(*places[t])} for t in (0, 10, 15, 30)}
    return Film([picture(*place) for place in places], 25.0, marks)


def brightest(image):
    row, column = np.unravel_index(image[..., 0].argmax(), image.shape[:2])
    return column, row


@pytest.mark.parametrize("name", FILMS)
def test_marks_stay_on_their_pictures(film, name):
    made = FILMS[name](film)
    assert made.fps == film.fps
    assert min(made.marks) == 0
    for frame, row in made.marks.items():
        assert_allclose(brightest(made.images[frame]), (row["hip"].x, row["hip"].y), atol=1)


def test_dark_tones_are_crushed_and_bright_ones_stay(film):
    levels = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(3, axis=2)
    crushed = against_light(Film([levels], 25.0, {})).images[0][..., 0].ravel()
    assert_allclose(crushed, 255.0 * (np.arange(256) / 255.0) ** 2.4, atol=0.51)


def test_in_haze_a_quarter_of_the_contrast_is_left(film):
    for before, after in zip(film.images, hazy(film).images, strict=True):
        assert after.std() == pytest.approx(0.25 * before.std(), rel=0.05)


def test_backwards_is_the_last_frame_first(film):
    made = backwards(film)
    assert_array_equal(made.images, film.images[::-1])
    assert sorted(made.marks) == [0, 15, 20, 30]


def test_at_half_speed_every_frame_is_there_and_one_between_each_two(film):
    made = slowed(film)
    assert_array_equal(made.images[::2], film.images)
    places = [brightest(image)[0] for image in made.images[1::2]]
    assert_allclose(places, 21.0 + 2.0 * np.arange(30), atol=1)


def test_between_two_pictures_a_spot_is_half_way_and_one(film):
    middle = between(picture(40.0, 30.0), picture(48.0, 30.0))
    assert_allclose(middle.astype(float), picture(44.0, 30.0), atol=8)


def test_at_double_speed_every_second_frame_is_gone(film):
    made = doubled(film)
    assert_array_equal(made.images, film.images[::2])
    assert sorted(made.marks) == [0, 5, 15]


def test_a_camera_that_goes_along_keeps_who_it_follows_in_the_middle(film):
    made = panned(film)
    assert made.images[0].shape == (60, 74, 3)
    # Before and after, it has come to the picture's edge.
    assert made.marks[10]["hip"].x == pytest.approx(37.0, abs=3.0)
    assert made.marks[15]["hip"].x == pytest.approx(37.0, abs=3.0)
