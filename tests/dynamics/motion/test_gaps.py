"""Filled gaps against conditioning the joint Gaussian and against sums over all switching paths."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian
from dynamics.motion import gaps
from dynamics.motion.gaps import interpolate
from dynamics.motion.rate import by_motion
from tests.oracles import SMOOTHED, assert_gaussian, every_path, given_path, log_density, random_slds, sample


def anywhere(slds, y):
    """The system and the sequence as filling sees them: started anywhere, places from the first measured."""
    moves = np.array([float(name in slds.travelling) for name in slds.names])
    wide = np.tile(np.diag(moves), (slds.order, slds.order))
    place = np.array(
        [m * next((v for v in column if v == v), 0.0) for m, column in zip(moves, y.T, strict=True)]
    )
    return replace(slds, cov0=slds.cov0 + 100.0 * wide), y - place, place


def conditioned(slds, y, path):
    """The poses given y and one path or many, mean (T, M) and cov (T, M, M), and the states' mean."""
    placed, local, place = anywhere(slds, y)
    x, P, _ = given_path(placed, local, path)
    cov = np.stack([slds.C @ P[..., t, :, t, :] @ slds.C.T for t in range(len(y))], axis=-3)
    return Gaussian(x @ slds.C.T + place, cov), x


def with_gaps(y, *spans):
    y = y.copy()
    for start, stop in spans:
        y[start:stop] = np.nan
    return y


GAPS = {
    "at the start": [(0, 3)],
    "at the end": [(7, 10)],
    "in the middle": [(3, 6)],
    "all but one frame": [(0, 4), (5, 10)],
    "none": [],
}


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("where", GAPS)
@pytest.mark.parametrize("recurrent", [True, False])
def test_with_one_switching_state_a_gap_is_filled_by_conditioning(order, where, recurrent, rng):
    slds = random_slds(1, order=order, rng=rng)
    y = with_gaps(sample(slds, 10, rng)[2], *GAPS[where])
    want, _ = conditioned(slds, y, [0] * 10)
    got = interpolate(slds, y, rng, recurrent=recurrent)
    assert_gaussian(got, want, atol=SMOOTHED)
    assert_array_equal(got.cov, np.swapaxes(got.cov, 1, 2))


@pytest.mark.parametrize("order", [1, 2])
def test_single_entries_of_a_pose_are_filled_by_conditioning(order, rng):
    slds = random_slds(1, d=3, order=order, travelling=("b",), rng=rng)
    y = sample(slds, 12, rng)[2] + [0.0, 30.0, 0.0]
    y[rng.random(y.shape) < 0.3] = np.nan
    y[0, 1] = y[-1, 0] = y[5, 2] = np.nan
    want, _ = conditioned(slds, y, [0] * 12)
    got = interpolate(slds, y, rng)
    # Starting anywhere has a variance of 100, which the smoother's blur counts by.
    assert_gaussian(got, want, atol=100 * SMOOTHED)


def test_dense_measurements_are_answered_by_poses_as_they_are_measured(rng):
    slds = replace(random_slds(1, order=2, rng=rng), C=rng.normal(size=(2, 4)))
    y = with_gaps(sample(slds, 8, rng)[2], (3, 5))
    want, _ = conditioned(slds, y, [0] * 8)
    got = interpolate(slds, y, rng)
    assert_gaussian(got, want, atol=SMOOTHED)


@pytest.mark.parametrize("K", [1, 3])
def test_moving_the_figure_moves_the_answer(K, rng):
    slds = random_slds(K, d=2, order=2, travelling=("a",), rng=rng)
    y = with_gaps(sample(slds, 15, rng)[2], (0, 2), (6, 9))
    away = np.array([64.0, 0.0])
    here = interpolate(slds, y, np.random.default_rng(1))
    there = interpolate(slds, y + away, np.random.default_rng(1))
    # Rounding of places near 64.
    assert_gaussian(there, Gaussian(here.mean + away, here.cov), atol=1e-11)


def test_a_place_that_was_never_measured_is_left_open(rng):
    slds = random_slds(2, d=2, order=2, travelling=("a",), rng=rng)
    y = sample(slds, 12, rng)[2]
    y[:, 0] = np.nan
    got = interpolate(slds, y, rng)
    assert np.isfinite(got.mean).all()
    assert (got.cov[:, 0, 0] > 50.0).all()
    assert (got.cov[:, 1, 1] < 5.0).all()


def test_before_the_first_measurement_a_figure_may_have_stood_elsewhere(rng):
    slds = random_slds(1, d=2, order=2, travelling=("a",), rng=rng)
    y = with_gaps(np.cumsum(np.tile([3.0, 0.0], (20, 1)), axis=0), (0, 5))
    drifts = replace(
        slds, A=[[[2, 0, -1, 0], [0, 0.5, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]]], b=np.zeros((1, 4))
    )
    got = interpolate(drifts, y, rng)
    # It moved by 3 a frame, whatever mean0 says; the posterior's own deviation is the measure.
    off = got.mean[:, 0] - 3.0 * np.arange(1, 21)
    assert (np.abs(off) < 3.0 * np.sqrt(got.cov[:, 0, 0])).all()
    assert got.cov[0, 0, 0] < 50.0


@pytest.mark.parametrize("span", [(2, 4), (28, 33), (50, 90), (110, 120)])
def test_a_long_sequence_is_filled_a_piece_at_a_time_as_it_would_be_whole(span, rng, monkeypatch):
    slds = random_slds(1, order=2, rng=rng)
    y = with_gaps(sample(slds, 120, rng)[2], span)
    whole = interpolate(slds, y, rng)
    monkeypatch.setattr(gaps, "PIECE", 20)
    monkeypatch.setattr(gaps, "BEYOND", 25)
    pieces = interpolate(slds, y, rng)
    sd = np.sqrt(np.diagonal(whole.cov, axis1=1, axis2=2))
    assert (np.abs(pieces.mean - whole.mean) < 0.05 * sd).all()
    assert_allclose(pieces.cov, whole.cov, atol=0.02 * sd.max() ** 2)


def test_a_piece_in_which_the_root_was_not_measured_starts_from_where_it_was(rng, monkeypatch):
    slds = random_slds(1, order=2, travelling=("a",), rng=rng)
    y = sample(slds, 60, rng)[2] + [40.0, 0.0]
    y[10:, 0] = np.nan
    whole = interpolate(slds, y, rng)
    monkeypatch.setattr(gaps, "PIECE", 15)
    monkeypatch.setattr(gaps, "BEYOND", 4)
    pieces = interpolate(slds, y, rng)
    off = np.abs(pieces.mean - whole.mean)[:, 0] / np.sqrt(whole.cov[:, 0, 0])
    assert off.max() < 1.0


def test_memory_is_that_of_a_piece_however_long_the_sequence(rng, monkeypatch):
    slds = random_slds(3, order=2, rng=rng)
    monkeypatch.setattr(gaps, "PIECE", 60)
    monkeypatch.setattr(gaps, "BEYOND", 10)

    def peak(T):
        y = with_gaps(sample(slds, T, rng)[2], (20, 30))
        tracemalloc.start()
        try:
            interpolate(slds, y, rng)
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(100)  # what is worked out once
    assert peak(500) < 1.3 * peak(125)


def test_what_was_measured_well_stays(rng):
    slds = replace(random_slds(3, order=2, rng=rng), R=1e-8 * np.eye(2))
    y = sample(slds, 20, rng)[2]
    gappy = with_gaps(y, (8, 11))
    gappy[4, 0] = np.nan
    got = interpolate(slds, gappy, rng)
    seen = ~np.isnan(gappy)
    # Six deviations of the measurement's noise.
    assert_allclose(got.mean[seen], y[seen], atol=6e-4)
    sd = np.sqrt(np.diagonal(got.cov, axis1=1, axis2=2))
    assert (sd[seen] < 1.01e-4).all()
    assert (sd[~seen] > 1e-2).all()


@pytest.mark.parametrize("measured", [0, 3])
def test_one_measured_entry_is_enough(measured, rng):
    slds = random_slds(2, order=2, travelling=("a",), rng=rng)
    y = np.full((4, 2), np.nan)
    y[measured, 1] = 0.3
    got = interpolate(slds, y, rng)
    assert np.isfinite(got.mean).all()
    assert (np.linalg.eigvalsh(got.cov) > 0).all()


def test_the_same_seed_fills_alike_and_another_differently(rng):
    slds = random_slds(3, order=2, stay=0.3, rng=rng)
    y = with_gaps(sample(slds, 30, rng)[2], (10, 20))
    first, again, other = (interpolate(slds, y, np.random.default_rng(seed)) for seed in (5, 5, 6))
    assert_array_equal(first.mean, again.mean)
    assert_array_equal(first.cov, again.cov)
    assert np.abs(first.mean - other.mean).max() > 1e-6


# The switch


def log_region(slds, k, x):
    """log N of the state x in the region of state k, its place left out."""
    take = slds.layout.regard
    return log_density(x @ take.T, take @ slds.mean0[k], take @ slds.cov0[k] @ take.T)


def log_joint(slds, x, path, recurrent):
    """log Pr(path, x) given the first x, up to a constant; what `gaps` says it samples from."""
    d = len(slds.names)
    total = np.log(slds.pi0[path[0]]) + log_region(slds, path[0], x[..., 0, :])
    for t in range(1, len(path)):
        ahead = [x[..., t - 1, :] @ slds.A[k].T + slds.b[k] for k in range(slds.K)]
        switch = np.log(slds.Pi[path[t - 1]])
        if recurrent:
            switch = switch + np.stack([log_region(slds, k, ahead[k]) for k in range(slds.K)], axis=-1)
            switch = switch - np.logaddexp.reduce(switch, axis=-1, keepdims=True)
        s = path[t]
        total = total + switch[..., s] + log_density(x[..., t, :d], ahead[s][..., :d], slds.Q[s][:d, :d])
    return total


def over_all_paths(slds, y, recurrent):
    """What two rounds of sampling a path come to; and how much single paths deviate from its mean and cov."""
    paths = every_path(slds.K, len(y))
    poses, given = conditioned(slds, y, paths)

    def probable(x):
        """(..., paths) of each path, given states x (..., T, N)."""
        log_p = np.stack([log_joint(slds, x, path, recurrent) for path in paths], axis=-1)
        return np.exp(log_p - np.logaddexp.reduce(log_p, axis=-1, keepdims=True))

    motions = by_motion(slds)
    assert motions.K == 1
    weights = probable(conditioned(motions, y, [0] * len(y))[1]) @ probable(given)
    mean = np.tensordot(weights, poses.mean, 1)
    apart = poses.mean - mean
    squares = poses.cov + apart[..., :, None] * apart[..., None, :]
    cov = np.tensordot(weights, squares, 1)
    deviations = (np.sqrt(np.tensordot(weights, d**2, 1)) for d in (apart, squares - cov))
    return Gaussian(mean, cov), Gaussian(*deviations)


@pytest.mark.parametrize(
    ("order", "travelling", "recurrent"),
    [(1, (), True), (2, ("a",), True), (1, (), False), (2, ("a",), False)],
)
def test_many_samples_come_to_the_sum_over_all_paths(order, travelling, recurrent, rng, monkeypatch):
    slds = random_slds(2, d=2, order=order, travelling=travelling, noise=1.0, stay=0.95, rng=rng)
    y = with_gaps(sample(slds, 5, rng)[2], (1, 4))
    want, deviation = over_all_paths(slds, y, recurrent)
    monkeypatch.setattr(gaps, "PATHS", 1000)
    got = interpolate(slds, y, rng, recurrent=recurrent)
    # Five standard errors of means over 1000 paths, and what the regions are widened by.
    assert (np.abs(got.mean - want.mean) < 5.0 * deviation.mean / np.sqrt(1000) + 1e-5).all()
    assert (np.abs(got.cov - want.cov) < 5.0 * deviation.cov / np.sqrt(1000) + 1e-5).all()
    assert_array_equal(got.cov, np.swapaxes(got.cov, 1, 2))


def test_a_switch_that_cannot_be_is_not_taken(rng):
    slds = replace(random_slds(2, order=1, rng=rng), pi0=[1.0, 0.0], Pi=[[1.0, 0.0], [0.5, 0.5]])
    y = with_gaps(sample(slds, 10, rng)[2], (4, 7))
    want, _ = conditioned(slds, y, [0] * 10)  # the second state is never come to
    for recurrent in (True, False):
        got = interpolate(slds, y, rng, recurrent=recurrent)
        assert_gaussian(got, want, atol=SMOOTHED)


def test_measurements_long_after_a_gap_speak_for_the_switch_within_it(rng):
    # From the second state nobody returns, and single frames hardly tell the two apart.
    slds = replace(
        random_slds(2, d=2, rng=rng),
        pi0=[1.0, 0.0],
        Pi=[[0.7, 0.3], [0.0, 1.0]],
        A=np.stack([0.5 * np.eye(2)] * 2),
        b=[[0.5, 0.5], [-0.5, -0.5]],
        Q=np.stack([np.eye(2)] * 2),
        R=1e-4 * np.eye(2),
        mean0=[[1.0, 1.0], [-1.0, -1.0]],
        cov0=np.stack([0.01 * np.eye(2)] * 2),
    )
    x = np.full((120, 2), 1.0) + 0.2 * rng.normal(size=(120, 2))
    y = with_gaps(x, (4, 9))
    want, _ = conditioned(slds, y[:40], [0] * 40)
    got = interpolate(slds, y, rng, recurrent=False)
    # A frame says 1 nat against having switched, and not to switch costs 0.36: 100 frames leave no chance.
    # What comes after frame 40 says nothing of the first 20, as a state forgets by more than half a frame.
    assert_gaussian(got[:20], want[:20], atol=1e-6)
