"""The painter of walkers: clothes, and walkers who are partly beyond the picture's edge."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tracker.scene.body import Painter, compose
from tracker.scene.cloth import Wardrobe
from tracker.scene.film import in_pixels
from tracker.scene.steps import joint_places, random_build, walk

SHAPE = (140, 160)
LEG = 50.0


@pytest.fixture
def stride():
    """Build and one moment of a walk, the feet apart."""
    rng = np.random.default_rng(4)
    build = random_build(rng)
    gait = walk(build, 200, 200.0, rng)
    apart = np.abs(gait.pose[:, 4] - gait.pose[:, 6]).argmax()
    return build, gait.at(np.array([apart]))


@pytest.fixture
def wear():
    return Wardrobe.choose(np.random.default_rng(5))


def painted(stride, wear, hip, shape=SHAPE):
    """The layer (H, W, 4) of a walker whose hip has this x, and its places."""
    build, gait = stride
    places = in_pixels(joint_places(build, gait), LEG, np.zeros(2))
    joints = {name: at[0] - (places["hip"][0, 0] - hip, -0.9 * shape[0]) for name, at in places.items()}
    return compose(Painter(build, wear, LEG, shape).parts(joints, 0.3), shape), joints


@pytest.mark.parametrize("hip", [-30.0, 2.0, 158.0, 190.0, 400.0])
def test_of_a_walker_at_the_edge_as_much_is_painted_as_is_in_the_picture(stride, wear, hip):
    wide, _ = painted(stride, wear, hip + 100.0, (SHAPE[0], 700))
    narrow, _ = painted(stride, wear, hip)
    inside = slice(100, 100 + SHAPE[1])
    # The shade of a part on what lies behind it is blurred over 9 px, mirrored at the edge.
    np.testing.assert_allclose(narrow[..., 3], wide[:, inside, 3], atol=1e-6)
    np.testing.assert_allclose(narrow[:, 9:-9], wide[:, inside][:, 9:-9], atol=1e-3)


def test_looser_trousers_cover_more_and_nothing_less(stride, wear):
    usual, loose = (painted(stride, replace(wear, loose=width), 80.0)[0][..., 3] for width in (1.0, 1.3))
    assert (loose >= usual - 1e-6).all()
    assert loose.sum() > 1.05 * usual.sum()


def test_the_far_leg_is_as_dark_as_its_shade_and_nothing_else_changes(stride, wear):
    dark, joints = painted(stride, wear, 80.0)
    bright, _ = painted(stride, replace(wear, far_shade=(1.0, 1.0, 1.0)), 80.0)
    x, y = np.round(0.5 * (joints["far_knee"] + joints["far_ankle"])).astype(int)
    assert dark[y, x, :3] / bright[y, x, :3] == pytest.approx(wear.far_shade, abs=0.02)
    x, y = np.round(joints["near_knee"]).astype(int)
    assert_array_equal(dark[y, x], bright[y, x])
