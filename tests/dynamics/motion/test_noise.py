"""Noise fitted to sequences: the likeliest by the joint Gaussian, and found again where it is known."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.motion.noise import (
    FACTORS,
    SEARCHES,
    STRANGER,
    among_strangers,
    at_noise,
    at_process_noise,
    wider,
)
from dynamics.motion.tasks import CLASSIFY_TICKS, classify, predict, predict_ticks
from tests.dynamics.motion.motions import two_motions
from tests.oracles import given_path, log_density, random_slds, sample


def added(slds, noisy):
    """(M,) standard deviations of what was added to R, which must be nothing but variances."""
    more = noisy.R - slds.R
    assert_allclose(more, np.diag(np.diag(more)), atol=1e-15)
    return np.sqrt(np.diag(more))


def log_density_at(slds, y, added):
    """log p(y) of a one-state model with each of these standard deviations of noise added, by the joint."""
    T, seen = len(y), ~np.isnan(y.ravel())
    x, P, _ = given_path(slds, np.full_like(y, np.nan), [0] * T)
    H, noise = np.kron(np.eye(T), slds.C)[seen], np.kron(np.eye(T), slds.R)[np.ix_(seen, seen)]
    S = H @ P.reshape(x.size, x.size) @ H.T + noise
    return log_density(y.ravel()[seen], H @ x.ravel(), S + added[:, None, None] ** 2 * np.eye(len(S)))


@pytest.mark.parametrize("order", [1, 2])
def test_the_noise_of_one_state_is_the_likeliest_by_the_joint_gaussian(order, rng):
    slds = random_slds(1, d=2, order=order, noise=0.05, rng=rng)
    ys = [y + 0.1 * rng.normal(size=y.shape) for y in (sample(slds, 12, rng)[2] for _ in range(3))]
    ys[1][3:5] = ys[0][0, 0] = np.nan
    tried = np.arange(0.0, 0.3, 1e-3)
    values = sum(log_density_at(slds, y, tried) for y in ys)
    # The search stops within 5 %, the grid is half a step off.
    assert_allclose(added(slds, at_noise(slds, ys)), tried[int(np.argmax(values))], rtol=0.05, atol=5e-4)


@pytest.mark.parametrize(("stays", "travels"), [(0.4, 0.0), (0.1, 0.1), (0.03, 0.3)])
def test_added_noise_is_found_again(stays, travels, rng):
    slds = two_motions(rng, noise=0.03)
    ys = [
        y + [stays, travels, stays] * rng.normal(size=y.shape)
        for y in (sample(slds, 40, rng)[2] for _ in range(12))
    ]
    for y in ys:
        y[rng.random(len(y)) < 0.1] = np.nan
    found = added(slds, at_noise(slds, ys))
    assert found[0] == pytest.approx(found[2], rel=1e-12)
    # 900 numbers tell it to 3 % where it is above the model's own; then the dynamics take some for motion.
    assert found[0] == pytest.approx(stays, rel=0.15)
    assert found[1] == pytest.approx(travels, rel=0.15, abs=0.02)


def test_a_model_that_meets_no_more_noise_than_its_own_keeps_it(rng):
    slds = random_slds(2, noise=0.3, rng=rng)
    smooth = np.zeros((40, 2))
    assert at_noise(slds, [smooth]) is slds
    assert at_noise(slds, [np.full((5, 2), np.nan)]) is slds


def test_more_noise_than_half_a_radian_is_not_believed(rng):
    slds = random_slds(1, noise=0.03, rng=rng)
    ys = [y + 1.5 * rng.normal(size=y.shape) for y in (sample(slds, 40, rng)[2] for _ in range(6))]
    assert_allclose(added(slds, at_noise(slds, ys)), 0.5, rtol=0.05)  # what the search stops within


def test_a_place_that_was_not_measured_keeps_its_noise(rng):
    slds = two_motions(rng, noise=0.03)
    y = sample(slds, 200, rng)[2] + [0.1, 0.0, 0.1] * rng.normal(size=(200, 3))
    y[:, 1] = np.nan
    found = added(slds, at_noise(slds, [y]))
    assert found[1] == 0.0
    assert found[0] == pytest.approx(0.1, rel=0.2)


def test_more_sequences_than_needed_are_thinned_evenly(rng):
    slds = random_slds(1, noise=0.03, rng=rng)
    every = [sample(slds, 100, rng)[2] for _ in range(45)]
    loud = [y + 0.2 * rng.normal(size=y.shape) for y in every]
    # Of 4,500 frames 1,500 are enough: every third sequence.
    others = [every[n] if n % 3 == 1 else y for n, y in enumerate(loud)]
    thirds = [loud[n] if n % 3 == 1 else y for n, y in enumerate(every)]
    assert_allclose(added(slds, at_noise(slds, others)), 0.0, atol=0.02)
    assert_allclose(added(slds, at_noise(slds, thirds)), 0.2, rtol=0.1)
    # Short ones between long ones do not stand for these.
    long = sample(slds, 1500, rng)[2]
    long += 0.2 * rng.normal(size=long.shape)
    assert_allclose(added(slds, at_noise(slds, [every[0], long, every[1], long])), 0.2, rtol=0.1)


@pytest.mark.parametrize("factor", [0.5, 1.0, 4.0])
def test_the_factor_of_the_process_noise_is_found_again(factor, rng):
    slds = random_slds(2, d=3, order=2, noise=0.05, rng=rng)
    lively = replace(slds, Q=factor * slds.Q)
    ys = [sample(lively, 60, rng)[2] for _ in range(8)]
    for y in ys:
        y[rng.random(len(y)) < 0.1] = np.nan
    found = at_process_noise(slds, ys)
    # 1,300 numbers, which measurement noise of about the same size blurs.
    assert_allclose(found.Q, factor * slds.Q, rtol=0.2)
    assert_array_equal(found.R, slds.R)


@pytest.mark.parametrize("order", [1, 2])
def test_the_process_noise_of_one_state_is_the_likeliest_by_the_joint_gaussian(order, rng):
    slds = random_slds(1, d=2, order=order, noise=0.05, rng=rng)
    ys = [sample(replace(slds, Q=3.0 * slds.Q), 12, rng)[2] for _ in range(3)]
    tried = np.exp(np.arange(np.log(FACTORS[0]), np.log(FACTORS[1]), 0.02))
    values = [sum(log_density_at(replace(slds, Q=f * slds.Q), y, np.zeros(1))[0] for y in ys) for f in tried]
    # The search stops within 5 %, the grid is a step off.
    assert_allclose(at_process_noise(slds, ys).Q, tried[int(np.argmax(values))] * slds.Q, rtol=0.07)


def test_where_nothing_tells_the_process_noise_stays(rng):
    slds = random_slds(2, rng=rng)
    for ys in ([np.full((5, 2), np.nan)], []):
        assert at_process_noise(slds, ys) is slds


def test_who_was_not_learned_from_is_allowed_ten_degrees_in_what_stays(rng):
    slds = two_motions(rng)
    raised = among_strangers(slds)
    want = slds.R + np.diag([np.radians(10.0) ** 2, 0.0, np.radians(10.0) ** 2])
    assert_allclose(raised.R, want, atol=1e-16)
    assert_array_equal(raised.Q, slds.Q)


@pytest.mark.parametrize("order", [1, 2])
def test_who_was_not_learned_from_has_another_mean_posture(order, rng):
    slds = random_slds(2, d=3, order=order, travelling=("b",), rng=rng)
    shift = STRANGER * rng.normal(size=(200_000, 3)) * [1.0, 0.0, 1.0]
    # Every pose of a state shifts alike; 200,000 draws tell a variance to 0.3 %.
    want = slds.cov0 + np.cov(np.tile(shift, order).T)
    assert_allclose(wider(slds).cov0, want, atol=0.01 * STRANGER**2)


@pytest.mark.parametrize("travelling", [(), ("b",)])
def test_the_work_ticks_as_often_as_it_says(rng, travelling):
    slds = random_slds(2, travelling=travelling, rng=rng)
    ys = [rng.normal(size=(T, len(slds.names))) for T in (4, 20)]
    ticks = []
    at_noise(slds, ys, lambda: ticks.append("noise"))
    assert len(ticks) == SEARCHES
    classify(slds, ys, tick=lambda: ticks.append("classify"))
    assert ticks.count("classify") == CLASSIFY_TICKS
    predict(slds, ys, 2, tick=lambda: ticks.append("predict"))
    assert ticks.count("predict") == predict_ticks(ys) > predict_ticks([ys[0]]) >= 1
