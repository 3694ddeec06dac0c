"""The hidden Markov model against all its paths, against hmmlearn, and EM's promise."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import dynamics.hmm as module
from dynamics import chain
from dynamics.chain import blocks
from dynamics.hmm import ARRAYS, combine_hmms, hmm_all
from dynamics.learning.baum_welch import learn_hmm
from dynamics.learning.options import DEFAULTS, Options
from tests.dynamics.hmms import enumerated, random_hmm


def drawn(hmm, T, rng, *, gaps=False):
    """States and poses."""
    s = np.empty(T, dtype=int)
    for t in range(T):
        s[t] = rng.choice(len(hmm.pi0), p=hmm.pi0 if t == 0 else hmm.Pi[s[t - 1]])
    y = np.array([rng.multivariate_normal(hmm.mean[k], hmm.cov[k]) for k in s])
    if gaps:
        y[rng.random(y.shape) < 0.3] = np.nan
        y[rng.random(T) < 0.2] = np.nan
    return s, y


def learnt(ys, *, weights=None, **options):
    """The fit to sequences of the freedoms a, b, ..."""
    names = tuple("abc"[: ys[0].shape[1]])
    return learn_hmm(ys, names=names, fps=30.0, label="walk", options=Options(**options), weights=weights)


def assert_same_hmm(one, other, *, atol):
    for name in ("pi0", "Pi", "mean", "cov"):
        assert_allclose(getattr(one, name), getattr(other, name), atol=atol, err_msg=name)


def penalised(hmm, ys, weights):  # of a prior of strength 1
    """Log evidence plus log prior: inverse-Wishart of a tenth of the data's variance, and Dirichlet."""
    y, K, M = np.concatenate(ys), len(hmm.pi0), len(hmm.names)
    total = sum(w * enumerated(hmm, y)[2] for w, y in zip(weights, ys, strict=True))
    scale = 0.1 * np.diag(y.var(axis=0))
    for cov in hmm.cov:
        total -= 0.5 * ((M + 2) * np.linalg.slogdet(cov)[1] + np.trace(np.linalg.inv(cov) @ scale))
    counts = 0.1 + DEFAULTS.stickiness * np.eye(K)
    return total + (counts * np.log(hmm.Pi)).sum() + 0.1 * np.log(hmm.pi0).sum()


# Inference


@pytest.mark.parametrize("K", [1, 3])
@pytest.mark.parametrize("gaps", [False, True])
def test_the_posterior_is_that_of_all_paths(K, gaps, rng):
    for T in (1, 2, 6):
        hmm = random_hmm(K, rng)
        _, y = drawn(hmm, T, rng, gaps=gaps)
        prob, pair, log_evidence, path = enumerated(hmm, y)
        (got,) = hmm_all(hmm, [y])
        assert_allclose(got.prob, prob, atol=1e-12)  # rounding
        assert_allclose(got.pair, pair, atol=1e-12)
        assert got.log_evidence == pytest.approx(log_evidence, rel=1e-12, abs=1e-12)
        if not np.isnan(y).all():
            assert_array_equal(got.path, path)


def test_inference_agrees_with_hmmlearn(rng):
    hmmlearn = pytest.importorskip("hmmlearn.hmm")
    hmm = random_hmm(4, rng, M=3, apart=0.8)
    ys = [drawn(hmm, T, rng)[1] for T in (50, 1, 20, 33)]
    other = hmmlearn.GaussianHMM(4, covariance_type="full")
    other.startprob_, other.transmat_ = hmm.pi0, hmm.Pi
    other.means_, other.covars_ = hmm.mean, hmm.cov
    for y, got in zip(ys, hmm_all(hmm, ys), strict=True):
        log_evidence, prob = other.score_samples(y)
        assert got.log_evidence == pytest.approx(log_evidence, rel=1e-11)
        assert_allclose(got.prob, prob, atol=1e-11)
        assert_array_equal(got.path, other.decode(y)[1])


def test_a_long_sequence_beside_short_ones_is_taken_alone(rng, monkeypatch):
    hmm = random_hmm(3, rng, M=2)
    ys = [drawn(hmm, T, rng)[1] for T in (5, 100, 1, 30, 5)]
    together, sizes = hmm_all(hmm, ys), []

    def side_by_side(parts, fill):
        sizes.append(len(parts) * max(map(len, parts)))
        return chain.side_by_side(parts, fill)

    monkeypatch.setattr(module, "side_by_side", side_by_side)
    monkeypatch.setattr(chain, "LARGEST", 40 * ARRAYS * 9)
    for got, wanted in zip(hmm_all(hmm, ys), together, strict=True):
        assert_allclose(got.prob, wanted.prob, atol=1e-12)
        assert_array_equal(got.path, wanted.path)
        assert got.log_evidence == pytest.approx(wanted.log_evidence)
    assert sizes == [100, 30, 15]


# Learning


@pytest.mark.parametrize("prior", [0.0, 0.3, 1.0])
def test_the_penalised_value_never_falls(prior, rng):
    hmm = random_hmm(3, rng, M=3)
    ys = [drawn(hmm, T, rng)[1] for T in (40, 60, 1, 50)]
    weights = np.array([1.0, 0.5, 3.0, 2.0])
    fit = learnt(ys, weights=weights, states=3, rounds=30, prior=prior, tolerance=-np.inf)
    assert len(fit.values) == 30
    # Rounding in sums of log-likelihoods near 1000.
    assert np.diff(fit.values).min() > -1e-9
    assert fit.values[-1] > fit.values[0] + 1.0


def test_learning_ends_at_a_maximum_of_evidence_plus_log_prior(rng):
    hmm = random_hmm(2, rng)
    ys = [drawn(hmm, 5, rng)[1] for _ in range(4)]
    weights = np.array([0.5, 1.5, 1.0, 1.0])
    fit = learnt(ys, weights=weights, states=2, rounds=3000, prior=1.0, tolerance=1e-14)
    best = penalised(fit.hmm, ys, weights)
    assert fit.values[-1] == pytest.approx(best, rel=1e-9)  # the variance that anything is taken to have
    for _ in range(30):  # any step away is down, to second order
        pi0 = fit.hmm.pi0 * np.exp(1e-3 * rng.normal(size=2))
        Pi = fit.hmm.Pi * np.exp(1e-3 * rng.normal(size=(2, 2)))
        root = np.eye(2) + 1e-3 * rng.normal(size=(2, 2, 2))
        near = replace(
            fit.hmm,
            pi0=pi0 / pi0.sum(),
            Pi=Pi / Pi.sum(1, keepdims=True),
            mean=fit.hmm.mean + 1e-3 * rng.normal(size=(2, 2)),
            cov=root @ fit.hmm.cov @ root.swapaxes(-1, -2),
        )
        # What EM has left to climb at a relative rise of 1e-14 a round.
        assert penalised(near, ys, weights) < best + 1e-10


def test_learning_agrees_with_hmmlearn_without_a_prior(rng):
    hmmlearn = pytest.importorskip("hmmlearn.hmm")
    hmm = random_hmm(3, rng, apart=4.0)
    ys = [drawn(hmm, T, rng)[1] for T in (80, 60, 90)]
    fit = learnt(ys, states=3, rounds=100, prior=0.0, tolerance=1e-15)
    other = hmmlearn.GaussianHMM(3, covariance_type="full", n_iter=100, tol=1e-12, init_params="")
    other.covars_prior, other.covars_weight = 0.0, -3.0  # hmmlearn's own prior off
    other.startprob_, other.transmat_ = np.full(3, 1 / 3), np.full((3, 3), 1 / 3)
    other.means_, other.covars_ = fit.hmm.mean + 0.1, fit.hmm.cov + 0.1 * np.eye(2)
    other.fit(np.concatenate(ys), [80, 60, 90])
    assert other.score(np.concatenate(ys), [80, 60, 90]) == pytest.approx(fit.values[-1], rel=1e-7)
    assert_allclose(fit.hmm.mean, other.means_, atol=1e-4)  # both still climb a little
    assert_allclose(fit.hmm.Pi, other.transmat_, atol=1e-4)


def test_states_well_apart_are_recovered(rng):
    hmm = random_hmm(3, rng)
    hmm = replace(hmm, mean=[[6.0, 0.0], [-6.0, 0.0], [0.0, 8.0]], Pi=0.85 * np.eye(3) + 0.05)
    draws = [drawn(hmm, 100, rng) for _ in range(6)]
    ys = [y for _, y in draws]
    fit = learnt(ys, states=3, rounds=50)
    order = [int(((fit.hmm.mean - mean) ** 2).sum(1).argmin()) for mean in hmm.mean]
    assert sorted(order) == [0, 1, 2]
    # 200 frames a state: standard errors of means 0.1, of Pi 0.03; three of them.
    assert_allclose(fit.hmm.mean[order], hmm.mean, atol=0.4)
    assert_allclose(fit.hmm.cov[order], hmm.cov, atol=0.6)
    assert_allclose(fit.hmm.Pi[np.ix_(order, order)], hmm.Pi, atol=0.1)
    right = [
        np.mean(np.array(order)[s] == p.path) for (s, _), p in zip(draws, hmm_all(fit.hmm, ys), strict=True)
    ]
    assert np.mean(right) > 0.99
    assert fit.hmm.labels == ("walk",) * 3


def test_learning_stops_in_time_and_keeps_the_best_round(rng):
    hmm = random_hmm(2, rng)
    ys = [drawn(hmm, 50, rng)[1]]
    assert len(learnt(ys, states=2, rounds=3, tolerance=-np.inf).values) == 3
    fit = learnt(ys, states=2, rounds=50, tolerance=1e-3)
    assert len(fit.values) < 50
    gained = hmm_all(fit.hmm, ys)[0].log_evidence
    other = learnt(ys, states=2, rounds=1)
    assert gained > hmm_all(other.hmm, ys)[0].log_evidence


def test_units_do_not_matter(rng):
    hmm = random_hmm(3, rng)
    ys = [drawn(hmm, 60, rng)[1] for _ in range(3)]
    scale = np.array([57.3, 0.01])
    one, other = (
        learnt(data, states=3, rounds=50, tolerance=-np.inf).hmm for data in (ys, [y * scale for y in ys])
    )
    # The variance that anything is taken to have, 1e-10, against 0.01 squared times 1.
    assert_allclose(other.mean / scale, one.mean, atol=1e-4)
    assert_allclose(other.cov / scale[:, None] / scale, one.cov, atol=1e-4)
    assert_allclose(other.Pi, one.Pi, atol=1e-4)


def test_a_state_that_no_frame_is_left_to_stays_finite(rng):
    ys = [np.repeat([[0.0, 1.0], [2.0, 3.0]], 5, axis=0)]  # two poses for four states
    for prior in (0.3, 1.0):
        fit = learnt(ys, states=4, rounds=50, prior=prior)
        assert np.isfinite(fit.values).all()
        assert np.linalg.eigvalsh(fit.hmm.cov).min() > 0.0
        assert_allclose(fit.hmm.Pi.sum(1), 1.0, atol=1e-12)


def test_without_a_prior_a_state_that_is_never_visited_keeps_what_it_had(rng):
    ys = [np.repeat(rng.normal(size=(3, 2)), 4, axis=0)]  # three poses for four states: one takes all
    hmm = learnt(ys, states=4, rounds=5, prior=0.0, tolerance=-np.inf).hmm
    assert_allclose(hmm.pi0, [1.0, 0.0, 0.0, 0.0], atol=1e-12)
    assert_allclose(hmm.Pi[1:], 0.25, atol=1e-12)
    assert_allclose(hmm.mean, np.tile(ys[0].mean(0), (4, 1)), atol=1e-12)
    assert_allclose(hmm.cov[0], np.cov(ys[0].T, bias=True), atol=1e-12)
    assert_allclose(hmm.cov[1], np.diag(ys[0].var(0)), atol=1e-9)  # the start, with 1e-10 more


def test_poses_that_never_move_are_learnt_as_still(rng):
    ys = [np.full((20, 2), 0.3), np.full((9, 2), 0.3)]
    fit = learnt(ys, states=2, rounds=50)
    assert_allclose(fit.hmm.mean, 0.3, atol=1e-12)
    assert np.isfinite(fit.values).all()
    hmm = random_hmm(2, rng)
    ys = [np.hstack([drawn(hmm, 40, rng)[1], np.full((40, 1), 0.3)])]
    fit = learnt(ys, states=2, rounds=50)
    assert_allclose(fit.hmm.mean[:, 2], 0.3, atol=1e-9)
    assert np.linalg.eigvalsh(fit.hmm.cov).min() > 0.0


# Joining, and errors


def test_joined_models_keep_their_motions_but_for_the_crossing(rng):
    walk, jog = (replace(random_hmm(K, rng), labels=(label,) * K) for K, label in ((2, "walk"), (3, "jog")))
    both = combine_hmms([walk, jog], crossing=0.02)
    assert both.labels == ("walk", "walk", "jog", "jog", "jog")
    assert_array_equal(both.Pi, blocks([walk.Pi, jog.Pi], 0.02))
    assert_allclose(both.pi0, np.r_[walk.pi0, jog.pi0] / 2, atol=1e-15)
    assert_array_equal(both.mean, np.r_[walk.mean, jog.mean])
    assert_array_equal(both.cov, np.r_[walk.cov, jog.cov])
    assert_same_hmm(combine_hmms([walk]), walk, atol=1e-15)
    with pytest.raises(ValueError, match="must share freedoms and frame rate; learn them alike"):
        combine_hmms([walk, replace(jog, fps=25.0)])


def test_models_that_cannot_be_are_named(rng):
    hmm = random_hmm(2, rng)
    with pytest.raises(ValueError, match="pi0 rows must be probabilities"):
        replace(hmm, pi0=[1.5, -0.5])
    with pytest.raises(ValueError, match=r"mean must have shape \(2, 2\); got \(2, 3\)"):
        replace(hmm, mean=np.zeros((2, 3)))
    assert not hmm.mean.flags.writeable
