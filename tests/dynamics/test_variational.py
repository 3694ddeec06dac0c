"""Structured variational inference against its definition, and its bound against the sum over all paths."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import entr

import dynamics.variational as module
from dynamics import chain
from dynamics.gaussian import Gaussian
from dynamics.learning.em import learn
from dynamics.learning.options import Options
from dynamics.posterior import Posterior
from dynamics.variational import Variational, variational_all
from dynamics.viterbi import viterbi
from tests.oracles import drawn, expected_log_joint, random_slds, single, sum_over_paths

variational = single(variational_all)
LEARNT = {"fps": 30.0, "label": "walk"}


def rounds(slds, y, n, hints=None, start=None):
    """The posteriors after each of n rounds."""
    found, hints = [], None if hints is None else [hints]
    for _ in range(n):
        start = variational_all(slds, [y], hints, start=None if start is None else [start], rounds=1)[0]
        found.append(start)
    return found


def uniform(slds, T):
    """A start that knows nothing."""
    N = slds.A.shape[-1]
    return Posterior(
        prob=np.full((T, slds.K), 1.0 / slds.K),
        pair=np.full((T - 1, slds.K, slds.K), 1.0 / slds.K**2),
        states=Gaussian(np.zeros((T, N)), np.zeros((T, N, N))),
        lag=np.zeros((T - 1, N, N)),
        log_evidence=-np.inf,
        path=np.zeros(T, dtype=np.intp),
    )


def dense(slds, y, prob):
    """q(X) by its definition: all switching states' log densities, weighted, are one quadratic in the poses.

    Returns mean (T, N) and cov (T, N, T, N) of the states, and the cov of all poses in them.
    """
    d, N, T = len(slds.names), slds.A.shape[-1], len(y)
    lags = slds.order - 1
    D = (T + lags) * d
    x = []
    for t in range(T):  # x_t = [u_t; u_{t-1}] picked from [u_{-1}; u_0; ..]
        x.append(np.vstack([np.eye(d, D, k=(t + lags - lag) * d) for lag in range(slds.order)]))
    terms = []
    for k in range(slds.K):
        terms.append((prob[0, k], x[0], slds.mean0[k], slds.cov0[k]))
        for t in range(1, T):
            step = (x[t] - slds.A[k] @ x[t - 1])[:d]
            terms.append((prob[t, k], step, slds.b[k, :d], slds.Q[k, :d, :d]))
    for t in range(T):
        seen = ~np.isnan(y[t])
        terms.append((1.0, slds.C[seen] @ x[t], y[t, seen], slds.R[np.ix_(seen, seen)]))
    precision = sum(w * B.T @ np.linalg.inv(noise) @ B for w, B, _, noise in terms)
    linear = sum(w * B.T @ np.linalg.inv(noise) @ c for w, B, c, noise in terms)
    cov = np.linalg.inv(precision)
    pick = np.vstack(x)
    return (pick @ cov @ linear).reshape(T, N), (pick @ cov @ pick.T).reshape(T, N, T, N), cov


def bound_by_definition(slds, y, got, poses_cov):
    """E_q log p(X, S, Y) + H[q(X)] + H[q(S)]."""
    entropy = 0.5 * np.linalg.slogdet(2.0 * np.pi * np.e * poses_cov)[1]
    entropy += entr(got.prob[0]).sum() + entr(got.pair).sum() - entr(got.prob[:-1]).sum()
    return expected_log_joint(slds, [y], [got], np.ones(1)) + entropy


# What q(X), q(S) and the bound are


@pytest.mark.parametrize(
    ("order", "travelling", "gaps", "T"),  # every pair of values
    [
        (1, (), False, 1),
        (1, ("a",), True, 2),
        (1, (), True, 8),
        (2, ("a",), False, 8),
        (2, ("a",), True, 1),
        (2, (), False, 2),
    ],
)
def test_the_states_are_those_of_the_averaged_quadratic(order, travelling, gaps, T, rng):
    slds = random_slds(3, order=order, travelling=travelling, rng=rng)
    y = drawn(slds, T, rng, gaps=gaps)
    anywhere = Gaussian(rng.normal(size=(T, 2 * order)), uniform(slds, T).states.cov)
    start = replace(uniform(slds, T), prob=rng.dirichlet(np.ones(3), size=T), states=anywhere)
    first, second = rounds(slds, y, 2, start=start)
    for got, prob in ((first, start.prob), (second, first.prob)):
        mean, cov, _ = dense(slds, y, prob)
        # Rounding times the precision's conditioning, below 1e4.
        assert_allclose(got.states.mean, mean, atol=1e-11)
        assert_allclose(got.states.cov, [cov[t, :, t] for t in range(T)], atol=1e-11)
        assert_allclose(got.lag, [cov[t + 1, :, t] for t in range(T - 1)] or got.lag, atol=1e-11)


@pytest.mark.parametrize(
    ("order", "gaps", "T"),
    [(1, False, 1), (1, True, 2), (1, True, 7), (2, True, 1), (2, False, 2), (2, False, 7)],
)
def test_the_bound_is_expected_log_joint_plus_entropy(order, gaps, T, rng):
    slds = random_slds(3, order=order, travelling=("a",), noise=1.0, rng=rng)
    y = drawn(slds, T, rng, gaps=gaps)
    before, got = rounds(slds, y, 2)
    want = bound_by_definition(slds, y, got, dense(slds, y, before.prob)[2])
    assert got.log_evidence == pytest.approx(want, rel=1e-11, abs=1e-11)  # the same sums otherwise arranged


# The bound


@pytest.mark.parametrize(
    ("order", "gaps", "knowing"), [(1, False, False), (1, True, True), (2, False, True), (2, True, False)]
)
def test_the_bound_never_falls_from_round_to_round(order, gaps, knowing, rng):
    rises = []
    for _ in range(8):
        slds = random_slds(3, order=order, travelling=("a",), rng=rng)
        y = drawn(slds, 15, rng, gaps=gaps)
        start = None if knowing else uniform(slds, 15)
        rises.append(np.diff([p.log_evidence for p in rounds(slds, y, 12, start=start)]))
    # Rounding in sums of numbers near 100; measured worst -6e-14.
    assert np.min(rises) > -1e-11
    assert np.max(rises) > 1e-3


def test_the_bound_is_below_the_evidence_by_what_independence_costs(rng):
    short = []
    for i in range(20):
        K, T = ((2, 8), (3, 5))[i % 2]
        slds = random_slds(K, order=1 + i // 2 % 2, noise=0.5, rng=rng)
        y = drawn(slds, T, rng, gaps=i % 3 == 0)
        short.append(sum_over_paths(slds, y) - variational(slds, y).log_evidence)
    # Measured on these: 7e-6 to 1.57, median 0.54.
    assert min(short) > 1e-9
    assert 0.3 < np.median(short) < 0.8
    assert max(short) < 3.0


def test_a_start_from_the_viterbi_path_ends_higher_than_one_that_knows_nothing(rng):
    higher = []
    for i in range(12):
        slds = random_slds(3, d=3, order=1 + i % 2, noise=0.1, stay=0.9, rng=rng)
        y = drawn(slds, 30, rng)
        blind = variational_all(slds, [y], start=[uniform(slds, 30)])[0].log_evidence
        higher.append(variational(slds, y).log_evidence - blind)
    # Measured on these: -1e-8 to 447 nats, mean 96.
    assert np.mean(higher) > 10.0
    assert np.min(higher) > -1.0


def test_a_sequence_is_done_when_its_bound_has_settled(rng):
    slds = random_slds(3, order=2, rng=rng)
    y = drawn(slds, 40, rng)
    values = [p.log_evidence for p in rounds(slds, y, 40)]
    for tolerance in (1.0, 1e-2, 1e-6):
        settled = np.flatnonzero(np.diff(values) < tolerance)[0] + 1
        assert variational(slds, y, tolerance=tolerance).log_evidence == pytest.approx(
            values[settled], rel=1e-13
        )
    for n in (1, 3):
        got = variational(slds, y, rounds=n, tolerance=-np.inf)
        assert got.log_evidence == pytest.approx(values[n - 1], rel=1e-13)


# Several sequences, hints, limits


def test_long_sequences_are_taken_fewer_at_a_time(rng, monkeypatch):
    sizes = []

    def beside(slds, ys, hints):
        sizes.append(len(ys) * max(len(y) for y in ys))
        return module_beside(slds, ys, hints)

    module_beside = module.beside
    monkeypatch.setattr(module, "beside", beside)
    monkeypatch.setattr(chain, "LARGEST", 40 * 2 * 2 * 2)  # 40 frames of 2 states' 2 x 2
    slds = random_slds(2, rng=rng)
    ys = [drawn(slds, T, rng) for T in (50, 20, 1, 1, 1, 20, 10, 10, 10, 10, 1)]
    variational_all(slds, ys)
    assert max(sizes) == 50  # one sequence at least
    assert max(sorted(sizes)[:-1]) <= 40
    assert len(sizes) == 4


@pytest.mark.parametrize("order", [1, 2])
def test_a_place_far_away_costs_no_digits(order, rng):
    slds = random_slds(2, order=order, travelling=("a",), noise=0.01, rng=rng)
    y = drawn(slds, 20, rng, gaps=True)
    shift = np.tile([1e6, 0.0], order)
    far = variational(replace(slds, mean0=slds.mean0 + shift), y + shift[:2])
    here = variational(slds, y)
    # Coordinates of 1e6 are known to 1e-10, a hundred millionth of the noise.
    assert_allclose(far.states.mean - shift, here.states.mean, atol=1e-8)
    assert_allclose(far.prob, here.prob, atol=1e-5)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(
    "scales", [(1e-8, 1.0), (1.0, 1e-8), (1e8, 1.0), (1.0, 1e8), (1e-8, 1e8), (1e8, 1e-8)]
)
def test_tiny_and_huge_noise_leave_everything_finite(order, scales, rng):
    slds = random_slds(2, order=order, rng=rng)
    slds = replace(slds, Q=scales[0] * slds.Q, R=scales[1] * slds.R)
    y = drawn(slds, 30, rng, gaps=True)
    got = rounds(slds, y, 10)
    values = np.array([p.log_evidence for p in got])
    # Rounding in sums as large as the noises are apart.
    assert np.diff(values).min() > -1e-9 * (1.0 + np.abs(values).max())
    for p in got:
        assert np.isfinite(p.states.mean).all()
        spectrum = np.linalg.eigvalsh(p.states.cov)
        assert spectrum.min() > -1e-14 * spectrum.max()
        assert_allclose(p.prob.sum(1), 1.0, atol=1e-12)


def test_states_that_hold_more_than_poses_are_refused(rng):
    slds = random_slds(2, order=2, rng=rng)
    slds = slds.with_drifts(("scale",), np.ones(1), np.ones(1), np.ones(1))
    with pytest.raises(ValueError, match=r"must hold 1 or 2 poses of 3 freedoms .* it has 5 entries"):
        variational_all(slds, [np.zeros((4, 3))], start=[uniform(slds, 4)])


# Learning


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("within", [1, 50])
def test_learning_never_lowers_bound_plus_log_prior(order, within, rng):
    source = random_slds(2, order=order, travelling=("a",), rng=rng)
    ys = [drawn(source, T, rng) for T in (20, 15, 25, 20)]
    options = Options(states=2, order=order, rounds=12, tolerance=-np.inf)
    told = {"names": ("a", "b"), "travelling": ("a",), "options": options, **LEARNT}
    fit = learn(ys, infer=Variational(rounds=within), **told)
    assert len(fit.values) == 12
    # Rounding in sums of log-likelihoods near 1000.
    assert np.diff(fit.values).min() > -1e-8
    assert fit.values[-1] > fit.values[0] + 1.0


def test_a_warm_start_goes_on_where_it_stopped(rng):
    slds = random_slds(3, order=2, rng=rng)
    ys = [drawn(slds, T, rng) for T in (30, 20)]
    infer = Variational(rounds=1)
    values = np.array([[p.log_evidence for p in infer(slds, ys)] for _ in range(5)])
    want = np.array([[p.log_evidence for p in rounds(slds, y, 5)] for y in ys]).T
    assert_allclose(values, want, rtol=1e-12)
    assert (np.diff(values, axis=0) > 0).any()


def test_other_sequences_or_states_start_afresh(rng):
    slds, other = random_slds(3, rng=rng), random_slds(2, rng=rng)
    ys = [drawn(slds, T, rng) for T in (30, 20)]
    infer = Variational(rounds=1)
    for system, sequences in ((slds, ys), (other, ys), (other, ys[::-1]), (other, ys[:1])):
        for got, y in zip(infer(system, sequences), sequences, strict=True):
            assert got.log_evidence == pytest.approx(variational(system, y, rounds=1).log_evidence, rel=1e-12)


@pytest.mark.parametrize("told", [False, True])
def test_the_start_is_the_approximate_viterbi_path(told, rng):
    slds = random_slds(2, rng=rng)
    y = drawn(slds, 12, rng)
    hints = np.where(np.eye(2)[rng.integers(2, size=12)] > 0, 30.0, 0.0) if told else None
    (first,) = rounds(slds, y, 1, hints=hints)
    path = viterbi(slds, y, hints)
    # Poses given that path are the Kalman smoother's, which raises its covariances by 1e-12 of their size.
    assert_allclose(first.states.mean, path.states.mean, atol=1e-9)
    assert first.log_evidence > path.log_evidence
    assert first.log_evidence == variational(slds, y, hints, rounds=1).log_evidence
