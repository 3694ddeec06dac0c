"""The compiled chain rule against that of `kinematics.spm`."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.gaussian import Gaussian
from kinematics.spm import joint_jacobian, joints, motions, skeleton
from tests.kinematics.figures import HORSE, WALKER, random_pose
from tracker.registration.chain_rule import FREEDOM, HEAVIEST, LONGEST, descend, settled, weighed
from tracker.registration.records import FIRST, Climbs, Weights


@pytest.fixture(params=[WALKER, HORSE], ids=lambda figure: figure.name)
def figure(request):
    return request.param


@pytest.fixture
def poses(figure, rng):
    return np.array([random_pose(figure, rng, size=0.3) for _ in range(4)])


def laying(figure, q, rng):
    """Poses (H, D) with links that measured something."""
    bones, L = skeleton(figure, q), len(figure.links)
    root, pull = rng.normal(size=(len(q), L, 7, 5)), rng.normal(size=(len(q), L, 5))
    moments = np.swapaxes(root, -1, -2) @ root
    return q, bones.start, bones.direction, bones.length, bones.size, moments, pull, rng.normal(size=len(q))


def free(D, lost=1.0, pulled=1.0):
    """Weights without limits."""
    return Weights(lost, pulled, np.full(D, -np.inf), np.full(D, np.inf), 1.0)


def test_links_add_up_by_the_chain_rule(figure, poses, rng):
    fit, M = laying(figure, poses, rng), motions(figure, skeleton(figure, poses))
    cost, information, gradient = weighed(figure.layout, fit, free(poses.shape[1], 3.0, 0.5))
    want = 0.5 * np.einsum("hlvd,hlvw,hlwe->hde", M, fit[5], M)
    assert_allclose(cost, 3.0 * fit[7])
    assert_allclose(information, want, rtol=1e-9, atol=1e-9)
    assert_allclose(gradient, 0.5 * np.einsum("hlwd,hlw->hd", M, fit[6]), rtol=1e-9, atol=1e-9)


def test_a_limit_pulls_what_is_beyond_it_back_as_a_spring_does(figure, poses, rng):
    fit, inner = laying(figure, poses, rng), free(poses.shape[1])
    low, high = poses.min(0) + 0.05, poses.max(0) - 0.02
    beyond = np.maximum(poses - high, 0.0) - np.maximum(low - poses, 0.0)
    bound = weighed(figure.layout, fit, inner._replace(low=low, high=high, stiffness=7.0))
    cost, information, gradient = (
        a - b for a, b in zip(bound, weighed(figure.layout, fit, inner), strict=True)
    )
    assert_allclose(cost, 3.5 * (beyond**2).sum(1), atol=1e-9)
    assert_allclose(gradient, 7.0 * beyond, atol=1e-9)
    assert_allclose(information, 7.0 * (beyond != 0.0)[..., None] * np.eye(poses.shape[1]), atol=1e-9)


def test_joints_pull_by_their_own_jacobian_two_at_one_place_as_well(figure, poses, rng):
    joint = rng.integers(0, 1 + len(figure.links), (3, 6))
    joint[:, 0], joint[:, 1] = 0, joint[:, 2]  # the base, and one joint twice
    places = rng.normal(size=(6, 2))
    held = 1e-18 * np.eye(poses.shape[1])  # no step leads away from a prior so sure
    priors = Gaussian(poses, np.repeat(held[None], len(poses), axis=0))
    modes, information, gradient, apart = settled(figure.layout, priors, joint, places, 0.4)
    for w, names in enumerate(joint):
        for h, q in enumerate(poses):
            away = joints(figure, q)[names] - places
            weight = (FREEDOM + 2.0) / (FREEDOM + (away**2).sum(1) / 0.16) / 0.16
            J = joint_jacobian(figure, q)[names]
            assert_allclose(modes[w, h], q, rtol=0.0, atol=1e-12)
            assert_allclose(apart[w, h], away, rtol=1e-9, atol=1e-12)
            assert_allclose(information[w, h], np.einsum("jcd,j,jce->de", J, weight, J), rtol=1e-9, atol=1e-9)
            assert_allclose(gradient[w, h], np.einsum("jcd,j,jc->d", J, weight, away), rtol=1e-9, atol=1e-9)


def climbing(figure, poses, rng, sure=1e4):
    """Two rows for each pose, the first of which is tried, weights and priors, and climbs."""
    D = poses.shape[1]
    root = rng.normal(size=(len(poses), 2 * D, D))
    priors = poses + 0.1 * rng.normal(size=poses.shape), sure * np.swapaxes(root, -1, -2) @ root
    fit = laying(figure, np.repeat(poses, 2, axis=0), rng)
    return fit, free(D), priors, Climbs.begin(len(poses))


def lowered(figure, fit, weights, priors, rows):
    """What climbs lower in some rows, with its derivatives."""
    cost, information, gradient = (each[rows] for each in weighed(figure.layout, fit, weights))
    away = fit[0][rows] - priors[0]
    leans = np.einsum("hde,he->hd", priors[1], away)
    return cost + 0.5 * (away * leans).sum(1), information + priors[1], gradient + leans


def test_what_is_tried_next_is_a_damped_gauss_newton_step_away_laid_out(figure, poses, rng):
    fit, weights, priors, climbs = climbing(figure, poses, rng)
    cost, H, gradient = lowered(figure, fit, weights, priors, slice(0, None, 2))
    damped = H + FIRST * np.einsum("hij,ij->hij", H, np.eye(H.shape[-1]))
    descend(figure.layout, fit, weights, priors, climbs)
    assert_allclose(climbs.own, 2 * np.arange(len(poses)))
    assert_allclose(climbs.cost, cost)
    step = -np.linalg.solve(damped, gradient[..., None])[..., 0]
    assert_allclose(fit[0][1::2], poses + step, rtol=1e-6)
    assert_allclose(fit[0][0::2], poses, rtol=0.0)
    bones = skeleton(figure, fit[0][1::2])
    for got, want in zip(fit[1:5], (bones.start, bones.direction, bones.length, bones.size), strict=True):
        assert_allclose(got[1::2], want, rtol=1e-9, atol=1e-12)


def test_no_step_is_longer_than_the_longest(figure, poses, rng):
    fit, weights, priors, climbs = climbing(figure, poses, rng)
    descend(figure.layout, fit, weights, (priors[0] + 10.0, priors[1]), climbs)
    assert_allclose(np.abs(fit[0][1::2] - poses).max(axis=1), LONGEST)


def test_a_trial_is_taken_only_if_it_is_better_and_damping_follows(figure, poses, rng):
    fit, weights, priors, climbs = climbing(figure, poses, rng)
    descend(figure.layout, fit, weights, priors, climbs)
    fit[7][1::2] += np.where(np.arange(len(poses)) % 2 == 0, 1e9, -1e9)  # what the trials cost
    before = climbs.cost.copy()
    tried = lowered(figure, fit, weights, priors, slice(1, None, 2))[0]
    better = tried < before
    assert better.any()
    assert not better.all()
    descend(figure.layout, fit, weights, priors, climbs)
    assert_allclose(climbs.own, 2 * np.arange(len(poses)) + better)
    assert_allclose(climbs.cost, np.where(better, tried, before))
    assert_allclose(climbs.damping, np.where(better, 0.3 * FIRST, 0.01))
    # The next trial is a step from the best pose so far.
    _, H, gradient = lowered(figure, fit, weights, priors, climbs.own)
    H += climbs.damping[:, None, None] * np.einsum("hij,ij->hij", H, np.eye(H.shape[-1]))
    step = -np.linalg.solve(H, gradient[..., None])[..., 0]
    assert_allclose(fit[0][climbs.own ^ 1], fit[0][climbs.own] + step, rtol=1e-6, atol=1e-9)
    assert climbs.on.all()


def test_a_climb_ends_with_a_small_gain_a_small_step_or_when_no_step_helps(figure, poses, rng):
    for gain, damping, away in ((5e-3, FIRST, 1.0), (1.0, FIRST, 1e-3), (-1.0, HEAVIEST, 1.0)):
        fit, weights, (mean, precision), climbs = climbing(figure, poses, rng, sure=1e12)
        priors = poses + away * (mean - poses), precision
        climbs.damping[:] = damping
        descend(figure.layout, fit, weights, priors, climbs)
        tried = lowered(figure, fit, weights, priors, slice(1, None, 2))[0]
        fit[7][1::2] += climbs.cost - gain - tried
        descend(figure.layout, fit, weights, priors, climbs)
        assert not climbs.on.any()
        rows = [each.copy() for each in (fit[0], climbs.own, climbs.cost)]
        descend(figure.layout, fit, weights, priors, climbs)
        for got, want in zip((fit[0], climbs.own, climbs.cost), rows, strict=True):
            assert_allclose(got, want, rtol=0.0)


def test_a_freedom_that_nothing_measures_takes_no_step(figure, poses, rng):
    fit, weights, priors, climbs = climbing(figure, poses, rng)
    nothing = poses[0] * 0.0, np.zeros_like(priors[1])
    for each in fit[5:7]:
        each[:, -1] = 0.0  # the last link, which nothing hangs on
    (freedom,) = np.flatnonzero(figure.layout.angle == figure.layout.angle[-1])[-1:]
    descend(figure.layout, fit, weights, (np.tile(nothing[0], (len(poses), 1)), nothing[1]), climbs)
    column = figure.layout.angle[freedom]
    assert_allclose(fit[0][1::2, column], poses[:, column], atol=1e-9)
