"""Templates laid on a picture: which points count, and how many of them are shown."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from kinematics.spm import joints, skeleton, surface
from tests.kinematics.figures import WALKER, upright
from tests.tracker.registration.kernel_twin import (
    HEIGHT,
    NOWHERE,
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


def test_points_out_of_the_picture_or_unknown_or_hidden_count_for_nothing(rng):
    points, planes = scattered(WALKER, rng), noise_picture(rng)
    q = upright(WALKER, root_x=1.3, hip_near=0.2, hip_far=-0.1, torso=0.6)
    behind, noise = noise_scenery(rng), ROBUST._replace(in_sight=np.inf)  # every link is
    before = laid(WALKER, q[None], points, planes, noise, behind=behind)
    idle = before.match[0] == 0
    assert 0.3 < idle.mean() < 0.9
    # How many are known within the outline is what `shown` is a share of.
    of_no_outline = (points.weight < 1.0) | ~points.known
    other = points._replace(
        colours=np.where(idle[:, None], np.float32(1e4), points.colours),
        weight=np.where(idle & of_no_outline, 77.0, points.weight),
    )
    after = laid(WALKER, q[None], other, planes, noise, behind=behind)
    for one, two in zip(before, after, strict=True):
        assert_array_equal(one, two)


def test_a_figure_wholly_out_of_the_picture_comes_to_nothing(rng):
    found = laid(
        WALKER, upright(WALKER, root_x=90.0)[None], scattered(WALKER, rng), noise_picture(rng), ROBUST
    )
    for part in found:
        assert not part.any()


def test_what_lies_behind_is_what_it_is_where_the_visible_points_of_the_outline_fall(rng):
    points, q = scattered(WALKER, rng), upright(WALKER, hip_near=0.5, hip_far=-0.5)
    planes = noise_picture(rng)
    knee = VIEW.to_pixels(joints(WALKER, q))[WALKER.joints.index("near_knee")]
    differs = np.zeros((HEIGHT, WIDTH), np.float32)
    differs[int(knee[1]) :] = 2.0  # legs below the knee alone
    noise = ROBUST._replace(covered=0.0, in_sight=np.inf)  # every link is
    behind = NOWHERE._replace(differs=0.0 * differs, around=differs, step=1)
    plain = laid(WALKER, q[None], points, planes, noise, behind=behind)
    found = laid(WALKER, q[None], points, planes, noise, behind=behind._replace(differs=differs))
    body = surface(skeleton(WALKER, q), link_of(points), points.along, points.across)
    below = np.floor(VIEW.to_pixels(body)[:, 1] + 0.5) >= int(knee[1])
    counted = (found.match[0] > 0) & (points.weight == 1.0)
    assert (counted & below).sum() > 20
    assert plain.cost[0] - found.cost[0] == pytest.approx(2.0 * (counted & below).sum())
    assert found.shown[0] == pytest.approx(counted.sum() / (points.known & (points.weight == 1.0)).sum())


def test_the_share_that_is_shown_falls_as_links_are_hidden_or_leave_the_picture(rng):
    points, planes = scattered(WALKER, rng), noise_picture(rng)
    poses = [upright(WALKER, hip_near=0.7, hip_far=-0.7), upright(WALKER), upright(WALKER, root_x=1.6)]
    apart, together, leaving = laid(WALKER, np.array(poses), points, planes, ROBUST).shown
    assert apart > together + 0.05
    assert together > leaving + 0.2
    # Nothing hides anything.
    assert laid(WALKER, poses[1][None], points, planes, PLAIN).shown[0] == 1.0


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
