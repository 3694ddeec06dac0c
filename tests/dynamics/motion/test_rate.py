"""The same motion at another frame rate, and backwards; moments against the joint Gaussian."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import multivariate_normal

from dynamics.gaussian import Gaussian
from dynamics.kalman import predict
from dynamics.motion.rate import UNSURE, at_rate, backwards, by_motion, run_moments, stationary
from dynamics.slds import combine
from dynamics.store import load_shipped
from tests.dynamics.learning.systems import assert_same_system
from tests.dynamics.motion.motions import named, settled
from tests.oracles import assert_gaussian, given_path, mixture, random_slds


def frames(slds, k, times):
    """Joint mean and covariance of the poses at these frames in state k, from the joint Gaussian of a run."""
    T, d = max(times) + 1, len(slds.names)
    mean, cov, _ = given_path(slds, np.full((T, d), np.nan), [k] * T)
    n = len(times) * d
    return mean[times][:, :d].ravel(), cov[times][:, :d][:, :, times][..., :d].reshape(n, n)


def assert_regresses(slds, k, mean, cov, old_Q):
    """State k's dynamics predict the first pose from the others with the moments of their joint, poses with
    an error of their own."""
    d, cov = len(slds.names), cov + (UNSURE / slds.fps) ** 2 * np.eye(len(cov))
    A, b, Q = slds.A[k][:d], slds.b[k][:d], slds.Q[k][:d, :d]
    P = cov[d:, d:]
    # Normal equations with condition numbers near 1e4.
    assert_allclose(A @ mean[d:] + b, mean[:d], atol=1e-9)
    assert_allclose(A @ P, cov[:d, d:], atol=1e-9)
    # A hundredth of the old noise is added on purpose.
    floor = 1e-2 * np.diag(np.diag(old_Q[k])[:d])
    assert_allclose(A @ P @ A.T + Q, cov[:d, :d] + floor, atol=1e-9)


@pytest.mark.parametrize("order", [1, 2])
def test_the_same_rate_is_the_identity(order, rng):
    slds = random_slds(3, order=order, rng=rng)
    same = at_rate(slds, 30.0)
    assert_same_system(same, slds, rtol=0.0, atol=0.0)
    assert same.fps == 30.0


@pytest.mark.parametrize(
    ("fps", "filmed"), [(30.0, 30000 / 1001), (24.0, 23.976), (60.0, 59.94), (30.0, 29.97)]
)
def test_the_rates_of_television_are_those_of_film(fps, filmed, rng):
    slds = replace(random_slds(3, rng=rng), fps=fps)
    other = at_rate(slds, filmed)
    assert other.fps == filmed
    assert_array_equal(other.A, slds.A)


@pytest.mark.parametrize("fps", [29.0, 31.0, 20.0, 45.0])
def test_a_state_stays_where_it_is_at_another_rate_and_backwards(fps):
    slds = load_shipped("gait", 30.0)
    d = len(slds.names)
    for other in (at_rate(slds, fps), backwards(slds)):
        away = other.mean0[:, 2:d] - slds.mean0[:, 2:d]
        assert np.degrees(np.abs(away)).max() < 16.0 * max(30.0 / fps - 1.0, 0.0) + 0.1


@pytest.mark.parametrize("order", [1, 2])
def test_at_half_the_rate_it_has_the_moments_of_every_second_frame(order, rng):
    slds = random_slds(2, order=order, rng=rng)
    half = at_rate(slds, 15.0)
    times = [3, 1] if order == 1 else [4, 2, 0]
    for k in range(2):
        assert_regresses(half, k, *frames(slds, k, times), slds.Q)
    assert half.fps == 15.0


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("fps", [15.0, 20.0, 25.0, 50.0, 60.0, 120.0])
def test_a_settled_motion_stays_settled_at_every_rate(order, fps, rng):
    slds = settled(random_slds(2, order=order, travelling=("a",), rng=rng))
    other = at_rate(slds, fps)
    start, later = other.start, predict(other.start, other.A, other.b, other.Q)
    off = other.layout.from_here
    if order == 2:
        # The speed of the travelling freedom, per second.
        speed, was = -fps * other.mean0[:, 2], -30.0 * slds.mean0[:, 2]
        assert_allclose(speed, was, rtol=1e-6, atol=1e-6)
    # Interpolated poses have the mean of the frames; the cubic weights add to one.
    assert_allclose(later.mean @ off.T, start.mean, atol=1e-6)
    if fps == 15.0:
        # Floors of 1e-6 on the start and a hundredth of the old noise on a step, and the error of poses.
        floor = 1e-2 * slds.Q.max() + 1e-4 + (UNSURE / fps) ** 2
        assert_allclose(off @ later.cov @ off.T, start.cov, atol=floor)


@pytest.mark.parametrize("fps", [15.0, 24.0, 30.0, 40.0, 50.0, 60.0, 100.0, 120.0, 240.0])
def test_a_figure_that_is_not_seen_does_not_run_away_at_any_rate_nor_backwards(fps):
    slds = at_rate(load_shipped("walk-run", fps), fps)
    for model in (slds, backwards(slds)):
        # At 60 a second a factor of ten in ten seconds.
        assert np.abs(np.linalg.eigvals(model.A)).max() < 1.004


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("fps", [7.5, 24.0, 29.0, 31.0, 60.0, 120.0])
def test_every_rate_gives_a_proper_system(order, fps, rng):
    slds = random_slds(3, d=3, order=order, travelling=("a", "b"), rng=rng)
    other = at_rate(slds, fps)
    assert other.fps == fps
    assert_allclose(other.Pi.sum(1), 1.0, atol=1e-14)  # sums of three probabilities
    assert np.linalg.eigvalsh(other.Q[:, :3, :3]).min() > 0.0
    assert np.linalg.eigvalsh(other.cov0).min() > 0.0
    shift = np.tile([5.0, -3.0, 0.0], order)
    for A in other.A:
        assert_allclose(A @ shift, shift, atol=1e-8)  # where the figure stands still does not matter


@pytest.mark.parametrize("fps", [7.5, 15.0, 24.0, 60.0, 120.0])
def test_a_stay_lasts_as_many_seconds_as_before(fps, rng):
    Pi = np.array([[0.9, 0.07, 0.03], [0.0, 0.5, 0.5], [0.005, 0.005, 0.99]])
    slds = replace(random_slds(3, rng=rng), Pi=Pi)
    other = at_rate(slds, fps)
    p, q = np.diag(Pi), np.diag(other.Pi)
    # The chance of staying half a second; probabilities through powers.
    assert_allclose(q ** (0.5 * fps), p**15.0, rtol=1e-9)
    # A stay is counted in whole frames, so its mean may differ by the difference of two frames.
    mean, was = 1.0 / (1.0 - q) / fps, 1.0 / (1.0 - p) / 30.0
    assert (np.abs(mean - was) <= abs(1.0 / fps - 1.0 / 30.0)).all()
    # Where it goes on leaving is as before.
    assert_allclose(other.Pi[0, 1] / other.Pi[0, 2], 7.0 / 3.0, rtol=1e-12)
    assert other.Pi[1, 0] == 0.0


def test_states_never_or_always_left_stay_so(rng):
    slds = replace(random_slds(2, rng=rng), Pi=[[1.0, 0.0], [1.0, 0.0]])
    for fps in (15.0, 60.0):
        Pi = at_rate(slds, fps).Pi
        assert_allclose(Pi[0], [1.0, 0.0], atol=1e-9)
        assert_allclose(Pi[1], [1.0, 0.0], atol=1e-4)  # staying is taken to be at least 1e-9 likely


@pytest.mark.parametrize("fps", [7.0, 121.0])
def test_rates_too_far_away_are_refused(fps, rng):
    with pytest.raises(ValueError, match=f"cannot go from 30 to {fps:g} frames a second; learn again"):
        at_rate(random_slds(1, rng=rng), fps)


# Backwards


@pytest.mark.parametrize("order", [1, 2])
def test_backwards_it_has_the_moments_of_the_frames_in_reverse(order, rng):
    slds = random_slds(2, order=order, rng=rng)
    back = backwards(slds)
    times = [1, 2] if order == 1 else [0, 1, 2]
    for k in range(2):
        assert_regresses(back, k, *frames(slds, k, times), slds.Q)


def test_backwards_the_figure_walks_the_other_way(rng):
    slds = settled(random_slds(1, order=2, travelling=("a",), rng=rng))
    back = backwards(slds)
    step = predict(back.start, back.A, back.b, back.Q).mean[0, 0]
    assert step == pytest.approx(slds.mean0[0, 2], rel=1e-6)  # where it came from, to the settled accuracy
    assert abs(step) > 1e-3


def test_backwards_every_switch_is_made_the_other_way_as_often(rng):
    Pi = np.array([[0.8, 0.2, 0.0], [0.0, 0.7, 0.3], [0.4, 0.0, 0.6]])  # a ring
    slds = replace(random_slds(3, rng=rng), Pi=Pi)
    share = np.linalg.matrix_power(Pi, 500)[0]
    back = backwards(slds).Pi
    # The 500th power and a least-squares solution, both to a few roundings.
    assert_allclose(share[:, None] * back, (share[:, None] * Pi).T, atol=1e-12)
    assert_allclose(back.sum(1), 1.0, atol=1e-14)


def test_the_share_of_time_is_that_of_a_long_walk_through_the_states(rng):
    for K in (1, 2, 5):
        Pi = rng.dirichlet(np.ones(K), size=K)
        # Of these chains the second eigenvalue is below 0.9: 0.9**1000 is nothing.
        assert_allclose(stationary(Pi), np.linalg.matrix_power(Pi, 1000)[0], atol=1e-12)


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
    before = [(0, 3 + i) for i in range(3)] if order == 2 else []
    t, i = np.array([*before, *((t, i) for t in range(T) for i in range(3))]).T
    got = run_moments(slds, run)
    for k in range(3):
        mean, cov, _ = given_path(slds, np.full((T, 3), np.nan), [k] * T)
        # Rounding in a few products of matrices with entries near 1.
        assert_gaussian(got[k], Gaussian(mean[t, i], cov[t[:, None], i[:, None], t, i]), atol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("K", [1, 3])
def test_a_model_with_one_state_a_motion_is_its_own_answer(order, K, rng):
    slds = random_slds(K, d=3, order=order, travelling=("b",), rng=rng)
    slds = named(slds, *("walk", "jog", "run")[:K])
    got = by_motion(slds)
    # A regression on moments whose condition is near 1e4.
    assert_same_system(got, slds, rtol=1e-7, atol=1e-9)
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
    assert_same_system(got, one, rtol=1e-7, atol=1e-9)
    assert got.labels == ("walk", "run")


def test_motions_keep_their_order_and_their_own_states(rng):
    slds = named(random_slds(4, d=2, order=2, rng=rng), "run", "walk", "run", "walk")
    got = by_motion(slds)
    assert got.labels == ("run", "walk")
    assert_allclose(got.pi0, [slds.pi0[[0, 2]].sum(), slds.pi0[[1, 3]].sum()], atol=1e-15)
    for m, states in enumerate(([0, 2], [1, 3])):
        w = slds.pi0[states] / slds.pi0[states].sum()
        assert_gaussian(got.start[m], mixture(w, slds.mean0[states], slds.cov0[states]), atol=1e-13)
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
