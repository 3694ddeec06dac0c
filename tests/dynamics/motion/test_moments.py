"""Moments of a run of frames against the joint Gaussian; one state a motion against integrals on a grid."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import multivariate_normal

from dynamics.motion.rate import by_motion, run_moments, stationary
from dynamics.slds import combine
from tests.oracles import given_path, random_slds

FIELDS = ("pi0", "Pi", "A", "b", "Q", "C", "R", "mean0", "cov0")


def named(slds, *labels):
    return replace(slds, labels=labels)


def test_the_share_of_time_is_that_of_a_long_walk_through_the_states(rng):
    for K in (1, 2, 5):
        Pi = rng.dirichlet(np.ones(K), size=K)
        # Of these chains the second eigenvalue is below 0.9: 0.9**1000 is nothing.
        assert_allclose(stationary(Pi), np.linalg.matrix_power(Pi, 1000)[0], atol=1e-12)


def test_the_share_of_time_in_two_states_is_as_the_rates_out_of_them():
    assert_allclose(stationary(np.array([[0.9, 0.1], [0.3, 0.7]])), [0.75, 0.25], atol=1e-14)


def test_states_that_take_turns_have_equal_shares():  # no power of Pi settles
    assert_allclose(stationary(np.roll(np.eye(3), 1, axis=1)), 1 / 3, atol=1e-14)


def test_a_state_that_nobody_returns_to_has_hardly_a_share():
    share = stationary(np.array([[0.5, 0.5, 0.0], [0.0, 0.2, 0.8], [0.0, 0.6, 0.4]]))
    assert 0.0 < share[0] < 1e-11  # positive, so that it may be divided by
    assert_allclose(share[1:], [3 / 7, 4 / 7], atol=1e-12)


@pytest.mark.parametrize(("order", "run"), [(1, 1), (1, 2), (1, 5), (2, 2), (2, 3), (2, 6)])
@pytest.mark.parametrize("travelling", [(), ("b",)])
def test_a_run_has_the_joint_moments_of_its_frames(order, run, travelling, rng):
    slds = random_slds(3, d=3, order=order, travelling=travelling, rng=rng)
    T = run - order + 1  # at second order the first state holds two frames
    for k in range(3):
        mean, cov, _ = given_path(slds, np.full((T, 3), np.nan), [k] * T)
        frames = np.array([(0, 3 + i) for i in range(3)] if order == 2 else [], dtype=int).reshape(-1, 2)
        frames = np.vstack([frames, [(t, i) for t in range(T) for i in range(3)]])
        t, i = frames.T
        got_mean, got_cov = run_moments(slds, k, run)
        # Rounding in a few products of matrices with entries near 1.
        assert_allclose(got_mean, mean[t, i], atol=1e-12)
        assert_allclose(got_cov, cov[t[:, None], i[:, None], t, i], atol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("K", [1, 3])
def test_a_model_with_one_state_a_motion_is_its_own_answer(order, K, rng):
    slds = random_slds(K, d=3, order=order, travelling=("b",), rng=rng)
    slds = named(slds, *("walk", "jog", "run")[:K])
    got = by_motion(slds)
    for name in FIELDS:
        # A regression on moments whose condition is near 1e4.
        assert_allclose(getattr(got, name), getattr(slds, name), atol=1e-9, err_msg=name)
    assert (got.labels, got.names, got.travelling, got.fps) == (
        slds.labels, slds.names, slds.travelling, slds.fps
    )  # fmt: skip


@pytest.mark.parametrize("order", [1, 2])
def test_alike_states_of_a_motion_are_one(order, rng):
    one = named(random_slds(2, d=2, order=order, travelling=("a",), rng=rng), "walk", "run")
    fields = {name: np.repeat(getattr(one, name), 2, axis=0) for name in ("A", "b", "Q", "mean0", "cov0")}
    Pi = np.repeat(np.repeat(one.Pi, 2, axis=0), 2, axis=1) * np.tile([0.3, 0.7], (4, 2))
    pi0 = np.repeat(one.pi0, 2) * np.tile([0.6, 0.4], 2)
    got = by_motion(replace(one, pi0=pi0, Pi=Pi, labels=("walk", "walk", "run", "run"), **fields))
    for name in FIELDS:
        assert_allclose(getattr(got, name), getattr(one, name), atol=1e-9, err_msg=name)
    assert got.labels == ("walk", "run")


def test_motions_keep_their_order_and_their_own_states(rng):
    slds = named(random_slds(4, d=2, order=2, rng=rng), "run", "walk", "run", "walk")
    got = by_motion(slds)
    assert got.labels == ("run", "walk")
    assert_allclose(got.pi0, [slds.pi0[[0, 2]].sum(), slds.pi0[[1, 3]].sum()], atol=1e-15)
    for m, states in enumerate(([0, 2], [1, 3])):
        w = slds.pi0[states] / slds.pi0[states].sum()
        mean = w @ slds.mean0[states]
        second = sum(
            wk * (slds.cov0[k] + np.outer(slds.mean0[k], slds.mean0[k]))
            for wk, k in zip(w, states, strict=True)
        )
        assert_allclose(got.mean0[m], mean, atol=1e-14)
        assert_allclose(got.cov0[m], second - np.outer(mean, mean), atol=1e-13)
        leaves = sum(wk * slds.Pi[k, [[1, 3], [0, 2]][m]].sum() for wk, k in zip(w, states, strict=True))
        assert got.Pi[m, 1 - m] == pytest.approx(leaves, abs=1e-15)
        assert got.Pi[m].sum() == pytest.approx(1.0, abs=1e-15)


def steps_on_a_grid(slds, reach):
    """Points x (n, 2) and weights (K, n) of Pr(x_{t-1} = x, s_t = k), by the module's recurrent switch.

    The states before are laid out on a grid; nothing of the Gaussian algebra is used.
    """
    K = slds.K
    axis = np.linspace(-14.0, 14.0, 561)
    x = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    weights = np.zeros((K, len(x)))
    for j in range(K):
        before = multivariate_normal(slds.mean0[j], slds.cov0[j]).pdf(x)
        before /= before.sum()
        enters = []
        for k in range(K):
            mean, cov = reach @ slds.mean0[k], reach @ slds.cov0[k] @ reach.T
            ahead = x @ slds.A[k].T + slds.b[k]
            enters.append(slds.Pi[j, k] * before * multivariate_normal(mean, cov).pdf(ahead @ reach.T))
        weights += slds.pi0[j] * np.array(enters) / np.sum(enters)
    return x, weights


@pytest.mark.parametrize("travelling", [(), ("a",)])
def test_the_dynamics_of_a_motion_regress_what_its_states_do(travelling, rng):
    slds = named(random_slds(3, d=1, order=2, travelling=travelling, rng=rng), "walk", "run", "walk")
    reach = np.array([[1.0, -1.0]]) if travelling else np.eye(2)
    x, weights = steps_on_a_grid(slds, reach)
    # A travelling place is carried over, and only its change is regressed on.
    carried = x[:, 0] if travelling else np.zeros(len(x))
    phi = np.column_stack([x @ reach.T, np.ones(len(x))])
    got = by_motion(slds)
    for m, states in enumerate(([0, 2], [1])):
        S_pp, S_yp, S_yy, n = 0.0, 0.0, 0.0, 0.0
        for k in states:
            y = x @ slds.A[k, 0] + slds.b[k, 0] - carried
            S_pp += phi.T @ (weights[k][:, None] * phi)
            S_yp += (weights[k] * y) @ phi
            S_yy += weights[k] @ (y**2 + slds.Q[k, 0, 0])
            n += weights[k].sum()
        B = np.linalg.solve(S_pp, S_yp)
        A = B[:-1] @ reach + ([1.0, 0.0] if travelling else 0.0)
        # Regions are widened by 1e-6 of their variance; a grid of steps an eighth of their width is exact.
        assert_allclose(got.A[m, 0], A, atol=1e-5)
        assert got.b[m, 0] == pytest.approx(B[-1], abs=1e-5)
        assert got.Q[m, 0, 0] == pytest.approx((S_yy - B @ S_yp) / n, rel=1e-5)
        assert_array_equal(got.A[m, 1], [1.0, 0.0])
        assert_array_equal(got.Q[m, 1], 0.0)


def test_regions_thousands_of_nats_apart_do_not_underflow(rng):
    walk, run = (named(random_slds(2, d=2, order=2, rng=rng), label, label) for label in ("walk", "run"))
    both = combine([walk, run], crossing=1e-3)
    far = replace(both, mean0=both.mean0 + np.array([[0.0], [0.0], [100.0], [100.0]]))
    got = by_motion(far)
    for name in ("A", "b", "Q", "mean0", "cov0"):  # that of each is what it would be alone
        assert_allclose(getattr(got, name)[:1], getattr(by_motion(walk), name), atol=1e-8, err_msg=name)
        assert np.isfinite(getattr(got, name)).all()
