"""The compiled chain rule against that of `kinematics.spm`."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.gaussian import Gaussian
from kinematics.spm import joint_jacobian, joints, motions, skeleton
from tests.kinematics.figures import HORSE, WALKER, random_pose
from tracker.registration.chain_rule import (
    Pins,
    Search,
    Tail,
    damped_steps,
    laid_out,
    normal_equations,
    settled,
)


@pytest.fixture(params=[WALKER, HORSE], ids=lambda figure: figure.name)
def figure(request):
    return request.param


@pytest.fixture
def poses(figure, rng):
    return np.array([random_pose(figure, rng, size=0.3) for _ in range(4)])


def test_links_are_laid_out_as_the_scaled_prismatic_model_has_them(figure, poses):
    got, want = laid_out(figure.layout, poses), skeleton(figure, poses)
    for name in ("start", "direction", "length", "size"):
        assert_allclose(getattr(got, name), getattr(want, name), rtol=1e-12, atol=1e-12)


def test_normal_equations_are_those_of_the_links_by_the_chain_rule(figure, poses, rng):
    bones, tree = skeleton(figure, poses), figure.layout
    root, pull = rng.normal(size=(4, len(figure.links), 7, 5)), rng.normal(size=(4, len(figure.links), 5))
    moments, M = np.swapaxes(root, -1, -2) @ root, motions(figure, bones)
    information, gradient = normal_equations(tree, bones, moments, pull)
    assert_allclose(information, np.einsum("hlvd,hlvw,hlwe->hde", M, moments, M), rtol=1e-9, atol=1e-9)
    assert_allclose(gradient, np.einsum("hlwd,hlw->hd", M, pull), rtol=1e-9, atol=1e-9)


def test_joints_pull_by_their_own_jacobian_two_at_one_place_as_well(figure, poses, rng):
    joint = rng.integers(0, 1 + len(figure.links), (3, 6))
    joint[:, 0], joint[:, 1] = 0, joint[:, 2]  # the base, and one joint twice
    places, tail = rng.normal(size=(6, 2)), Tail(freedom=3.0, spread=0.4)
    priors = Gaussian(poses, np.repeat(np.eye(poses.shape[1])[None], len(poses), axis=0))
    told = settled(figure.layout, priors, Pins(joint, places), tail, Search(0, 1e-4, 0.5))
    for w, names in enumerate(joint):
        for h, q in enumerate(poses):
            away = joints(figure, q)[names] - places
            weight = 5.0 / (3.0 + (away**2).sum(1) / 0.16) / 0.16
            J = joint_jacobian(figure, q)[names]
            assert_allclose(told.q[w, h], q, rtol=0.0)
            assert_allclose(told.away[w, h], away, rtol=1e-9, atol=1e-12)
            assert_allclose(
                told.information[w, h], np.einsum("jcd,j,jce->de", J, weight, J), rtol=1e-9, atol=1e-9
            )
            assert_allclose(
                told.gradient[w, h], np.einsum("jcd,j,jc->d", J, weight, away), rtol=1e-9, atol=1e-9
            )


def test_damped_steps_solve_the_damped_system_and_none_goes_too_far(rng):
    root, slope, damping = rng.normal(size=(3, 9, 6)), rng.normal(size=(3, 6)), np.array([0.0, 0.1, 2.0])
    H = np.swapaxes(root, -1, -2) @ root
    want = [
        -np.linalg.solve(A + d * np.diag(np.diag(A)), g) for A, g, d in zip(H, slope, damping, strict=True)
    ]
    assert_allclose(damped_steps(H, slope, damping, 10.0), want, rtol=1e-6)
    got = damped_steps(H, 1e3 * slope, damping, 0.5)
    assert_allclose(np.abs(got).max(axis=1), 0.5)
    assert_allclose(got, [0.5 * x / np.abs(x).max() for x in want], rtol=1e-6)


def test_a_freedom_without_information_takes_no_step(rng):
    H, slope = np.diag([2.0, 0.0, 4.0])[None], np.array([[1.0, 0.0, 2.0]])
    assert_allclose(damped_steps(H, slope, np.array([1e-3]), 9.0), [[-0.5, 0.0, -0.5]], rtol=2e-3)
