from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from tracker.survey.evidence import (
    ALL_GREY,
    AS_THE_SCENE,
    DARKER,
    DARKEST,
    FEWEST,
    FULL_OF_SHADOWS,
    GREY_CLOTHES,
    HARDLY_SHADOWS,
    MOST,
    NOTHING,
    ORDINARY,
    SOME,
    SOMEBODY,
    TINT,
    UNITS,
    evidence,
)
from tracker.survey.mosaic import DARK, FULL, NOISE, Scene

SHAPE = (40, 50)
GREY = np.array([0.0, 128.0, 128.0])  # Lab without chroma
CHROMA = 6.0  # spread of the chroma of grey clothes


def some_scene(rng, extra=0):
    """A mosaic that is wider and higher than its frames by `extra`."""
    h, w = (n + extra for n in SHAPE)
    lab = rng.uniform((20.0, 110.0, 110.0), (200.0, 145.0, 145.0), (h, w, 3))
    spread = rng.uniform((5.0, 2.5, 2.5), (20.0, 6.0, 6.0), (h, w, 3))
    known = rng.random((h, w)) < 0.9
    return Scene(
        lab.astype(np.float32), spread.astype(np.float32), known, np.array([-3.0, -2.0]) * (extra > 0)
    )


def some_image(scene, rng):
    """A frame of the scene's top left, some of it in shadow, some covered by what differs little or much."""
    lab = scene.lab[: SHAPE[0], : SHAPE[1]] - GREY
    image = lab * rng.choice([1.0, 1.0, 0.75, 0.5, 0.2], SHAPE)[..., None]
    image += rng.normal(size=lab.shape) * scene.spread[: SHAPE[0], : SHAPE[1]]
    image += (rng.random(SHAPE) < 0.2)[..., None] * rng.normal(size=lab.shape) * 30.0
    return np.clip(np.rint(image + GREY), 0, 255).astype(np.uint8)


def written_out(image, scene, light, expected=ORDINARY):
    """R of every pixel, from the densities."""
    x, b, spread = image - GREY, scene.lab + light - GREY, scene.spread.astype(float)
    b[..., 0] = np.maximum(b[..., 0], 1.0)
    unshaded = norm.pdf(x, b, spread).prod(-1)
    # A shadow leaves any share of the light from DARKEST on, smeared by the spread; chroma goes with it, or
    # nearly: the less is left the more another light counts.
    left = np.clip(x[..., :1] / b[..., :1], DARKEST, 1.0)
    off = (x - left * b)[..., 0] / spread[..., 0]
    lightness = np.exp(-0.5 * off**2) / ((1.0 - DARKEST) * b[..., 0] + 2.5 * spread[..., 0])
    tint = 0.0 if scene.colourless else TINT  # without colours no shadow has any either
    shadow = lightness * norm.pdf(x, left * b, np.hypot(spread, tint * (1.0 - left)))[..., 1:].prod(-1)
    # Clothes have any lightness from the film's darkest to its brightest, and any chroma that shows there, or
    # about 0.
    grey, chroma, shaded = expected.grey, CHROMA * scene.contrast, expected.shaded
    if scene.colourless:
        grey, chroma, shaded = ALL_GREY, NOISE[1], min(DARKER * shaded, 1.0)
    shown = np.maximum(50.0 * np.minimum(image[..., 0] / DARK, scene.contrast), FEWEST)
    something = (1.0 - grey) / shown**2 + grey * norm.pdf(x[..., 1:], scale=chroma).prod(-1)
    odds = something / (FULL * scene.contrast) / (unshaded + shaded * shadow + 1e-300)
    found = np.log((1.0 - expected.alike) * np.clip(odds, np.exp(-MOST), np.exp(MOST)) + expected.alike)
    return np.where(scene.known, found, 0.0)


@pytest.mark.parametrize(("colourless", "contrast"), [(False, 1.0), (True, 1.0), (False, 0.3)])
@pytest.mark.parametrize(
    "expected", [ORDINARY, SOMEBODY, GREY_CLOTHES, AS_THE_SCENE, HARDLY_SHADOWS, FULL_OF_SHADOWS]
)
def test_log_odds_are_what_the_densities_say(expected, colourless, contrast, rng):
    scene = replace(some_scene(rng), colourless=colourless, contrast=contrast)
    image = some_image(scene, rng)
    told = (slice(None, None, SOME), slice(None, None, 3))
    light = np.median((image - scene.lab)[told][scene.known[told]], axis=0)
    want = written_out(image, scene, light, expected)
    assert (np.abs(want) < MOST).mean() > 0.1
    found = (evidence(image, np.eye(3), scene, expected).astype(float) - NOTHING) / UNITS
    np.testing.assert_allclose(found, want, atol=1.01 / UNITS)  # rounded twice at most


def test_a_frame_is_compared_with_the_part_of_the_scene_that_the_camera_saw(rng):
    scene = some_scene(rng, extra=10)
    place = np.array([[1.0, 0.0, 4.0], [0.0, 1.0, 3.0], [0.0, 0.0, 1.0]])
    rows, columns = slice(5, 5 + SHAPE[0]), slice(7, 7 + SHAPE[1])
    part = Scene(
        scene.lab[rows, columns], scene.spread[rows, columns], scene.known[rows, columns], np.zeros(2)
    )
    image = some_image(part, rng)
    np.testing.assert_array_equal(evidence(image, place, scene), evidence(image, np.eye(3), part))


def test_beside_a_place_that_no_frame_showed_nothing_is_known(rng):
    scene = some_scene(rng, extra=1)
    scene.known[:], scene.known[:, -1] = True, False
    scene.lab[:, -1] = 255
    place = np.array([[1.0, 0.0, 0.4], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    image = scene.lab[: SHAPE[0], : SHAPE[1]].astype(np.uint8)
    odds = evidence(image, place, replace(scene, corner=np.zeros(2)))
    assert np.all(odds[:, SHAPE[1] - 1] == NOTHING)
    assert np.any(odds[:, SHAPE[1] - 2] != NOTHING)


def test_what_is_lighter_is_something_else_unless_all_of_the_picture_is(rng):
    scene, flat = some_scene(rng), np.array([50.0, 10.0, 10.0])
    lighter = np.rint(scene.lab + flat).astype(np.uint8)
    assert np.all(evidence(lighter, np.eye(3), scene)[scene.known] < NOTHING)
    partly = np.rint(scene.lab).astype(np.uint8)
    partly[:10] = lighter[:10]
    found = evidence(partly, np.eye(3), scene)
    assert (found[:10][scene.known[:10]] > NOTHING).mean() > 0.5
    assert np.all(found[10:][scene.known[10:]] < NOTHING)


@pytest.mark.parametrize(("left", "shadow"), [(0.9, True), (0.5, True), (0.15, False), (1.4, False)])
def test_darker_by_some_is_a_shadow_darker_by_more_or_lighter_is_not(left, shadow):
    scene = Scene(
        np.tile(np.float32([150.0, 140.0, 120.0]), (*SHAPE, 1)),
        np.tile(np.float32([5.0, 2.5, 2.5]), (*SHAPE, 1)),
        np.ones(SHAPE, bool),
        np.zeros(2),
    )
    image = np.rint(scene.lab).astype(np.uint8)
    image[10:14, 10:14] = np.rint(left * np.array([150.0, 12.0, -8.0]) + GREY)
    found = evidence(image, np.eye(3), scene)
    assert np.all((found[10:14, 10:14] < NOTHING) == shadow)
    assert np.all(found[20:] < NOTHING)


@pytest.mark.parametrize("expected", [SOMEBODY, AS_THE_SCENE])
def test_what_looks_like_the_scene_costs_little_where_clothes_may(expected, rng):
    scene = some_scene(rng)
    image = np.rint(scene.lab).astype(np.uint8)
    usual, alike = (evidence(image, np.eye(3), scene, each).astype(float) for each in (ORDINARY, expected))
    known = scene.known
    assert np.median(usual[known] - NOTHING) == -UNITS * MOST
    assert np.median(alike[known] - NOTHING) > UNITS * np.log(max(expected.alike, np.exp(-MOST)))
