"""Points by optical flow: what moves with its picture is followed, a hidden link goes on as it did."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.benchmarks.rivals.lucas_kanade import Options, follow
from tests.benchmarks.rivals.scenes import moved_pictures, standing_body, texture, turning

BODY = standing_body()
FRAMES = 8
EVERY_WAY = [Options(joined=joined, fresh=fresh) for joined in (True, False) for fresh in (True, False)]


def carried(motions):
    """(T, J, 2) the joints where the motions take them."""
    return np.stack([cv2.transform(BODY.joints[None], motion)[0] for motion in motions])


@pytest.mark.parametrize("options", EVERY_WAY)
def test_joints_go_with_a_picture_that_shifts_turns_and_grows(rng, options):
    motions = [turning(t, growth=1.01) for t in range(FRAMES)]
    found = np.stack(list(follow(moved_pictures(texture(rng), motions), BODY, options)))
    # Flow finds a point to some hundredths of a pixel a frame.
    assert np.abs(found - carried(motions)).max() < 1.0


def test_the_first_picture_has_the_marks():
    found = list(follow([texture(np.random.default_rng(1))], BODY))
    assert_allclose(found[0], BODY.joints)


def test_a_link_without_points_keeps_its_last_motion(rng):
    motions = [turning(t, degrees=0.0) for t in range(FRAMES)]
    pictures = moved_pictures(texture(rng), motions)
    blank = [np.full_like(picture, 127) for picture in pictures[4:]]
    found = np.stack(list(follow(pictures[:4] + blank, BODY)))
    assert np.abs(found - carried(motions)).max() < 1.0


def test_what_does_not_find_its_way_home_moves_nothing(rng):
    motions = [turning(t, degrees=0.0) for t in range(FRAMES)]
    pictures = moved_pictures(texture(rng), motions)
    others = [texture(rng) for _ in pictures[4:]]
    found = np.stack(list(follow(pictures[:4] + others, BODY, Options(home=1e-4))))
    assert np.abs(found - carried(motions)).max() < 1.0


def test_links_without_corners_have_points_on_a_grid(rng):
    motions = [turning(t) for t in range(FRAMES)]
    pictures = moved_pictures(texture(rng, size=12.0), motions)
    found = np.stack(list(follow(pictures, BODY, Options(window=0.4))))
    # Gradients this gentle leave a fifth of a pixel a frame.
    assert np.abs(found - carried(motions)).max() < 2.0


def test_a_joint_between_a_link_that_moves_and_one_that_rests_goes_half_the_way(rng):
    neck, head_top = BODY.names.index("neck"), BODY.names.index("head_top")
    picture = texture(rng)
    torso, head = BODY.masks(BODY.joints, picture.shape[:2])[:2]
    resting = np.where(torso[..., None] > 0, picture, np.uint8(127))
    pictures = []
    for t in range(5):
        shift = np.float32([[1, 0, 2 * t], [0, 1, 0]])
        there, seen = (cv2.warpAffine(part, shift, picture.shape[1::-1]) for part in (head, picture))
        pictures.append(np.where(there[..., None] > 0, seen, resting))
    away = list(follow(pictures, BODY, Options(joined=False)))[-1] - BODY.joints
    # A window at the seam sees both parts, which costs the head up to a pixel.
    assert_allclose(away[head_top], (8.0, 0.0), atol=1.0)
    assert_allclose(away[neck], (4.0, 0.0), atol=1.0)
    assert_allclose(np.delete(away, (neck, head_top), axis=0), 0.0, atol=0.5)


def test_two_runs_agree(rng):
    pictures = moved_pictures(texture(rng), [turning(t) for t in range(4)])
    noisy = [cv2.add(picture, rng.integers(0, 60, picture.shape, dtype=np.uint8)) for picture in pictures]
    loose = replace(Options(), home=0.1)
    assert_allclose(np.stack(list(follow(noisy, BODY, loose))), np.stack(list(follow(noisy, BODY, loose))))
