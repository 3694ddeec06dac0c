import cv2
import numpy as np
import pytest

from tracker.survey.shot import ALIKE_ONES, PATIENCE, Shot

SIZE = 96, 64  # width and height


def scene(rng, contrast=1.0):
    coarse = 128.0 + contrast * rng.uniform(-120.0, 120.0, (6, 9, 3))
    return cv2.resize(coarse, SIZE, interpolation=cv2.INTER_CUBIC)


def shown(scene, frames, rng):
    """The scene in so many frames, with noise and somebody who walks through."""
    images = np.tile(scene, (frames, 1, 1, 1)) + rng.normal(0.0, 6.0, (frames, *scene.shape))
    for t, image in enumerate(images):
        image[20:55, 2 * t : 2 * t + 8] = 20.0
    return list(np.clip(images, 0, 255).astype(np.uint8))


@pytest.fixture
def one(rng):
    return shown(scene(rng), 20, rng)


@pytest.fixture
def other(rng):
    return shown(scene(rng), PATIENCE + 9, rng)


def read(images):
    """How many pictures are read, and how many of these are of another scene."""
    shot = Shot(images)
    return sum(1 for _ in shot), shot.beyond


def test_a_shot_ends_at_a_cut_or_little_later(one, other):
    shot = Shot(iter([*one, *other]))
    for image, want in zip(shot, [*one, *other[:PATIENCE]], strict=True):
        assert image is want
    assert shot.beyond == PATIENCE


def test_a_film_of_one_scene_is_one_shot(one):
    assert read(one) == (20, 0)


@pytest.mark.parametrize("frames", [1, PATIENCE - 1])
def test_what_hides_the_scene_for_a_moment_is_no_cut(frames, one, other):
    assert read([*one[:10], *other[:frames], *one[10:]]) == (20 + frames, 0)


def test_a_second_may_have_more_pictures(rng, one):
    other = shown(scene(rng), 2 * PATIENCE, rng)
    for frames, beyond in ((2 * PATIENCE - 1, 0), (2 * PATIENCE, 2 * PATIENCE)):
        shot = Shot([*one, *other[:frames], *one], patience=2 * PATIENCE)
        assert sum(1 for _ in shot) == (20 + frames if beyond else 40 + frames)
        assert shot.beyond == beyond


def test_who_passes_close_to_the_camera_makes_no_cut(rng, one):
    film, coat = [*one, *one[::-1], *one], scene(rng)
    for t, image in enumerate(film[20:40]):
        covered = slice(max(0, 16 * t - 200), 16 * t)
        image[:, covered] = coat[:, : image[:, covered].shape[1]]
    assert read(film) == (60, 0)


@pytest.mark.parametrize("frames", [ALIKE_ONES - 1, ALIKE_ONES])
def test_a_film_may_end_soon_after_a_cut(frames, one, other):
    assert read([*one, *other[:frames]]) == (20 + frames, frames if frames == ALIKE_ONES else 0)


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("beyond", [1, ALIKE_ONES, 9])
def test_where_pictures_end_is_known_by_what_comes_after_them(beyond, cut, one, other):
    film = [*one, *other] if cut else [*one, *other[: PATIENCE - 1], *one]
    shot = Shot(iter(film), len(one) + beyond)
    for image, want in zip(shot, film[: len(one) + beyond], strict=True):
        assert image is want
    assert shot.beyond == (beyond if cut else 0)


def test_no_more_is_read_where_the_scene_is_shown(one):
    film = iter(one)
    assert len(list(Shot(film, 12))) == 12
    assert len(list(film)) == len(one) - 12


def test_pictures_that_change_all_the_time_are_no_cut(one, rng):
    passing = [image for _ in range(PATIENCE) for image in shown(scene(rng), 1, rng)]
    assert read([*one, *passing, *one]) == (40 + PATIENCE, 0)
    still = shown(scene(rng), ALIKE_ONES, rng)
    assert read([*one, *passing, *still]) == (20 + PATIENCE + ALIKE_ONES, PATIENCE + ALIKE_ONES)


def test_what_follows_a_fade_is_another_shot(one, other):
    faded = [
        (image * share).astype(np.uint8) for image, share in zip(one, np.linspace(1, 0, 20), strict=True)
    ]
    black = [np.zeros_like(one[0])] * 8
    assert read([*one, *faded, *black, *other]) == (48 + PATIENCE, PATIENCE)
    assert read([*one, *faded, *black, *one]) == (68, 0)


def test_neither_a_pan_nor_another_light_is_a_cut(rng):
    wide = cv2.resize(rng.uniform(0.0, 255.0, (6, 60, 3)), (640, 64), interpolation=cv2.INTER_CUBIC)
    shares = np.linspace(1.0, 0.4, 60)[:, None, None, None]
    panned = shares * np.stack([wide[:, 9 * t : 9 * t + SIZE[0]] for t in range(60)])
    panned = np.clip(panned, 0, 255).astype(np.uint8)
    assert read(list(panned)) == (60, 0)
    assert read(list(panned[[0, 30]].repeat(9, axis=0))) == (18, 9)


def test_a_jump_of_the_camera_is_no_cut(rng):
    cells = [rng.uniform(-60.0, 60.0, (192 // side, 640 // side, 3)) for side in (4, 8, 16, 32)]
    wide = 128.0 + sum(cv2.resize(each, (640, 192), interpolation=cv2.INTER_CUBIC) for each in cells)
    here, there, elsewhere = (
        list(np.clip(wide[None, :, x : x + 320], 0, 255).astype(np.uint8).repeat(10, axis=0))
        for x in (0, 12, 320)
    )
    assert read([*here, *there]) == (20, 0)
    assert read([*here, *elsewhere]) == (20, 10)
