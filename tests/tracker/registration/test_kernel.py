"""Templates laid on a picture: against a slow twin, what is read and hidden, and the light of links."""

import os
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from kinematics.spm import View, joints, skeleton, surface
from tests.kinematics.figures import HORSE, WALKER, random_pose, upright
from tests.tracker.processes import printed_by
from tests.tracker.registration.kernel_twin import (
    HEIGHT,
    PLAIN,
    ROBUST,
    VIEW,
    WIDTH,
    check,
    laid,
    link_of,
    noise_picture,
    noise_scenery,
    scattered,
)


@pytest.mark.parametrize("facing", [1, -1], ids=["right", "left"])
@pytest.mark.parametrize("noise", [ROBUST, PLAIN], ids=["robust", "plain"])
@pytest.mark.parametrize("figure", [WALKER, HORSE], ids=lambda figure: figure.name)
def test_what_is_laid_is_what_a_walk_from_point_to_point_finds(figure, noise, facing, rng):
    points, planes = scattered(figure, rng), noise_picture(rng)
    # A common light this far off is kept to on some links and channels, and come near to on others.
    points = points._replace(light=np.array([-30.0, 18.0, 23.0]))
    poses = np.array([random_pose(figure, rng, size=0.1) for _ in range(6)])
    poses[4, 0] += 1.4 - joints(figure, poses[4])[:, 0].mean()  # its middle on the picture's edge
    view = replace(VIEW, facing=facing)
    found = check(figure, poses, points, planes, noise, view, noise_scenery(rng))
    assert 0.2 < found.inside[4].mean() < 0.9
    hidden = found.inside & points.known & (found.match == 0)
    assert hidden.any() == noise.layered
    followed = np.abs(found.offset - points.light) < 0.999 * noise.light
    assert 0.2 < followed.mean() < 0.8 or not noise.layered


def test_what_matches_nothing_at_all_costs_no_more_than_the_scene_that_may_cover_it(rng):
    points, planes, behind = scattered(WALKER, rng), noise_picture(rng), noise_scenery(rng)
    noise = ROBUST._replace(variance=1e-3, scale=1e6)
    found = check(WALKER, upright(WALKER)[None], points, planes, noise, behind=behind)
    assert np.isfinite(found.cost).all()


def test_poses_at_once_are_those_one_at_a_time_to_the_last_bit(rng):
    points, planes = scattered(WALKER, rng), noise_picture(rng)
    poses = np.array([random_pose(WALKER, rng, size=0.2) for _ in range(5)])
    poses[2, :2] += 50.0
    behind = noise_scenery(rng)
    together = laid(WALKER, poses, points, planes, ROBUST, behind=behind)
    for h in range(5):
        alone = laid(WALKER, poses[h : h + 1], points, planes, ROBUST, behind=behind)
        for one, all_of_them in zip(alone, together, strict=True):
            assert_array_equal(one[0], all_of_them[h])


@pytest.mark.parametrize("noise", [ROBUST, PLAIN], ids=["robust", "plain"])
def test_the_outermost_pixels_of_a_picture_are_read_like_all_others(noise, rng):
    points = scattered(WALKER, rng, counts=60)
    for corner in [(0.0, 0.0), (WIDTH - 1.0, 0.0), (0.0, HEIGHT - 1.0), (WIDTH - 1.0, HEIGHT - 1.0)]:
        # A tiny figure at a corner: its links lie within a few pixels.
        view = View(origin=corner, unit=4.0, facing=1)
        poses = np.array([random_pose(WALKER, rng, size=0.3) for _ in range(4)])
        found = check(WALKER, poses, points, noise_picture(rng), noise, view, noise_scenery(rng))
        x, y = np.moveaxis(
            view.to_pixels(surface(skeleton(WALKER, poses), link_of(points), *points[1:3])), -1, 0
        )
        edge = (np.minimum(x, WIDTH - 1 - x) < 1) | (np.minimum(y, HEIGHT - 1 - y) < 1)
        assert (edge & (found.match > 0)).sum() > 10


@pytest.mark.parametrize("shape", [(4, 4), (4, 90), (90, 4)])
def test_a_picture_of_four_pixels_a_side_is_read(shape, rng):
    planes = rng.normal(128.0, 10.0, (*shape, 3)).astype(np.float32)
    view = View(origin=(shape[1] / 2, shape[0] / 2), unit=5.0, facing=-1)
    poses = np.array([random_pose(WALKER, rng, size=0.2) for _ in range(3)])
    found = check(WALKER, poses, scattered(WALKER, rng), planes, ROBUST, view)
    assert found.match.any()


@pytest.mark.parametrize("light", [0.0, -30.0])
def test_links_of_few_points_and_of_none_have_the_common_light(light, rng):
    counts = [0, 1, 5, 6, 7, 40, 0, 2]
    points = scattered(WALKER, rng, counts)
    points = points._replace(known=np.ones(len(points.known), bool), across=0.2 * points.across)
    points = points._replace(along=rng.uniform(0.5, 1.0, len(points.along)))
    # Legs apart and nothing near the hip, so that every point is in sight.
    q = upright(WALKER, hip_near=0.7, hip_far=-0.7)
    points = points._replace(light=np.full(3, light))
    found = check(WALKER, q[None], points, noise_picture(rng) + 9.0, ROBUST)
    many = np.array(counts) >= ROBUST.fewest
    assert_array_equal((found.offset[0] != light).any(axis=1), many)
    assert not found.moments[0, [0, 6]].any()
    assert not found.pull[0, [0, 6]].any()


@pytest.mark.parametrize("visible", [6, 7, 8, 9, 30, 31])
def test_the_light_of_a_link_is_the_upper_middle_of_its_residuals(visible, rng):
    points = scattered(WALKER, rng, [40] + [0] * 7)
    points = points._replace(known=rng.permutation(40) < visible, along=0.9 * rng.random(40))
    # Few colours, so that many residuals tie.
    points = points._replace(colours=rng.integers(120, 124, (40, 3)).astype(np.float32))
    planes = np.full((HEIGHT, WIDTH, 3), 128.0, np.float32)
    found = laid(WALKER, upright(WALKER)[None], points, planes, ROBUST)
    for c in range(3):
        ranked = sorted(128.0 - points.colours[points.known, c])
        assert found.offset[0, 0, c] == ranked[visible // 2]


@pytest.mark.parametrize(
    ("width", "taper", "hip"), [(1.4, 0.1, 1.4), (0.2, 6.0, 0.45)], ids=["at its start", "at its tip"]
)
def test_a_link_hides_what_its_broader_end_reaches(width, taper, hip, rng):
    i, far = WALKER.link_of("near_knee"), WALKER.link_of("far_ankle")
    links = list(WALKER.links)
    links[i] = replace(links[i], width=width, taper=taper)
    figure = replace(WALKER, links=tuple(links))
    points = scattered(figure, rng)
    mine = link_of(points) == far
    # About the far knee, which the thigh covers with its broader end alone.
    points = points._replace(
        along=np.where(mine, 0.02, points.along), across=np.where(mine, 0.0, points.across)
    )
    found = check(figure, upright(figure, hip_far=hip)[None], points, noise_picture(rng), ROBUST)
    assert found.inside[0, mine].all()
    assert not found.match[0, mine].any()


def test_a_figure_wholly_out_of_the_picture_comes_to_nothing(rng):
    found = laid(
        WALKER, upright(WALKER, root_x=90.0)[None], scattered(WALKER, rng), noise_picture(rng), ROBUST
    )
    for part in found:
        assert not part.any()


def test_a_link_that_matches_too_badly_is_out_of_sight_and_pulls_at_nothing(rng):
    points, planes = scattered(WALKER, rng), noise_picture(rng, spread=1.0)
    thigh = link_of(points) == WALKER.link_of("near_knee")
    colours = np.where(thigh[:, None], points.colours + rng.normal(0.0, 150.0, points.colours.shape), 128.0)
    points = points._replace(colours=colours.astype(np.float32))
    found = check(WALKER, upright(WALKER, hip_far=-0.8)[None], points, planes, ROBUST)
    i = WALKER.link_of("near_knee")
    assert not found.match[0, thigh].any()
    assert not found.moments[0, i].any()
    assert found.moments[0, WALKER.link_of("near_ankle")].any()
    assert found.mean[0] > 0.5  # it is still paid for


INTERRUPTED = """
import signal
import numpy as np
from tests.kinematics.figures import WALKER, upright
from tests.tracker.registration.kernel_twin import ROBUST, laid, noise_picture, scattered

def stop(*_):
    raise KeyboardInterrupt

rng, q = np.random.default_rng(0), upright(WALKER)[None]
points, planes = scattered(WALKER, rng, counts=3), noise_picture(rng)
laid(WALKER, q, points, planes, ROBUST)
signal.signal(signal.SIGALRM, stop)
for stops in range(200):
    try:
        signal.setitimer(signal.ITIMER_REAL, rng.uniform(1e-3, 3e-3))
        while True:
            laid(WALKER, q, points, planes, ROBUST)
    except KeyboardInterrupt:
        print(stops)
"""


@pytest.mark.skipif(os.name == "nt", reason="there is no such timer there")
def test_an_interrupt_at_any_moment_is_an_interrupt_and_no_crash():
    assert printed_by(INTERRUPTED) == [str(stops) for stops in range(200)]
