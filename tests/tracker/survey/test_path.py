import numpy as np
import pytest

from tests.tracker.outline.films import SIZE, a_walk, film, moved
from tracker.survey.path import first_camera

CAMERAS = {
    "pan": (1.5, -0.4, 0.0, 0.0),
    "roll": (0.0, 0.0, 0.004, 0.0),
    "zoom": (0.0, 0.0, 0.0, 0.005),
    "all": (0.6, 0.2, -0.002, -0.003),
}
FRAMES = 12
CORNERS = np.array([[0.0, 0.0], [SIZE[0], 0.0], [0.0, SIZE[1]], SIZE])


def path(images):
    """(T, 3, 3) places and (T,) whether they are sure."""
    cameras = [first_camera(images[0])]
    for image in images[1:]:
        cameras.append(cameras[-1].follow(image))
    return np.stack([each.place for each in cameras]), np.array([each.sure for each in cameras])


def off(seen, places):
    """How far any frame's corner is put from its true place, pixels."""
    away = moved(places, CORNERS) - moved(seen.places, CORNERS)
    return np.hypot(away[..., 0], away[..., 1]).max()


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_cameras_path_is_found_within_half_a_pixel_whoever_walks_through(camera, rng):
    seen = film(rng, frames=FRAMES, camera=CAMERAS[camera])
    places, sure = path(seen.images)
    assert off(seen, places) < 0.5
    assert sure.all()


def test_turn_and_size_are_found_as_well_when_few_of_a_key_frames_corners_are_left(rng):
    # Zoomed in by a fifth, fewer than ENOUGH of the first frame's corners agree.
    seen = film(rng, frames=22, camera=(0.0, 0.0, 0.0, -0.01))
    assert off(seen, path(seen.images)[0]) < 0.5


def test_a_still_cameras_path_is_exactly_the_identity_whoever_walks_through():
    places, sure = path(a_walk().images)
    np.testing.assert_array_equal(places, np.tile(np.eye(3), (len(places), 1, 1)))
    assert sure.all()


def test_where_nothing_has_corners_the_camera_stays_where_it_was_and_is_not_sure(rng):
    seen = film(rng, frames=4, camera=CAMERAS["pan"])
    blank = np.full_like(seen.images[:1], 120)
    places, sure = path(np.concatenate([seen.images, blank]))
    np.testing.assert_array_equal(places[-1], places[-2])
    assert sure.tolist() == [True] * 4 + [False]
