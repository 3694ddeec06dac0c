"""What every inference keeps to: approximate Viterbi, GPB2 and structured variational inference alike."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian
from dynamics.gpb2 import gpb2_all
from dynamics.variational import variational_all
from dynamics.viterbi import viterbi_all
from tests.oracles import (
    SMOOTHED,
    assert_gaussian,
    assert_given_path,
    assert_same,
    drawn,
    enumerated,
    given_path,
    random_slds,
    sample,
    single,
)

FIELDS = ("pi0", "A", "b", "Q", "mean0", "cov0")


@pytest.fixture(params=[viterbi_all, gpb2_all, variational_all])
def infer(request):
    return request.param


def chosen(slds, states):
    """The system of some of the states, or of all in another order; pi0 and Pi as they are."""
    fields = {name: getattr(slds, name)[states] for name in FIELDS}
    labels = tuple(slds.labels[s] for s in states)
    return replace(slds, Pi=slds.Pi[np.ix_(states, states)], labels=labels, **fields)


@pytest.mark.parametrize(
    ("order", "T", "gaps"),
    [(1, 1, False), (1, 2, True), (1, 7, True), (2, 1, True), (2, 2, False), (2, 7, True)],
)
def test_with_one_switching_state_inference_is_the_kalman_smoother(infer, order, T, gaps, rng):
    slds = random_slds(1, order=order, rng=rng)
    y = drawn(slds, T, rng, gaps=gaps)
    got = single(infer)(slds, y)
    assert_given_path(got, slds, y, [0] * T)
    assert_array_equal(got.prob, 1.0)
    mean, cov, _ = given_path(slds, y, [0] * T)
    assert_gaussian(got.start_moments(), got.states[:1], atol=SMOOTHED)
    steps, n = got.step_moments(), 4 * order
    assert steps.mean.shape == (T - 1, 1, n)
    for t in range(T - 1):
        both = [t + 1, t]
        assert_allclose(steps.mean[t, 0], mean[both].ravel(), atol=SMOOTHED)
        assert_allclose(steps.cov[t, 0], cov[both][:, :, both].reshape(n, n), atol=SMOOTHED)


MANY = (5, 1, 60, 2, 33, 60, 1, 59)


@pytest.mark.parametrize(
    ("order", "restless", "lengths"),
    [(1, False, MANY), (2, False, MANY), (2, True, MANY), (2, False, (2, 1)), (1, False, (2, 1, 1))],
)
def test_sequences_of_unequal_lengths_are_each_on_its_own(infer, order, restless, lengths, rng):
    slds = random_slds(4, order=order, rng=rng)
    if restless:  # no state may follow itself, not even where a shorter sequence has ended
        slds = replace(slds, Pi=(1.0 - np.eye(4)) / 3.0)
    ys = [drawn(slds, T, rng, gaps=T % 2 == 0 and T > 2) for T in lengths]
    hints = [rng.normal(size=(T, 4)) for T in lengths]
    for got, y, hint in zip(infer(slds, ys, hints), ys, hints, strict=True):
        assert got.states.mean.shape == (len(y), 2 * order)
        assert_same(got, single(infer)(slds, y, hint))  # batched otherwise


def test_more_sequences_than_a_batch_come_back_in_order(infer, rng):
    slds = random_slds(2, d=1, rng=rng)
    ys = [drawn(slds, 1 + n % 5, rng) for n in range(300)]
    got = infer(slds, ys)
    for n in range(0, 300, 7):
        assert got[n].log_evidence == pytest.approx(single(infer)(slds, ys[n]).log_evidence, rel=1e-9)


def test_no_sequences_give_no_posteriors(infer, rng):
    assert infer(random_slds(2, rng=rng), []) == []


@pytest.mark.parametrize(("order", "f"), [(1, 1e-8), (2, 1e8), (2, 57.3)])
def test_units_do_not_matter(infer, order, f, rng):
    slds = random_slds(3, order=order, rng=rng)
    y = drawn(slds, 30, rng, gaps=True)
    squares = {name: f**2 * getattr(slds, name) for name in ("Q", "R", "cov0")}
    one = single(infer)(slds, y)
    other = single(infer)(replace(slds, b=f * slds.b, mean0=f * slds.mean0, **squares), f * y)
    count = np.count_nonzero(~np.isnan(y))
    assert other.log_evidence == pytest.approx(one.log_evidence - count * np.log(f), rel=1e-9)
    assert_allclose(other.prob, one.prob, atol=1e-8)
    assert_allclose(other.states.mean / f, one.states.mean, atol=1e-8)
    assert_allclose(other.states.cov / f**2, one.states.cov, atol=1e-8)


@pytest.mark.parametrize("order", [1, 2])
def test_where_the_origin_lies_does_not_matter(infer, order, rng):
    slds = random_slds(3, order=order, rng=rng)
    y, shift = drawn(slds, 30, rng, gaps=True), np.tile([100.0, -40.0], order)
    moved = replace(slds, b=slds.b + shift - slds.A @ shift, mean0=slds.mean0 + shift)
    one, other = single(infer)(slds, y), single(infer)(moved, y + shift[:2])
    # Coordinates of 100 lose 1e-14, against noise of 0.3 and gains up to 1e3.
    assert other.log_evidence == pytest.approx(one.log_evidence, rel=1e-9)
    assert_allclose(other.prob, one.prob, atol=1e-8)
    assert_gaussian(other.states, Gaussian(one.states.mean + shift, one.states.cov), atol=1e-8)


def test_where_states_are_told_apart_it_is_the_exact_posterior(infer, rng):
    distinct = np.array([[5.0, 5.0], [-5.0, -5.0]])
    slds = replace(random_slds(2, rng=rng), b=distinct, mean0=distinct)
    s, _, y = sample(slds, 7, rng)
    exact, got = enumerated(slds, y), single(infer)(slds, y)
    assert_array_equal(got.path, s)
    # One path has all but 1e-9 of the exact posterior, and nothing else is approximated.
    assert exact.prob.max(1).min() > 1.0 - 1e-9
    assert got.log_evidence == pytest.approx(exact.log_evidence, abs=1e-8)
    assert_allclose(got.prob, exact.prob, atol=1e-8)
    assert_allclose(got.states.mean, exact.states.mean, atol=1e-7)


def test_covariances_stay_symmetric_positive_definite_over_2000_frames(infer, rng):
    slds = random_slds(2, d=1, order=2, noise=1e-3, rng=rng)
    slds = replace(slds, R=[[1e-6]], cov0=1e6 * slds.cov0)
    y = np.tile(drawn(slds, 200, rng), (10, 1))
    y[np.arange(2_000) % 100 < 30] = np.nan  # hidden for 30 frames in every 100
    got = single(infer)(slds, y)
    cov = got.states.cov
    assert_array_equal(cov[..., 0, 1], cov[..., 1, 0])
    assert (np.linalg.eigvalsh(cov)[..., 0] > 0).all()
    assert_allclose(got.prob.sum(1), 1.0, atol=1e-9)  # rounding adds up over the frames
    assert np.isfinite(got.log_evidence)


def test_a_state_that_can_never_be_entered_changes_nothing(infer, rng):
    Pi = np.array([[0.7, 0.3, 0.0], [0.3, 0.7, 0.0], [0.0, 0.0, 1.0]])
    three = replace(random_slds(3, order=2, rng=rng), Pi=Pi, pi0=[0.5, 0.5, 0.0])
    two = chosen(three, [0, 1])
    y = drawn(two, 25, rng, gaps=True)
    got, want = single(infer)(three, y), single(infer)(two, y)
    assert got.log_evidence == pytest.approx(want.log_evidence, rel=1e-11)
    assert_array_equal(got.path, want.path)
    assert_array_equal(got.prob[:, 2], 0.0)
    assert_allclose(got.prob[:, :2], want.prob, atol=SMOOTHED)
    assert_gaussian(got.states, want.states, atol=SMOOTHED)
    for moments in (got.start_moments(), got.step_moments()):
        assert np.isfinite(moments.mean).all()
        assert np.isfinite(moments.cov).all()


def test_a_transition_that_cannot_be_is_never_taken(infer, rng):
    Pi = np.array([[0.6, 0.4, 0.0], [0.0, 0.6, 0.4], [0.4, 0.0, 0.6]])  # a ring
    slds = replace(random_slds(3, rng=rng), Pi=Pi, pi0=[1.0, 0.0, 0.0])
    taken = np.zeros((3, 3))
    for y in [drawn(random_slds(3, rng=rng), 40, rng), *(drawn(slds, 40, rng) for _ in range(3))]:
        got = single(infer)(slds, y)
        assert np.isfinite(got.log_evidence)
        assert_allclose(got.prob[0], [1.0, 0.0, 0.0], atol=1e-15)
        assert np.isfinite(got.step_moments().cov).all()
        taken += got.pair.sum(0)
    assert taken[Pi == 0.0].sum() == 0.0
    assert (taken[Pi > 0.0] > 0).all()  # the data did call for switches


@pytest.mark.parametrize("order", [1, 2])
def test_hints_that_leave_one_path_give_that_paths_exact_answer(infer, order, rng):
    slds = random_slds(3, order=order, rng=rng)
    y, path = drawn(slds, 8, rng, gaps=True), rng.integers(3, size=8)
    got = single(infer)(slds, y, np.where(np.arange(3) == path[:, None], -1.0, -np.inf))
    assert_array_equal(got.path, path)
    assert_given_path(replace(got, log_evidence=got.log_evidence + 8.0), slds, y, path)


@pytest.mark.parametrize("deviations", [50.0, 1e6])
def test_an_outlier_leaves_everything_finite(infer, deviations, rng):
    slds = random_slds(4, order=2, rng=rng)
    y = drawn(slds, 30, rng)
    y[10] += deviations * np.sqrt(np.diag(slds.R))
    got = single(infer)(slds, y)
    assert_allclose(got.prob.sum(1), 1.0, rtol=1e-9)
    for moments in (got.states, got.start_moments(), got.step_moments()):
        assert np.isfinite(moments.mean).all()
        assert np.isfinite(moments.cov).all()
    # The dynamics are as noisy as the measurement, so half of the outlier may be taken for motion.
    assert -(deviations**2) < got.log_evidence < -0.1 * deviations**2


def test_sequences_without_a_frame_are_named(infer, rng):
    slds = random_slds(2, rng=rng)
    y = drawn(slds, 5, rng)
    with pytest.raises(ValueError, match="every sequence must have a frame at least"):
        infer(slds, [y, y[:0]])
