"""The scaled prismatic model: points against a tree walked anew, Jacobians against differences, layers."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kinematics.spm import View, angle_gradients, covering, joint_jacobian, joints, motions, skeleton, surface
from tests.kinematics.figures import FOOTLESS, HORSE, WALKER, Puppet, every_figure, random_pose, upright
from tests.oracles import central_difference

# Coordinates below 10 leg lengths: rounding over step is 10 * 2e-16 / 1e-6 = 2e-9, truncation less still.
DIFFERENCE = {"rtol": 0.0, "atol": 1e-8}


def random_points(figure, rng, P=60):
    """Points on all links, some beyond their ends and outlines, as a template's rim is."""
    link = np.concatenate([np.arange(len(figure.links)), rng.integers(len(figure.links), size=P)])
    return link, rng.uniform(-0.2, 1.2, size=len(link)), rng.uniform(-0.3, 0.3, size=len(link))


@every_figure
def test_joints_lie_where_the_tree_walked_anew_puts_them(figure, rng):
    for _ in range(20):
        q = random_pose(figure, rng)
        want = Puppet(figure, q).joints()
        assert figure.joints == tuple(want)
        assert_allclose(joints(figure, q), list(want.values()), atol=1e-13)


@every_figure
def test_surface_points_lie_where_the_tree_walked_anew_puts_them(figure, rng):
    q, (link, along, across) = random_pose(figure, rng), random_points(figure, rng)
    puppet = Puppet(figure, q)
    want = [puppet.point(figure.links[i], u, v) for i, u, v in zip(link, along, across, strict=True)]
    assert_allclose(surface(skeleton(figure, q), link, along, across), want, atol=1e-13)


@every_figure
def test_angle_gradients_are_the_derivative_of_angles_measured_between_joints(figure, rng):
    links = {link.name: link for link in figure.links}

    def measured(places):
        """Each link's angle by the places (1 + L, 2) of joints, 0 where it does not turn."""
        tips = dict(zip(links, places[1:], strict=True))

        def start(link):
            if link.parent is None:
                return places[0]
            parent = links[link.parent]
            return start(parent) + link.at * (tips[parent.name] - start(parent))

        def heading(link):
            ahead, up = tips[link.name] - start(link)
            return math.atan2(up, ahead)

        relative = [
            heading(link) - link.rest - (heading(links[link.parent]) if link.parent else 0.0)
            for link in figure.links
        ]
        turns = [link.sense * (link.freedom is not None) for link in figure.links]
        return np.multiply(turns, relative)

    q = random_pose(figure, rng, size=0.1)
    places = joints(figure, q)
    angles = [q[figure.index(link.freedom)] if link.freedom else 0.0 for link in figure.links]
    assert_allclose(np.exp(1j * (measured(places) - angles)), 1.0, atol=1e-12)
    want = central_difference(measured, places, 1e-6).reshape(len(links), *places.shape)
    assert_allclose(angle_gradients(figure, q), want, rtol=0.0, atol=1e-7)
    assert_allclose(angle_gradients(figure, np.stack([q, q]))[1], want, rtol=0.0, atol=1e-7)


@every_figure
def test_the_joint_jacobian_is_the_derivative_of_the_forward_map(figure, rng):
    for _ in range(10):
        q = random_pose(figure, rng)
        want = central_difference(lambda q: list(Puppet(figure, q).joints().values()), q, step=1e-6)
        assert_allclose(joint_jacobian(figure, q), want, **DIFFERENCE)


@every_figure
def test_motions_are_the_one_way_to_move_each_link_that_its_differenced_points_allow(figure, rng):
    link, along, across = random_points(figure, rng, P=20 * len(figure.links))
    q = random_pose(figure, rng)
    bones = skeleton(figure, q)
    moved = central_difference(lambda q: surface(skeleton(figure, q), link, along, across), q, step=1e-6)
    found = motions(figure, bones)
    for i in range(len(figure.links)):
        own = link == i
        d, n = bones.direction[i], bones.normal[i]
        u, v = (x[:, None] for x in (along[own] * bones.length[i], across[own] * bones.size))
        one = np.ones_like(u)
        ways = np.stack([one * d, one * n, u * d, u * n - v * d, u * d + v * n], axis=-1)
        # Ten points and more tell all five ways apart, so that there is one answer.
        want, _, rank, _ = np.linalg.lstsq(ways.reshape(-1, 5), moved[own].reshape(-1, len(q)))
        assert rank == 5
        # Points lie within 0.3 of a link: ten times what differencing leaves.
        assert_allclose(found[i], want, rtol=0.0, atol=1e-7)


@every_figure
def test_poses_side_by_side_are_what_each_is_alone(figure, rng):
    points = random_points(figure, rng)
    q = np.array([[random_pose(figure, rng) for _ in range(3)] for _ in range(2)])

    def everything(q):
        bones = skeleton(figure, q)
        return {name: getattr(bones, name) for name in ("start", "direction", "length", "size")} | {
            "joints": joints(figure, q),
            "surface": surface(bones, *points),
            "motions": motions(figure, bones),
            "joint_jacobian": joint_jacobian(figure, q),
        }

    together = everything(q)
    for at in np.ndindex(q.shape[:-1]):
        for name, value in everything(q[at]).items():
            assert together[name][at].shape == np.shape(value)
            assert_allclose(together[name][at], value, rtol=0.0, atol=1e-13, err_msg=name)


def test_a_link_seen_end_on_leaves_its_angle_free_and_nothing_infinite(rng):
    q = random_pose(WALKER, rng)
    q[WALKER.index("stretch_shank_near")] = -40.0
    shank, knee = WALKER.link_of("near_ankle"), WALKER.index("knee_near")
    J = joint_jacobian(WALKER, q)
    assert np.isfinite(J).all()
    # A shank of 0.5 exp(-40) = 2e-18 leg lengths moves its tip by no more than that.
    assert_allclose(J[1 + shank][:, [knee, WALKER.index("stretch_shank_near")]], 0.0, atol=1e-15)
    assert_allclose(J, central_difference(lambda q: joints(WALKER, q), q, step=1e-6), **DIFFERENCE)
    angles = [WALKER.index(name) for name in ("hip_near", "knee_near")]
    foot = J[1 + shank][:, angles]
    assert np.linalg.matrix_rank(foot.T @ foot) == 1


def test_at_rest_the_walker_stands_and_positive_angles_go_forward():
    def at(**values):
        return dict(zip(WALKER.joints, joints(WALKER, upright(WALKER, **values)), strict=True))

    standing = at()
    assert_allclose(standing["near_ankle"], [0.0, -1.0], atol=1e-12)
    assert_allclose(standing["head_top"], [0.0, 0.57 + 0.34], atol=1e-12)
    assert at(torso=0.3)["neck"][0] > 0.1
    assert at(neck=0.3)["head_top"][0] > 0.05
    assert at(hip_near=0.3)["near_knee"][0] > 0.1
    assert at(knee_near=0.3)["near_ankle"][0] < -0.1
    # The head's lean is the torso's plus its own; a bent knee leaves the shank behind the thigh.
    assert_allclose(at(torso=0.3, neck=-0.3)["head_top"] - at(torso=0.3)["neck"], [0.0, 0.34], atol=1e-12)
    shank = at(hip_far=0.4, knee_far=0.4)["far_ankle"] - at(hip_far=0.4)["far_knee"]
    assert_allclose(shank, [0.0, -0.49], atol=1e-12)


def covered(figure, q, name, along, across, margin=0.0):
    """Whether one point of a link is covered."""
    link = np.array([[part.name for part in figure.links].index(name)])
    bones = skeleton(figure, q)
    points = surface(bones, link, np.array([along]), np.array([across]))
    return bool(covering(figure, bones, points, link, margin)[0])


def test_the_near_leg_covers_the_far_leg_where_they_cross_and_nowhere_else():
    crossing = upright(WALKER, hip_near=0.4, hip_far=-0.4)
    assert covered(WALKER, crossing, "thigh_far", 0.1, 0.0)
    assert not covered(WALKER, crossing, "thigh_far", 0.9, 0.0)
    assert not covered(WALKER, crossing, "thigh_near", 0.1, 0.0)
    together = upright(WALKER)
    assert covered(WALKER, together, "shank_far", 0.5, 0.0)
    assert not covered(WALKER, together, "shank_near", 0.5, 0.0)


def test_links_of_one_layer_never_cover_each_other():
    folded = upright(WALKER, hip_near=np.pi / 2.0, knee_near=np.pi, torso=1.4, neck=np.pi)
    for name in ("thigh_near", "shank_near"):
        assert not covered(WALKER, folded, name, 0.5, 0.0)
    assert not covered(HORSE, upright(HORSE), "arm_near", 0.5, 0.0)
    # The head folded back upon the torso, both legs out of the way.
    away = upright(WALKER, neck=np.pi, hip_near=-1.5, hip_far=-1.5)
    assert not covered(WALKER, away, "head", 0.5, 0.0)
    assert not covered(WALKER, away, "torso", 0.7, 0.0)


@pytest.mark.parametrize("size", [1.0, 1.6])
def test_a_link_covers_as_far_as_its_tapered_outline_grown_by_scale_and_margin(size):
    bare = FOOTLESS  # a near foot covers the ankle as well
    q = upright(bare, scale=np.log(size))
    # A far shank that hangs behind the near one, both straight down: width 0.17 tapering to 0.7 of that.
    for along in (0.1, 0.5, 0.9):
        half = 0.5 * 0.17 * (1.0 - 0.3 * along)
        for side in (-1.0, 1.0):
            assert covered(bare, q, "shank_far", along, side * (half - 1e-6))
            assert not covered(bare, q, "shank_far", along, side * (half + 1e-6))
            # Across is before the common scale, the margin after it.
            assert covered(bare, q, "shank_far", along, side * (half + 0.04 / size - 1e-6), margin=0.04)
            assert not covered(bare, q, "shank_far", along, side * (half + 0.04 / size + 1e-6), margin=0.04)
    end = 0.49 * size
    assert covered(bare, q, "shank_far", 1.0 - 1e-6, 0.0)
    assert not covered(bare, q, "shank_far", 1.0 + 1e-6, 0.0)
    assert covered(bare, q, "shank_far", 1.0 + 0.04 / end - 1e-6, 0.0, margin=0.04)
    assert not covered(bare, q, "shank_far", 1.0 + 0.04 / end + 1e-6, 0.0, margin=0.04)


def test_a_link_covers_from_where_it_starts():
    # The far thigh straight up in front of the torso's edge, the near one out of the way behind.
    q = upright(WALKER, hip_far=np.pi, hip_near=-1.5)
    edge, just = -0.14, 1e-6 / 0.51
    assert covered(WALKER, q, "thigh_far", just, edge)
    assert not covered(WALKER, q, "thigh_far", -just, edge)
    assert covered(WALKER, q, "thigh_far", -0.04 / 0.51 + just, edge, margin=0.04)
    assert not covered(WALKER, q, "thigh_far", -0.04 / 0.51 - just, edge, margin=0.04)


@pytest.mark.parametrize("facing", [1, -1])
def test_a_view_there_and_back_is_the_identity(facing, rng):
    view = View(origin=(320.0, 200.0), unit=95.0, facing=facing)
    points = rng.normal(size=(3, 5, 2))
    # Pixels near 500 round by 6e-14, or 1e-15 leg lengths.
    assert_allclose(view.to_body(view.to_pixels(points)), points, rtol=0, atol=1e-14)


def test_a_view_turns_y_down_and_mirrors_who_faces_left(rng):
    right, left = (View(origin=(320.0, 200.0), unit=50.0, facing=facing) for facing in (1, -1))
    assert_allclose(right.to_pixels(np.array([1.0, 2.0])), [370.0, 100.0])
    assert_allclose(left.to_pixels(np.array([1.0, 2.0])), [270.0, 100.0])
    assert (right.side, left.side) == ("right", "left")
    points = rng.normal(size=(9, 2))
    there, mirrored = right.to_pixels(points), left.to_pixels(points)
    assert_allclose(there[:, 0] - 320.0, 320.0 - mirrored[:, 0], atol=1e-12)
    assert_allclose(there[:, 1], mirrored[:, 1], rtol=0)


@pytest.mark.parametrize("facing", [1, -1])
def test_a_moved_view_shows_everything_as_far_right_and_down_and_as_much_larger(facing, rng):
    view = View(origin=(320.0, 200.0), unit=50.0, facing=facing)
    points = rng.normal(size=(9, 2))
    there = view.moved(np.array([3.5, -2.0, 1.2])).to_pixels(points)
    assert_allclose(there - (323.5, 198.0), 1.2 * (view.to_pixels(points) - (320.0, 200.0)), atol=1e-12)


def test_a_view_of_no_size_or_no_side_is_refused():
    with pytest.raises(ValueError, match=r"facing must be 1 \(right\) or -1 \(left\); got 0"):
        View(origin=(0.0, 0.0), unit=1.0, facing=0)
    for unit in (0.0, -3.0, float("nan")):
        with pytest.raises(ValueError, match="a leg length must be above 0 pixels"):
            View(origin=(0.0, 0.0), unit=unit, facing=1)
