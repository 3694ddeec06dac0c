"""Synthesised motion: its moments and switches are the model's, and it stays in range."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.motion import tasks
from dynamics.motion.tasks import synthesise
from tests.dynamics.motion.motions import settled
from tests.oracles import log_density, random_slds


def assert_drawn_from(mean, cov, y, *, n):
    """Sample moments to five standard errors of a Gaussian's, of n draws that are independent."""
    sd = np.sqrt(np.diag(cov))
    assert (np.abs(y.mean(0) - mean) < 5.0 * sd / np.sqrt(n)).all()
    assert (np.abs(np.cov(y.T) - cov) < 5.0 * np.outer(sd, sd) * np.sqrt(2.0 / n)).all()


@pytest.mark.parametrize("order", [1, 2])
def test_a_free_run_of_one_state_has_its_stationary_moments(order, rng):
    slds = settled(random_slds(1, order=order, rng=rng))
    s, y = synthesise(slds, 4000, rng, recurrent=False)
    assert_array_equal(s, 0)
    # Modes of radius 0.95 at most remember 20 frames.
    assert_drawn_from(slds.C @ slds.mean0[0], slds.C @ slds.cov0[0] @ slds.C.T, y, n=200)


@pytest.mark.parametrize("recurrent", [True, False])
def test_switch_and_step_have_the_stated_probabilities(recurrent, rng, monkeypatch):
    monkeypatch.setattr(tasks, "INSIDE", 1.0)
    slds = random_slds(3, noise=0.8, rng=rng)
    cov0 = 2.0 * slds.cov0
    cov0[0] *= 1e-10  # every run starts at the same pose
    slds = replace(
        slds,
        pi0=[1.0, 0.0, 0.0],
        Pi=[[0.0, 0.4, 0.6], [0.3, 0.3, 0.4], [0.5, 0.0, 0.5]],
        b=slds.b + np.outer([0.0, 1.0, 0.0], [1.0, 1.0]),  # leads elsewhere than where it comes from
        mean0=0.5 * slds.mean0,
        cov0=cov0,
    )
    ahead = slds.A @ slds.mean0[0] + slds.b
    steps, log_p = [], np.log(np.maximum(slds.Pi[0], 1e-300))
    for k in range(3):
        cov, mean = slds.Q[k], ahead[k]
        if recurrent:
            log_p[k] += log_density(ahead[k], slds.mean0[k], slds.cov0[k])
            here, region = np.linalg.inv(slds.Q[k]), tasks.PULL * np.linalg.inv(slds.cov0[k])
            cov = np.linalg.inv(here + region)
            mean = cov @ (here @ ahead[k] + region @ slds.mean0[k])
        steps.append((mean, cov))
    prob = np.exp(log_p - np.logaddexp.reduce(log_p))

    n = 1000
    runs = [synthesise(slds, 2, rng, recurrent=recurrent) for _ in range(n)]
    s, y = np.array([run[0][1] for run in runs]), np.array([run[1][1] for run in runs])
    share = np.bincount(s, minlength=3) / n
    assert (np.abs(share - prob) <= 5.0 * np.sqrt(prob * (1.0 - prob) / n) + 1e-12).all()
    assert prob[1:].min() > 0.05  # both are there to be told apart
    for k in (1, 2):
        assert_drawn_from(*steps[k], y[s == k], n=np.sum(s == k))


@pytest.mark.parametrize("recurrent", [True, False])
def test_a_run_starts_as_a_sequence_does(recurrent, rng):
    slds = random_slds(2, order=2, rng=rng)
    runs = [synthesise(slds, 1, rng, recurrent=recurrent) for _ in range(1000)]
    s, y = np.array([run[0][0] for run in runs]), np.array([run[1][0] for run in runs])
    assert np.mean(s == 0) == pytest.approx(slds.pi0[0], abs=5.0 * 0.5 / np.sqrt(1000))
    for k in range(2):
        assert_drawn_from(slds.mean0[k][:2], slds.cov0[k][:2, :2], y[s == k], n=np.sum(s == k))


def swinging(radius):
    """One freedom going round in 20 frames in each of two halves of the swing, and a place that travels.

    The regions are those of a swing of amplitude 1, whatever the radius does.
    """
    turn = 2.0 * np.pi / 20.0
    A = np.zeros((2, 4, 4))
    A[:, 0, 0], A[:, 2:, :2] = 1.0, np.eye(2)
    A[:, 1, 1], A[:, 1, 3] = 2.0 * radius * np.cos(turn), -(radius**2)
    slds = random_slds(2, d=2, order=2, travelling=("a",), rng=np.random.default_rng(0))
    phase = np.linspace(0.0, np.pi, 50)
    mean0, cov0 = np.zeros((2, 4)), np.zeros((2, 4, 4))
    for k in range(2):
        half = np.column_stack([np.cos(phase + np.pi * k), np.cos(phase + np.pi * k - turn)])
        mean0[k, [1, 3]], mean0[k, 2] = half.mean(0), -0.1
        cov0[k] = 1e-3 * np.eye(4)
        cov0[k][np.ix_([1, 3], [1, 3])] += np.cov(half.T)
    b, Q = np.zeros((2, 4)), np.zeros((2, 4, 4))
    b[:, 0], Q[:, 0, 0], Q[:, 1, 1] = 0.1, 1e-4, 1e-3
    Pi = [[0.9, 0.1], [0.1, 0.9]]
    return replace(slds, pi0=[0.5, 0.5], A=A, b=b, Q=Q, mean0=mean0, cov0=cov0, Pi=Pi, C=np.eye(2, 4))


@pytest.mark.parametrize("recurrent", [True, False])
def test_a_switch_goes_by_the_state_before(recurrent, rng):
    slds = replace(random_slds(3, rng=rng), Pi=np.roll(np.eye(3), 1, axis=1))
    s, _ = synthesise(slds, 9, rng, recurrent=recurrent)
    assert_array_equal(np.diff(s) % 3, 1)


def test_where_all_freedoms_travel_the_first_order_is_synthesised_too(rng):
    slds = random_slds(2, travelling=("a", "b"), rng=rng)
    _, y = synthesise(slds, 50, np.random.default_rng(1))
    assert np.isfinite(y).all()


@pytest.mark.parametrize("radius", [0.97, 1.05])
def test_synthesis_stays_in_range_over_800_frames(radius):
    slds = swinging(radius)
    assert np.abs(np.linalg.eigvals(slds.A[0][np.ix_([1, 3], [1, 3])])).max() == pytest.approx(radius)
    s, y = synthesise(slds, 800, np.random.default_rng(1))
    assert s.shape == (800,)
    assert y.shape == (800, 2)
    assert np.isfinite(y).all()
    # The swing it was learned from reaches 1, with deviations of 0.7; chi2(2) has INSIDE within 3.3 of them.
    assert np.abs(y[:, 1]).max() < 2.4
    assert y[-400:, 1].std() > 0.1  # nor does it die down
    # Both halves are gone through, and it travels on as it did.
    assert 0.2 < s.mean() < 0.8
    assert np.diff(y[:, 0]).mean() == pytest.approx(0.1, abs=0.02)


def test_without_the_regions_an_unstable_run_leaves_every_range_and_is_finite():  # 1.05**2500 is 1e53
    _, y = synthesise(swinging(1.05), 2500, np.random.default_rng(1), recurrent=False)
    assert np.abs(y[:1000, 1]).max() > 1e6
    assert np.isfinite(y).all()


def test_a_step_is_drawn_among_the_poses_of_its_state_where_noise_allows(rng):
    slds = settled(random_slds(1, noise=0.5, rng=rng))
    slds = replace(slds, b=slds.b + 20.0)  # every step leads far out
    radius = [
        np.sqrt((y - m) @ np.linalg.solve(P, y - m))
        for y, m, P in ((synthesise(slds, 2, rng)[1][1], slds.mean0[0], slds.cov0[0]) for _ in range(150))
    ]
    # chi2(2) has INSIDE of its mass within 10.6; the rest is the step's own noise, less than the region's.
    assert np.mean(radius) < np.sqrt(10.6) + 1.0
    free = synthesise(slds, 2, rng, recurrent=False)[1][1]
    assert np.linalg.norm(free - slds.mean0[0]) > 15.0


def test_a_step_without_noise_goes_on_however_far_out_it_is(rng):
    slds = random_slds(1, rng=rng)
    slds = replace(slds, Q=1e-30 * slds.Q, b=slds.b + 100.0)
    _, y = synthesise(slds, 20, rng)
    # The noise drawn is 1e-15 times that of the model.
    assert_allclose(y[1:], y[:-1] @ slds.A[0].T + slds.b[0], atol=1e-10)


@pytest.mark.parametrize("recurrent", [True, False])
def test_the_same_seed_makes_the_same_motion_and_another_another(recurrent, rng):
    slds = random_slds(3, order=2, travelling=("a",), rng=rng)
    (s, y), (again_s, again), (_, other) = (
        synthesise(slds, 60, np.random.default_rng(seed), recurrent=recurrent) for seed in (3, 3, 4)
    )
    assert_array_equal(s, again_s)
    assert_array_equal(y, again)
    assert np.abs(y - other).min() > 0.0
