"""A moving camera: painted scenes shifted by known parts of pixels, with something that walks before them."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.tracker.outline.films import SIZE, film
from tests.tracker.outline.films import moved as carried_to
from tests.tracker.picture.ways import NEAR, sway
from tracker.clip.part import TOLD
from tracker.picture.camera import Camera

NOWHERE = None
CAMERAS = {
    "pan": (1.5, -0.4, 0.0, 0.0),
    "roll": (0.0, 0.0, 0.004, 0.0),
    "zoom": (0.0, 0.0, 0.0, 0.005),
    "all": (0.6, 0.2, -0.002, -0.003),
}
CORNERS = np.array([[0.0, 0.0], [SIZE[0], 0.0], [0.0, SIZE[1]], SIZE])


class Waves:
    """A grey scene made of waves, which has a value at every point; a wall has none that are strong."""

    def __init__(self, rng, *, contrast=10.0, waves=40, wavelengths=(25.0, 160.0)):
        length, turn = rng.uniform(*wavelengths, waves), rng.uniform(0.0, 2.0 * np.pi, waves)
        self.number = 2.0 * np.pi / length * np.stack([np.cos(turn), np.sin(turn)])
        self.phase = rng.uniform(0.0, 2.0 * np.pi, waves)
        self.contrast = contrast

    def picture(self, shift=(0.0, 0.0), size=(640, 480)):
        """(H, W) grey levels of the scene that lies this much further right and down."""
        x, y = (np.arange(n) - d for n, d in zip(size, shift, strict=True))
        across, down = (np.outer(a, k) for a, k in zip((x, y), self.number, strict=True))
        wave = np.exp(1j * (down + self.phase)) @ np.exp(1j * across).T
        return 125.0 + self.contrast * wave.real


def stored(picture, *, noise=0.0, rng=None):
    """(H, W, 3) uint8."""
    if noise > 0.0:
        picture = picture + rng.normal(scale=noise, size=picture.shape)
    return np.repeat(np.clip(np.round(picture), 0, 255).astype(np.uint8)[..., None], 3, axis=-1)


def walker(picture, t, *, x=None, size=(90, 260)):
    """The picture with a chequered figure at frame t, 11 px a frame, and the box around it."""
    left, (width, height) = int(60 + 11 * t if x is None else x), size
    squares = 230.0 * ((np.arange(height)[:, None] // 12 + np.arange(width) // 12) % 2)
    out, top = picture.copy(), 410 - height
    out[top:410, left : left + width] = squares[:, : out.shape[1] - left]
    return out, (left - 15.0, top - 15.0, left + width + 15.0, 425.0)


def cameras(frames):
    """What is known after each of pictures and boxes in turn."""
    (image, box), *rest = frames
    found = [Camera(image, box)]
    for image, box in rest:
        found.append(found[-1].follow(image, box))
    return found


def shifts(frames):
    """(T, 2) of pictures and boxes in turn."""
    return np.stack([camera.shift for camera in cameras(frames)])


@pytest.fixture(scope="module")
def scene():
    return Waves(np.random.default_rng(4))


@pytest.mark.parametrize("speed", [0.3, 2.0, 14.0], ids="{} px a frame".format)
def test_a_pan_is_measured_to_parts_of_pixels_behind_a_walker(speed, scene, rng):
    truth = sway(40, speed, 40)
    pictures = (walker(scene.picture(shift), t) for t, shift in enumerate(truth))
    found = shifts((stored(picture, noise=3.0, rng=rng), box) for picture, box in pictures)
    moved = np.maximum.accumulate(np.abs(truth).max(1)) > 1.5
    assert np.abs(found - truth)[moved].max() < NEAR
    assert np.abs(found - truth).max() < 1.5


def test_a_long_pan_takes_few_key_frames_and_does_not_lose_its_way(scene):
    truth = np.outer(np.arange(50), (11.7, -0.6))
    found = cameras((stored(scene.picture(shift)), NOWHERE) for shift in truth)
    assert_allclose([camera.shift for camera in found], truth, atol=NEAR)
    # Of the first picture nearly nothing is left at the end.
    assert 2 <= len({id(camera.key) for camera in found}) <= 4


def test_a_scene_seen_through_gaps_in_a_bare_wall_is_enough(scene, rng):
    truth = sway(30, 6.0, 40)
    bare = np.arange(640) // 80 % 2 == 0
    frames = []
    for shift in truth:
        picture = scene.picture(shift)
        picture[:, np.roll(bare, round(shift[0]))] = 150.0
        frames.append((stored(picture, noise=5.0, rng=rng), NOWHERE))
    assert np.abs(shifts(frames) - truth)[3:].max() < 2.0 * NEAR


@pytest.mark.parametrize("noise", [0.0, 10.0])
def test_a_still_camera_reads_exactly_zero_whoever_walks_by(noise, scene, rng):
    still = scene.picture()
    pictures = (walker(still, t) for t in range(30))
    found = shifts((stored(picture, noise=noise, rng=rng), box) for picture, box in pictures)
    assert_array_equal(found, 0.0)


@pytest.mark.parametrize("noise", [0.0, 2.0, 40.0])
def test_a_flat_wall_and_pure_noise_read_exactly_zero(noise, rng):
    wall = np.full((480, 640), 150.0)
    pictures = (walker(wall, t) for t in range(40))
    assert_array_equal(shifts((stored(p, noise=noise, rng=rng), box) for p, box in pictures), 0.0)


def test_a_figure_before_a_flat_wall_is_no_camera_even_where_it_is_not_expected():
    wall = np.full((480, 640), 150.0)
    assert_array_equal(shifts((stored(walker(wall, t)[0]), NOWHERE) for t in range(40)), 0.0)


def test_a_camera_that_goes_with_a_figure_as_large_as_half_the_picture_is_seen_to_move(scene):
    truth = np.outer(np.arange(40), (5.0, 0.0))
    followed = (walker(scene.picture(shift), t, x=130, size=(380, 400)) for t, shift in enumerate(truth))
    assert np.abs(shifts((stored(picture), box) for picture, box in followed) - truth).max() < 2.0 * NEAR


def before_a_plain_wall(marks, rng):
    """The way of a camera that goes along with a figure, and its pictures; the wall has a few small marks."""
    wall = np.full((360, 800), 150.0)
    for left, top in rng.integers(10, (780, 340), (marks, 2)):
        wall[top : top + 8, left : left + 9] = 80.0
    cloth = cv2.GaussianBlur(rng.normal(size=(300, 130)), (0, 0), 3)
    cloth = 110.0 + 30.0 * cloth / cloth.std()
    images = []
    for t in range(40):
        picture = wall[:, 3 * t : 3 * t + 640].copy()
        swung = np.roll(cloth, round(10.0 * np.sin(t / 2.5)), axis=1)
        picture[30:330, 255:385] = np.vstack([cloth[:180], swung[180:]])
        images.append(stored(picture, noise=2.0, rng=rng))
    return np.outer(np.arange(40), (-3.0, 0.0)), images


def test_a_camera_that_goes_with_a_figure_before_a_plain_wall_is_seen_to_move_wherever_the_figure_is(rng):
    truth, images = before_a_plain_wall(100, rng)
    found = shifts((image, NOWHERE) for image in images)
    # A single step of 3 px may be noticed a frame later.
    assert np.abs(found - truth).max() < 3.0 + NEAR


def test_where_the_wall_shows_too_little_the_camera_is_not_sure_unless_the_figure_is_known(rng):
    truth, images = before_a_plain_wall(110, rng)
    images = [np.ascontiguousarray(image[:160]) for image in images]
    assert np.mean([camera.sure for camera in cameras((image, NOWHERE) for image in images)]) < TOLD
    known = cameras((image, (250.0, 25.0, 390.0, 335.0)) for image in images)
    assert np.mean([camera.sure for camera in known]) > 0.9
    assert np.abs(known[-1].shift - truth[-1]).max() < 3.0 + NEAR


def test_a_soft_shadow_on_a_bare_wall_is_no_camera(rng):
    x, y = np.meshgrid(np.arange(640), np.arange(480))
    frames = []
    for t in range(40):
        away = ((x - 100 - 9 * t) / 60.0) ** 2 + ((y - 300) / 160.0) ** 2
        wall = 170.0 - 25.0 * np.exp(-0.5 * away)
        frames.append((stored(wall, noise=3.0, rng=rng), NOWHERE))
    assert_array_equal(shifts(frames), 0.0)


def test_others_who_walk_through_the_scene_do_not_carry_it_along(scene):
    truth = sway(40, 4.0, 40)
    pictures = []
    for t, shift in enumerate(truth):
        one, box = walker(scene.picture(shift), t)
        other, _ = walker(one, t, x=max(540 - 9 * t, 0))
        pictures.append((stored(other), box))
    assert np.abs(shifts(pictures) - truth)[3:].max() < 2.0 * NEAR


def test_a_frame_that_repeats_the_one_before_moves_nothing(scene):
    way = np.repeat(np.arange(12), 2)[:, None] * (6.5, 0.0)
    found = shifts((stored(scene.picture(shift)), NOWHERE) for shift in way)
    assert np.abs(found[1::2] - found[::2]).max() < 0.05
    assert_allclose(found[-1], way[-1], atol=NEAR)


@pytest.mark.parametrize("speed", [0.0, 5.0])
def test_light_that_halves_is_no_motion_and_hides_none(speed, scene):
    truth = sway(30, speed, 40)
    light = np.interp(np.arange(30), (5, 25), (1.0, 0.5))
    found = shifts((stored(a * scene.picture(s)), NOWHERE) for a, s in zip(light, truth, strict=True))
    if speed:
        assert np.abs(found - truth)[2:].max() < 2.0 * NEAR
    else:
        assert_array_equal(found, 0.0)


def test_while_nothing_is_seen_the_shift_stays_and_then_catches_up(scene):
    way = np.arange(20)[:, None] * (4.0, 0.0)
    frames = [(stored(scene.picture(shift)), NOWHERE) for shift in way]
    frames[10:13] = [(np.zeros_like(image), box) for image, box in frames[10:13]]
    found = shifts(frames)
    assert_array_equal(found[10:13], np.broadcast_to(found[9], (3, 2)))
    assert_allclose(found[13:], way[13:], atol=NEAR)


def test_a_cut_to_another_scene_leaves_the_shift_and_goes_on_from_there(scene):
    way = np.arange(10)[:, None] * (3.0, 0.0)
    other = Waves(np.random.default_rng(9))
    found = shifts((stored(view.picture(shift)), NOWHERE) for view in (scene, other) for shift in way)
    assert_array_equal(found[10], found[9])
    assert_allclose(found[-1] - found[10], way[-1], atol=NEAR)


@pytest.mark.parametrize("size", [(160, 120), (333, 251), (270, 480), (1280, 720), (9, 7), (3000, 40)])
def test_pictures_of_any_size_are_measured_in_their_own_pixels(size):
    factor = max(size) / 160
    wide = Waves(np.random.default_rng(1), wavelengths=(6.0 * factor, 40.0 * factor))
    truth = np.outer(np.arange(8), (0.6, -0.4)) * factor
    found = shifts((stored(wide.picture(shift, size)), NOWHERE) for shift in truth)
    if min(size) < 100:  # too few corners to believe
        assert_array_equal(found, 0.0)
    else:
        assert np.abs(found - truth)[1:].max() < 0.15 * factor


def off(seen, places):
    """How far any frame's corner is put from its true place, pixels."""
    away = carried_to(places, CORNERS) - carried_to(seen.places, CORNERS)
    return np.hypot(away[..., 0], away[..., 1]).max()


@pytest.mark.parametrize("camera", CAMERAS)
def test_shift_turn_and_size_are_found_within_half_a_pixel_whoever_walks_through(camera, rng):
    seen = film(rng, frames=12, camera=CAMERAS[camera])
    found = cameras((image, NOWHERE) for image in seen.images)
    assert off(seen, np.stack([each.place for each in found])) < 0.5
    assert all(each.sure for each in found)


def test_turn_and_size_are_found_as_well_when_few_of_a_key_frames_corners_are_left(rng):
    # Zoomed in by a fifth, fewer than ENOUGH of the first frame's corners agree.
    seen = film(rng, frames=22, camera=(0.0, 0.0, 0.0, -0.01))
    found = cameras((image, NOWHERE) for image in seen.images)
    assert off(seen, np.stack([each.place for each in found])) < 0.5


def test_where_nothing_has_corners_the_camera_stays_where_it_was_and_is_not_sure(rng):
    seen = film(rng, frames=4, camera=CAMERAS["pan"])
    blank = np.full_like(seen.images[:1], 120)
    found = cameras((image, NOWHERE) for image in np.concatenate([seen.images, blank]))
    assert_array_equal(found[-1].place, found[-2].place)
    assert [each.sure for each in found] == [True] * 4 + [False]


def test_a_known_place_is_taken_as_it_is_and_gone_on_from(scene):
    way = np.arange(12)[:, None] * (4.0, 1.0)
    image, *rest = (stored(scene.picture(shift)) for shift in way)
    camera, known = Camera(image), np.eye(3)
    for image, shift in zip(rest[:6], way[1:], strict=False):
        known[:2, 2] = -shift
        camera = camera.follow(image, None, known)
        assert_allclose(camera.shift, shift, atol=1e-9)
    for image in rest[6:]:
        camera = camera.follow(image)
    assert_allclose(camera.shift, way[-1], atol=NEAR)
