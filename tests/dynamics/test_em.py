"""Learning: EM's promises with exact posteriors, and what must not matter."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.em import Options, anywhere, data_prior, learn, log_prior, maximise
from dynamics.gaussian import Gaussian
from dynamics.kalman import predict
from dynamics.regression import form
from dynamics.viterbi import viterbi_all
from tests.oracles import (
    central_difference,
    enumerated_all,
    expected_log_joint,
    random_slds,
    sum_over_paths,
)

FIELDS = ("pi0", "Pi", "A", "b", "Q", "R", "mean0", "cov0")
LEARNT = {"fps": 30.0, "label": "walk"}


def drawn(slds, lengths, rng):
    return [slds.sample(T, rng)[2] for T in lengths]


def setting(order, travelling, rng, *, prior, K=2, lengths=(5, 4, 5)):
    """A system, sequences from another one, and what `maximise` needs."""
    slds = random_slds(K, order=order, travelling=travelling, rng=rng)
    ys = drawn(random_slds(K, order=order, travelling=travelling, rng=rng), lengths, rng)
    shape = form(slds.names, slds.travelling, order)
    return slds, ys, shape, data_prior(ys, shape, Options(states=K, order=order, prior=prior))


def assert_same_system(one, other, *, rtol, atol=1e-12):
    for name in FIELDS:
        assert_allclose(getattr(one, name), getattr(other, name), rtol=rtol, atol=atol, err_msg=name)


def gait(n, T, d, rng, *, K=4):
    """Sequences of a switching oscillation whose first freedom walks on."""
    slds = random_slds(K, d=d, order=2, travelling=("a",), noise=0.03, stay=0.9, rng=rng)
    return drawn(slds, [T] * n, rng), slds.names


# EM with exact posteriors


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("travelling", [(), ("a",)])
def test_a_round_with_exact_posteriors_never_lowers_the_evidence(order, travelling, rng):
    # Order 2 needs more steps than coefficients, or maximum likelihood fits some exactly.
    lengths = (5, 6, 5) if order == 1 else (6, 6, 6, 6, 6)
    slds, ys, shape, prior = setting(order, travelling, rng, prior=0.0, lengths=lengths)
    values = [sum(sum_over_paths(slds, y) for y in ys)]
    for _ in range(4):
        slds = maximise(slds, ys, enumerated_all(slds, ys), shape, prior, np.ones(len(ys)))
        values.append(sum(sum_over_paths(slds, y) for y in ys))
    # Rounding in sums of log-likelihoods near 100.
    assert np.diff(values).min() > -1e-8
    assert values[-1] > values[0] + 1.0


@pytest.mark.parametrize("order", [1, 2])
def test_learning_with_exact_posteriors_never_lowers_evidence_plus_log_prior(order, rng):
    ys = drawn(random_slds(2, order=order, travelling=("a",), rng=rng), (5, 6, 5, 6), rng)
    options = Options(states=2, order=order, rounds=5, tolerance=-np.inf)
    fit = learn(ys, names=("a", "b"), travelling=("a",), options=options, infer=enumerated_all, **LEARNT)
    assert len(fit.values) == 5
    # Rounding in sums of log-likelihoods near 100.
    assert np.diff(fit.values).min() > -1e-8


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("prior", [0.3, 1.0, 5.0])
def test_with_one_switching_state_the_penalised_value_never_falls(order, prior, rng):
    ys = drawn(random_slds(2, order=order, travelling=("a",), rng=rng), (20, 30, 25), rng)
    options = Options(states=1, order=order, prior=prior, rounds=25, tolerance=-np.inf)
    fit = learn(ys, names=("a", "b"), travelling=("a",), options=options, **LEARNT)
    assert len(fit.values) == 25
    # Rounding in sums of log-likelihoods near 1000.
    assert np.diff(fit.values).min() > -1e-8
    assert fit.values[-1] > fit.values[0]


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("travelling", [(), ("a",)])
@pytest.mark.parametrize("prior", [0.0, 1.0])
def test_the_m_step_is_a_maximum_of_the_expected_log_joint_plus_log_prior(order, travelling, prior, rng):
    lengths = (6, 6, 6, 6)
    slds, ys, shape, priors = setting(order, travelling, rng, prior=prior, lengths=lengths)
    weights = np.array([1.0, 0.5, 2.0, 1.0])
    posteriors = enumerated_all(slds, ys)
    best = maximise(slds, ys, posteriors, shape, priors, weights)

    def value(system):
        return expected_log_joint(system, ys, posteriors, weights) + log_prior(system, shape, priors)

    d = len(slds.names)
    for name in FIELDS:
        there = getattr(best, name)
        direction = rng.normal(size=there.shape)
        if name in ("pi0", "Pi"):  # rows keep summing to one
            direction = there * (direction - (there * direction).sum(-1, keepdims=True))
        if name in ("Q", "R", "cov0"):  # positive definite in proportion to what is there
            direction = there @ direction @ there
            direction = 0.5 * (direction + np.swapaxes(direction, -1, -2))
        if name == "A":  # what the form leaves free
            direction[:, d:] = 0.0
            direction[:, :d] = rng.normal(size=(slds.K, d, len(shape.regard))) @ shape.regard
        if name == "b":
            direction[:, d:] = 0.0
        direction /= np.abs(direction).max() / np.abs(there).max()

        def along(step, name=name, there=there, direction=direction):
            return value(replace(best, **{name: there + float(step) * direction}))

        slope = central_difference(along, np.array(0.0), step=1e-5)
        bend = (along(1e-3) - 2.0 * along(0.0) + along(-1e-3)) / 1e-6
        assert bend < 0.0, name
        # Of a parabola of this bend, a slope of 1e-4 bend means 1e-4 of the parameter away from its top;
        # differences of values near 100 over 1e-5 are exact to 1e-8.
        assert abs(slope[0]) < 1e-6 + 1e-5 * abs(bend), name


# What learning returns


def test_the_best_round_is_kept_when_a_later_one_is_worse(rng):
    ys, names = gait(4, 30, 2, rng)
    seen = []

    def infer(slds, sequences):
        posteriors = viterbi_all(slds, sequences)
        seen.append(slds)
        if len(seen) == 4:
            posteriors = [replace(p, log_evidence=p.log_evidence - 1000.0) for p in posteriors]
        return posteriors

    options = Options(states=2, rounds=10, tolerance=-np.inf)
    fit = learn(ys, names=names, travelling=("a",), infer=infer, options=options, **LEARNT)
    best = int(np.argmax(fit.values))
    assert len(fit.values) == 4
    assert "fell" in fit.stopped
    assert best != 3
    assert_same_system(fit.slds, seen[best], rtol=0.0, atol=0.0)


@pytest.mark.parametrize("seed", range(4))
def test_the_returned_system_has_the_best_value(seed):
    rng = np.random.default_rng(seed)
    ys, names = gait(5, 30, 2, rng)
    options = Options(states=4, rounds=12, tolerance=1e-12, seed=seed)
    fit = learn(ys, names=names, travelling=("a",), options=options, **LEARNT)
    ys = [y - y[0] * [1.0, 0.0] for y in ys]  # places count from the first frame
    shape = form(names, ("a",), 2)
    value = sum(p.log_evidence for p in viterbi_all(fit.slds, ys))
    value += log_prior(fit.slds, shape, data_prior(ys, shape, options))
    assert value == pytest.approx(max(fit.values), rel=1e-12)  # the same sums again


def test_learning_says_why_it_stopped_and_reports_every_round(rng):
    ys, names = gait(3, 20, 2, rng)
    rounds = []
    options = Options(states=1, rounds=3, tolerance=-np.inf)
    fit = learn(
        ys,
        names=names,
        travelling=(),
        options=options,
        progress=lambda i, value: rounds.append((i, value)),
        **LEARNT,
    )
    assert fit.stopped == "reached 3 rounds"
    assert rounds == list(enumerate(fit.values))
    fit = learn(
        ys, names=names, travelling=(), options=Options(states=1, rounds=50, tolerance=1e-2), **LEARNT
    )
    assert "less than the tolerance" in fit.stopped
    assert len(fit.values) < 50


@pytest.mark.parametrize("states", [1, 2, 4, 6])
def test_eighteen_sequences_of_fifty_frames_stay_finite_and_positive_definite(states, rng):
    ys, names = gait(18, 50, 8, rng)
    fit = learn(ys, names=names, travelling=("a",), options=Options(states=states), **LEARNT)
    slds = fit.slds
    assert slds.A.shape == (states, 16, 16)
    assert np.isfinite(fit.values).all()
    for cov in (slds.Q[:, :8, :8], slds.R, slds.cov0):
        assert np.linalg.eigvalsh(cov).min() > 0.0
    for p in viterbi_all(slds, ys):
        assert np.isfinite(p.states.mean).all()
        # Exact measurements of the last pose leave covariances of 1e-6; rounding is far below.
        assert np.linalg.eigvalsh(p.states.cov).min() > -1e-12


def test_switches_between_two_very_different_poses_are_found(rng):
    slds = random_slds(2, noise=0.1, stay=0.95, rng=rng)
    slds = replace(
        slds,
        A=np.stack([0.5 * np.eye(2)] * 2),
        b=[[1.0, 1.0], [-1.0, -1.0]],
        mean0=[[2.0, 2.0], [-2.0, -2.0]],
    )
    draws = [slds.sample(60, rng) for _ in range(8)]
    options = Options(states=2, order=1, rounds=20)
    fit = learn([y for _, _, y in draws], names=slds.names, travelling=(), options=options, **LEARNT)
    posteriors = viterbi_all(fit.slds, [y for _, _, y in draws])
    right = np.mean([np.mean(p.path == s) for p, (s, _, _) in zip(posteriors, draws, strict=True)])
    assert max(right, 1.0 - right) > 0.9


@pytest.mark.parametrize("moving", [2, 1])
def test_freedoms_that_never_move_are_learnt_as_still(moving, rng):
    ys, _ = gait(6, 40, 2, rng)
    ys = [np.hstack([y[:, :moving], np.full((40, 3 - moving), 0.3)]) for y in ys]
    options = Options(states=2, rounds=10, tolerance=-np.inf)
    fit = learn(ys, names=("a", "b", "c"), travelling=("a",), options=options, **LEARNT)
    assert np.isfinite(fit.values).all()
    for p in viterbi_all(fit.slds, ys):
        # They are taken to spread by 1e-5.
        assert_allclose(p.states.mean[:, moving:3], 0.3, atol=1e-4)


# What must not matter


@pytest.mark.parametrize("freedom", ["all", "travelling", "other"])
def test_units_do_not_matter(freedom, rng):
    ys, names = gait(6, 40, 3, rng, K=3)
    scale = {"all": np.full(3, 57.3), "travelling": [57.3, 1.0, 1.0], "other": [1.0, 57.3, 1.0]}[freedom]
    scale = np.asarray(scale)

    def fitted(factor):
        data = [y * factor for y in ys]
        slds = learn(data, names=names, travelling=("a",), options=Options(states=3), **LEARNT).slds
        return slds, [p.path for p in viterbi_all(slds, data)]

    (one, paths), (other, scaled_paths) = fitted(np.ones(3)), fitted(scale)
    for path, scaled in zip(paths, scaled_paths, strict=True):
        assert_array_equal(path, scaled)
    assert len(set(np.concatenate(paths))) > 1
    twice = np.tile(scale, 2)
    # The start blurs every pose by an absolute 1e-9, against noise near 1e-3.
    assert_allclose(other.A / (twice[:, None] / twice), one.A, atol=1e-4)
    assert_allclose(other.b / twice, one.b, atol=1e-4)
    assert_allclose((other.Q / (twice[:, None] * twice))[:, :3, :3], one.Q[:, :3, :3], rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("order", [1, 2])
def test_where_the_figure_stands_does_not_matter(order, rng):
    ys = drawn(random_slds(2, order=order, travelling=("a",), rng=rng), (30, 40, 35), rng)
    far = [y + np.array([100.0 * (n + 1), 0.0]) for n, y in enumerate(ys)]
    options = Options(states=2, order=order)
    one, other = (
        learn(data, names=("a", "b"), travelling=("a",), options=options, **LEARNT).slds for data in (ys, far)
    )
    # Coordinates of 300 lose 6e-14; ten rounds amplify that.
    for name in ("A", "b", "Q"):
        assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-6, atol=1e-8)
    x, shift = rng.normal(size=order * 2), np.tile([250.0, 0.0], order)
    P = np.broadcast_to(np.eye(order * 2), (2, order * 2, order * 2))
    here = predict(Gaussian(np.stack([x, x]), P), other.A, other.b, other.Q)
    there = predict(Gaussian(np.stack([x, x]) + shift, P), other.A, other.b, other.Q)
    assert_allclose(there.mean, here.mean + shift, atol=1e-10)  # coefficients near 1 times 250
    assert_array_equal(there.cov, here.cov)


@pytest.mark.parametrize("order", [1, 2])
def test_places_of_the_sequences_do_not_enter_the_m_step(order, rng):
    slds, ys, shape, prior = setting(order, ("a",), rng, prior=0.0, lengths=(30, 30))
    posteriors = viterbi_all(slds, ys)
    shift = np.tile([50.0, 0.0], order)
    moved = [replace(p, states=Gaussian(p.states.mean + shift, p.states.cov)) for p in posteriors]
    one = maximise(slds, ys, posteriors, shape, prior, np.ones(2))
    other = maximise(slds, [y + shift[:2] for y in ys], moved, shape, prior, np.ones(2))
    # Second moments of 60 * 50^2 carry rounding of 1e-11, amplified by condition numbers below 1e3.
    for name in ("A", "b", "Q", "R"):
        assert_allclose(getattr(one, name), getattr(other, name), atol=1e-7)


@pytest.mark.parametrize("order", [1, 2])
def test_doubling_the_data_with_maximum_likelihood_changes_nothing(order, rng):
    slds, ys, shape, prior = setting(order, ("a",), rng, prior=0.0, lengths=(30, 20, 25))
    posteriors = viterbi_all(slds, ys)
    one = maximise(slds, ys, posteriors, shape, prior, np.ones(3))
    two = maximise(slds, ys * 2, posteriors * 2, shape, prior, np.ones(6))
    assert_same_system(one, two, rtol=1e-8, atol=1e-10)  # the same sums in another order


def test_a_weight_of_two_is_the_sequence_twice(rng):
    slds, ys, shape, prior = setting(2, ("a",), rng, prior=1.0, lengths=(30, 20, 25))
    posteriors = viterbi_all(slds, ys)
    weighted = maximise(slds, ys, posteriors, shape, prior, np.array([2.0, 1.0, 1.0]))
    twice = maximise(slds, [ys[0], *ys], [posteriors[0], *posteriors], shape, prior, np.ones(4))
    plain = maximise(slds, ys, posteriors, shape, prior, np.ones(3))
    assert_same_system(weighted, twice, rtol=1e-8, atol=1e-10)  # the same sums in another order
    assert np.abs(weighted.A - plain.A).max() > 1e-3


def test_the_order_of_the_sequences_changes_nothing(rng):
    ys, names = gait(5, 30, 2, rng)
    one, other = (
        learn(data, names=names, travelling=("a",), options=Options(states=1), **LEARNT)
        for data in (ys, ys[::-1])
    )
    assert_same_system(one.slds, other.slds, rtol=1e-6, atol=1e-9)  # sums in another order, ten rounds
    slds, ys, shape, prior = setting(2, ("a",), rng, prior=1.0, lengths=(30, 20, 25))
    posteriors = viterbi_all(slds, ys)
    weights = np.array([1.0, 2.0, 0.5])
    forwards = maximise(slds, ys, posteriors, shape, prior, weights)
    backwards = maximise(slds, ys[::-1], posteriors[::-1], shape, prior, weights[::-1])
    assert_same_system(forwards, backwards, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("prior", [0.0, 1.0])
def test_a_state_that_is_never_entered_stays_finite(prior, rng):
    slds, ys, shape, priors = setting(2, ("a",), rng, prior=prior, K=3, lengths=(30, 30))
    ring = np.array([[0.7, 0.3, 0.0], [0.3, 0.7, 0.0], [0.0, 0.0, 1.0]])
    slds = replace(slds, Pi=ring, pi0=[0.5, 0.5, 0.0])
    fitted = maximise(slds, ys, viterbi_all(slds, ys), shape, priors, np.ones(2))
    assert np.linalg.eigvalsh(fitted.Q[:, :2, :2]).min() > 0.0
    if prior == 0.0:  # nothing was learnt about it
        for name in ("A", "b", "Q", "mean0", "cov0"):
            assert_array_equal(getattr(fitted, name)[2], getattr(slds, name)[2])


# Starting anywhere in the motion


@pytest.mark.parametrize("order", [1, 2])
def test_a_start_anywhere_has_the_moments_of_all_frames(order, rng):
    slds = random_slds(2, order=order, travelling=("a",), noise=0.1, rng=rng)
    ys = drawn(slds, (400, 400), rng)
    posteriors = viterbi_all(slds, ys)
    start = anywhere(slds, posteriors)
    x = np.concatenate([p.states.mean[1:] for p in posteriors])
    s = np.concatenate([p.path[1:] for p in posteriors])
    place = np.tile([1.0, 0.0], order) * x[:, :1]
    for k in range(2):
        # Each entry plus the floor of 1e-4 for places and 1e-6 for the rest.
        assert_allclose(start.mean0[k], (x - place)[s == k].mean(0), atol=1e-10)
        assert_allclose(start.cov0[k], np.cov((x - place)[s == k].T, bias=True), atol=1.1e-4)
        assert start.pi0[k] == pytest.approx(np.mean(s == k), rel=1e-12)
    assert np.linalg.eigvalsh(start.cov0).min() > 0.0
    assert_array_equal(start.A, slds.A)


# Errors


def test_sequences_that_cannot_be_learnt_from_are_named():
    def learnt(ys):
        return learn(ys, names=("a", "b"), travelling=(), **LEARNT)

    good, gappy = np.zeros((9, 2)), np.zeros((9, 2))
    gappy[4, 1] = np.nan
    with pytest.raises(ValueError, match="at least one sequence; got none"):
        learnt([])
    with pytest.raises(ValueError, match=r"sequence 1 must be \(T, 2\) with T >= 3; got \(2, 2\)"):
        learnt([good, good[:2]])
    with pytest.raises(ValueError, match=r"sequence 0 must be \(T, 2\) with T >= 3; got \(9, 3\)"):
        learnt([np.zeros((9, 3))])
    with pytest.raises(ValueError, match="sequence 2 has gaps; learn from sequences without missing"):
        learnt([good, good, gappy])
