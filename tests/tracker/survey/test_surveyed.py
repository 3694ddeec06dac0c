import tracemalloc
import weakref

import cv2
import numpy as np
import pytest

from tests.tracker.outline.films import BORDER, SIZE, UNIT, a_walk, film, moved
from tracker.survey import mosaic, surveyed
from tracker.survey.evidence import NOTHING
from tracker.survey.mosaic import DARK, FEWEST, LARGEST, LEAST, NOISE, Scene, apart, scene_of
from tracker.survey.surveyed import survey


@pytest.fixture(scope="module")
def still():
    return a_walk()


@pytest.fixture(scope="module")
def panned():
    return film(np.random.default_rng(20), camera=(-1.3, -0.5, 0.0, 0.0))


def odds(found, images):
    return np.stack([each for each, _, _ in found.seen(images)]).astype(float) - NOTHING


def lab(picture):
    return cv2.cvtColor(np.rint(picture).astype(np.uint8), cv2.COLOR_RGB2Lab).astype(float)


def test_the_scene_is_the_painted_one_without_who_walks_through(panned):
    found = survey(iter(panned.images), 1.0).scene
    x, y = (BORDER + found.corner).astype(int)
    h, w = found.known.shape
    off = np.abs(found.lab - lab(panned.scene)[y : y + h, x : x + w])[found.known]
    assert np.median(off) < 1.5
    assert np.quantile(off, 0.99) < 6.0


def test_a_wide_scene_is_made_in_parts_which_take_little_memory(panned, monkeypatch):
    images = [cv2.cvtColor(image, cv2.COLOR_RGB2Lab) for image in panned.images]
    scenes, peaks = [], []
    for bytes_at_once in (mosaic.AT_ONCE, 2**18):
        monkeypatch.setattr(mosaic, "AT_ONCE", bytes_at_once)
        tracemalloc.start()
        scenes.append(scene_of(images, panned.places))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    for whole, parts in zip(*(vars(scene).values() for scene in scenes), strict=True):
        np.testing.assert_array_equal(whole, parts)
    assert peaks[1] < 0.5 * peaks[0]


def test_log_odds_are_positive_on_the_walker_and_negative_beside(still):
    found = odds(survey(iter(still.images), 1.0), still.images)
    assert (found[still.cover > 0.98] > 0.0).mean() > 0.98
    assert (found[still.cover == 0.0] < 0.0).mean() > 0.999


def test_of_a_place_that_too_few_frames_show_nothing_is_told(panned):
    found = survey(iter(panned.images), 1.0)
    scene = found.scene
    x, y = np.meshgrid(*(np.arange(n) for n in scene.known.shape[::-1]))
    pixels = np.stack([x, y], axis=-1).reshape(-1, 2) + scene.corner
    back = moved(np.linalg.inv(panned.places), pixels)
    number = ((back >= -0.5) & (back <= np.array(SIZE) - 0.5)).all(-1).sum(0).reshape(x.shape)
    assert np.all(scene.known[number >= FEWEST + 2])
    assert not scene.known[number <= FEWEST - 2].any()
    last = odds(found, panned.images)[-1]
    assert np.all(last[:, :3] == 0.0)
    assert (last[:, 100:] != 0.0).mean() > 0.9


def test_a_shadow_that_goes_along_is_not_taken_for_a_figure(still):
    images = still.images.astype(float)
    x, y = np.meshgrid(*(np.arange(n) for n in SIZE))
    away = np.stack([x, y], axis=-1) - (still.hips + np.array([30.0, UNIT]))[:, None, None]
    ground = ((away / (25.0, 6.0)) ** 2).sum(-1) < 1.0
    shadow = ground & (still.cover == 0.0)
    images[shadow] *= 0.6
    images = np.rint(images).astype(np.uint8)
    found = odds(survey(iter(images), 1.0), images)
    assert (found[shadow] > 0.0).mean() < 0.25
    assert (found[still.cover > 0.98] > 0.0).mean() > 0.95


@pytest.mark.parametrize(
    "light",
    [
        lambda t: 0.88 + 0.12 * np.sin(0.3 * t),
        lambda t: 1.0 - 0.5 * np.minimum(t / 20.0, 1.0),
        lambda t: 0.9 - 0.1 * (t % 2),
    ],
    ids=["comes and goes", "halves", "flickers"],
)
@pytest.mark.parametrize("camera", ["still", "panned"])
def test_a_light_that_changes_is_not_taken_for_a_figure(camera, light, request):
    walk = request.getfixturevalue(camera)
    shares = light(np.arange(len(walk.images)))
    images = np.rint(walk.images * shares[:, None, None, None]).astype(np.uint8)
    seen = survey(iter(images), 1.0)
    found = odds(seen, images)
    assert (found[walk.cover == 0.0] > 0.0).mean() < 0.005
    assert (found[walk.cover > 0.98] > 0.0).mean() > 0.95
    told = np.array([share for _, _, share in seen.seen(images)])
    np.testing.assert_allclose(told / told[0], shares / shares[0], atol=0.02)


def test_of_a_picture_that_does_not_show_the_scene_nothing_is_told(still, rng):
    images = np.array(still.images)
    images[20] = cv2.resize(rng.integers(0, 256, (8, 12, 3)).astype(np.uint8), SIZE)
    found = odds(survey(iter(images), 1.0), images)
    assert not found[20].any()
    assert (found[21][still.cover[21] > 0.98] > 0.0).mean() > 0.95


@pytest.mark.parametrize(
    "share", [0.98, np.linspace(0.6, 1.0, SIZE[0])[:, None]], ids=["hardly", "here and there"]
)
def test_a_light_that_does_not_change_as_a_whole_is_left_as_it_is(share, still):
    later = (np.arange(len(still.images)) > 10)[:, None, None, None]
    images = np.rint(np.where(later, share, 1.0) * still.images).astype(np.uint8)
    assert {share for _, _, share in survey(iter(images), 1.0).seen(images)} == {1.0}


def test_small_pictures_change_no_place_and_lie_where_the_films_pixels_do(panned):
    found = survey(iter(panned.images), 2.0)
    assert found.size == (SIZE[0] // 2, SIZE[1] // 2)
    np.testing.assert_allclose(found.places, survey(iter(panned.images), 1.0).places)
    cover = np.stack([cv2.resize(each, found.size, interpolation=cv2.INTER_AREA) for each in panned.cover])
    seen = odds(found, panned.images)
    assert (seen[cover > 0.98] > 0.0).mean() > 0.95
    assert (seen[cover == 0.0] > 0.0).mean() < 0.01
    np.testing.assert_allclose(found.up @ (0.0, 0.0, 1.0), (0.5, 0.5, 1.0))


def test_a_film_is_read_once_and_few_of_its_frames_are_held(monkeypatch, rng):
    counts, made, held = [], [], []

    def frames():
        for _ in range(40):
            image = rng.integers(0, 255, (24, 32, 3)).astype(np.uint8)
            made.append(weakref.ref(image))
            yield image
            del image
            held.append(sum(each() is not None for each in made))

    def counted(views, places):
        counts.append(len(views))
        return scene_of(views, places)

    monkeypatch.setattr(surveyed, "VIEWS", 12)
    monkeypatch.setattr(surveyed, "scene_of", counted)
    assert len(survey(frames(), 1.0).places) == 40
    assert counts == [10]  # every fourth
    assert max(held) <= 2


@pytest.mark.parametrize("views", [60, 12], ids=["all are views", "some are"])
def test_the_last_images_may_be_of_another_scene(views, still, monkeypatch):
    monkeypatch.setattr(surveyed, "VIEWS", views)
    alone = survey(still.images, 1.0)
    found = survey([*still.images, *(255 - still.images[:3])], 1.0, 0, lambda: 3)
    np.testing.assert_array_equal(found.scene.lab, alone.scene.lab)
    for one, other in ((found.places, alone.places), (found.sure, alone.sure), (found.held, alone.held)):
        np.testing.assert_array_equal(one, other)


def test_a_film_is_read_again_only_where_its_small_pictures_are_too_many_to_hold(still, monkeypatch):
    found = survey(iter(still.images), 2.0)
    kept = list(found.seen(iter([])))
    size = kept[0][0].size * 3
    monkeypatch.setattr(surveyed, "HELD", size * len(still.images) - 1)
    read_again = survey(iter(still.images), 2.0)
    assert list(read_again.seen(iter([]))) == []
    again = list(read_again.seen(still.images))
    assert len(kept) == len(again) == len(still.images)
    for one, other in zip(kept, again, strict=True):
        assert all(map(np.array_equal, one, other))


@pytest.mark.parametrize(("told", "made"), [(0, 20), (20, 20), (1000, 11)])
def test_of_a_film_that_is_said_to_be_long_no_picture_is_made_that_would_not_be_held(told, made, monkeypatch):
    really, pictures = surveyed._lab, []

    def counted(image, size):
        pictures.append(image)
        return really(image, size)

    monkeypatch.setattr(surveyed, "_lab", counted)
    monkeypatch.setattr(surveyed, "VIEWS", 6)
    monkeypatch.setattr(surveyed, "HELD", 20 * 24 * 32 * 3)
    images = np.full((20, 24, 32, 3), 90, np.uint8)
    assert len(survey(iter(images), 1.0, told).held) == (20 if told <= 20 else 0)
    assert len(pictures) == made  # the first seven, then every second, at last every fourth, are views


def test_a_scene_is_no_larger_than_its_most_and_what_lies_further_is_unknown():
    images = np.full((30, 10, 20, 3), 90, np.uint8)
    places = np.tile(np.eye(3), (30, 1, 1))
    places[:, 0, 2] = 8.0 * np.arange(30)
    scene = scene_of(images, places)
    assert scene.known.size <= LARGEST * 200
    assert scene.known.shape[1] > 0.8 * LARGEST * 20
    np.testing.assert_array_equal(scene.corner, [0.0, 0.0])


def with_edges(rng, low=0, high=255):
    """25 pictures (20, 30) at 100, at 180 right of an edge, unsteady somewhere, from `low` to `high`."""
    images = np.full((25, 20, 30, 3), 100, np.uint8)
    images[:, :, 20:] = 180
    images[:, 5:10, 3:12, 0] = rng.normal(100.0, 12.0, (25, 5, 9))
    images[5:, 0, 0, 0], images[5:, 0, 3, 0] = low, high  # not in the first pictures
    return np.clip(images, low, high)


def test_the_spread_is_of_what_frames_differ_by_and_grows_along_edges(rng):
    scene = scene_of(with_edges(rng), np.tile(np.eye(3), (25, 1, 1)))
    np.testing.assert_allclose(scene.spread[15, 5], NOISE)
    assert np.median(scene.spread[5:10, 3:12, 0]) == pytest.approx(np.hypot(12.0, NOISE[0]), rel=0.15)
    slope = 40.0  # grey levels a pixel at the edge
    np.testing.assert_allclose(scene.spread[15, 20, 0], np.hypot(NOISE[0], mosaic.SLIP * slope), rtol=1e-4)


@pytest.mark.parametrize(("low", "high", "contrast"), [(0, 255, 1.0), (90, 192, 0.6), (98, 183, 0.5)])
def test_a_film_of_little_contrast_is_not_expected_to_be_noisier_than_it_is_wide(low, high, contrast, rng):
    scene = scene_of(with_edges(rng, low, high), np.tile(np.eye(3), (25, 1, 1)))
    assert scene.contrast == pytest.approx(contrast, abs=0.01)
    np.testing.assert_allclose(scene.spread[15, 5], np.maximum(contrast * NOISE, LEAST), rtol=0.02)


def test_colours_come_together_in_the_dark():
    place = np.zeros((1, 1, 3), np.float32)
    scene = Scene(place, place + 1.0, np.ones((1, 1), bool), np.zeros(2), contrast=0.8)
    np.testing.assert_allclose(
        apart(DARK * np.array([0.0, 0.25, 0.8, 2.0]), scene.contrast), [0.0, 0.25, 0.8, 0.8]
    )
