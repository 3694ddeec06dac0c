import cv2
import numpy as np
import pytest

from tracker.picture.light import light_of, relit, relit_lab


@pytest.fixture
def picture(rng):
    """Of any colours; bright enough that a change of light cuts nothing off."""
    return rng.integers(20, 120, (40, 60, 3)).astype(np.uint8)


def lab(image):
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2Lab))


@pytest.mark.parametrize("share", [0.4, 0.97, 1.0, 1.9])
def test_the_share_of_light_is_told_beside_a_figure_and_made_up_for(share, picture, rng):
    known = rng.random(picture.shape[:2]) < 0.9
    now = np.rint(share * picture).astype(np.uint8)
    now[:, :20] = 60  # a third is covered
    found, apart = light_of(lab(now), lab(picture).astype(np.float32), known)
    assert found == pytest.approx(share, rel=0.01)
    assert apart < 0.03
    back = relit(now, found).astype(float)
    # Rounding, at both, and an error of the share of a hundredth.
    assert np.abs(back - picture)[:, 20:].max() <= 0.5 / share + 0.5 + 1.2
    in_lab = relit_lab(lab(now), found).astype(float)
    assert np.abs(in_lab - lab(picture))[:, 20:].mean() < 2.0 / min(share, 1.0)


def test_light_is_measured_where_a_picture_is_not_black(picture, rng):
    picture[:, :35] = rng.integers(0, 4, (40, 35, 3))  # of which rounding leaves no shares
    found, _ = light_of(lab(picture // 2), lab(picture).astype(np.float32), np.ones((40, 60), bool))
    assert found == pytest.approx(0.5, rel=0.02)


def test_where_no_scene_is_known_no_change_of_light_is_told(picture):
    nothing = np.zeros(picture.shape[:2], bool)
    assert light_of(lab(picture), lab(picture).astype(np.float32), nothing) == (1.0, 0.0)


def test_how_far_apart_the_shares_of_places_are_is_told(picture):
    now = picture.copy()
    now[:, 20:40] = np.rint(1.2 * picture[:, 20:40])
    now[:, 40:] = np.rint(1.44 * picture[:, 40:])
    found, apart = light_of(lab(now), lab(picture).astype(np.float32), np.ones((40, 60), bool))
    assert found == pytest.approx(1.2, rel=0.01)
    assert apart == pytest.approx(np.log(1.2), abs=0.02)


def test_light_beyond_the_brightest_stays_the_brightest(picture):
    assert relit(picture, 0.1).max() == 255


@pytest.mark.parametrize("share", [0.75, 1.2])
def test_an_overexposed_sky_hides_no_change_of_light_and_stays_white(share, picture):
    now = np.rint(share * picture).astype(np.uint8)
    picture[:24] = now[:24] = 255
    found, _ = light_of(lab(now), lab(picture).astype(np.float32), np.ones((40, 60), bool))
    assert found == pytest.approx(share, rel=0.01)
    assert (relit(now, found)[:24] == 255).all()
