"""Standard errors of the gait figures of each leg, of both legs and of their symmetry."""

from dataclasses import replace

import numpy as np
import pytest

from tests.kinematics.figures import WALKER
from tests.tracker.strolls import DUTY, PERIOD, SWING, a_run, bend, posed, stroll, told
from tracker.gait.figures import gait_of
from tracker.gait.values import Measure, Sample


def test_a_flat_peak_is_timed_less_surely_than_a_sharp_one():
    track, knee, errors = stroll(), WALKER.index("knee_near"), []
    track.cov[:, knee, knee] = np.radians(3.0) ** 2
    for width in (0.05, 0.15):
        bent = posed(track, knee_near=bend(track, 0.7, width))
        errors.append(told(bent)["knee flexion peak"].near)
    assert errors[1].error > 1.2 * errors[0].error
    assert errors[1].shared == pytest.approx(errors[0].shared, rel=0.05)


def test_the_error_of_a_range_is_what_strides_differ_by_or_what_the_covariance_says_if_that_is_more():
    for sigma in (0.0001, 0.1):
        track = stroll(9.0, sigma=sigma)
        hip = WALKER.index("hip_near")
        track.q[:, hip] *= 1.0 + 0.1 * np.sin(track.times)
        found = gait_of(track)
        measure = found.named("hip range").near
        angles = np.degrees(track.q[:, hip])
        own = [
            np.ptp([a for t, a in enumerate(angles) if stride.strike.at <= t <= stride.end.at])
            for stride in found.strides["near"].sound
        ]
        assert measure.mean == pytest.approx(np.mean(own))
        spread = max(np.var(own, ddof=1), 2.0 * np.degrees(sigma) ** 2)
        assert measure.error == pytest.approx(np.sqrt(spread / len(own)))


def test_the_error_of_a_stance_is_that_of_its_moments_by_differences():
    track = stroll(2.6)
    gait = gait_of(track)
    (stride,) = gait.strides["near"].sound
    length, stance = stride.end.at - stride.strike.at, stride.off.at - stride.strike.at
    by_strike = -1.0 / length + stance / length**2
    by_end = -stance / length**2
    own = np.hypot(by_strike * stride.strike.error, by_end * stride.end.error)
    own = np.hypot(own, stride.off.error / length)
    shared = np.hypot(stride.strike.shared, stride.off.shared) / length
    value = gait.named("stance share").near
    assert value.shared == pytest.approx(100.0 * shared)
    assert value.error == pytest.approx(100.0 * np.hypot(own, shared))


@pytest.mark.parametrize("name", ["stance share", "hip extension peak"])
def test_what_strides_share_does_not_shrink_with_their_number_and_is_not_in_the_symmetry(name):
    few, many = (told(stroll(seconds))[name] for seconds in (2.6, 26.0))
    assert many.near.count > 15
    assert many.near.error == pytest.approx(many.near.shared, rel=0.1)
    assert few.near.error > 1.2 * many.near.error
    assert many.symmetry.error < 0.4 * few.symmetry.error


@pytest.mark.parametrize(
    ("walks", "name", "times"), [(stroll, "double support", 2), (a_run, "flight time", 1)]
)
def test_errors_of_double_support_and_flight_are_those_of_the_moments_that_bound_them(walks, name, times):
    gait = gait_of(walks(6.0))
    stride, value = gait.strides["near"].sound[0], gait.named(name).both
    own = np.sqrt(2.0 * times / value.count) * np.hypot(stride.strike.error, stride.off.error)
    shared = times * np.hypot(stride.strike.shared, stride.off.shared)
    unit = 1.0 / 30.0 if name == "flight time" else 100.0 / stride.frames
    assert value.shared == pytest.approx(unit * shared)
    assert value.error == pytest.approx(unit * np.hypot(own, shared), rel=0.01)


def test_the_error_of_a_speed_is_that_of_the_hip():
    track = stroll()
    still, shaky = told(track)["speed"].both, track.cov.copy()
    shaky[:, 0, 0] *= 9.0
    unsure = told(replace(track, cov=shaky))["speed"].both
    assert unsure.mean == still.mean
    assert unsure.own == pytest.approx(3.0 * still.own, rel=1e-6)


def test_errors_of_both_legs_and_of_their_symmetry_come_from_the_legs_own():
    track = stroll(9.0, swings=(SWING, 0.7 * SWING), sigma=0.01)
    unlike = np.ones(len(WALKER.freedoms))
    unlike[WALKER.index("hip_far")] = 3.0
    found = told(replace(track, cov=track.cov * np.outer(unlike, unlike)))["hip range"]
    near, far = found.near, found.far
    assert far.error > 2.0 * near.error
    assert found.both.error == pytest.approx((near.error + far.error) / 2.0)

    def index(a, b):
        return 100.0 * (a - b) / ((a + b) / 2.0)

    step = 1e-4
    by_near = (index(near.mean + step, far.mean) - index(near.mean - step, far.mean)) / (2.0 * step)
    by_far = (index(near.mean, far.mean + step) - index(near.mean, far.mean - step)) / (2.0 * step)
    assert found.symmetry.mean == pytest.approx(index(near.mean, far.mean))
    assert found.symmetry.error == pytest.approx(np.hypot(by_near * near.error, by_far * far.error), rel=1e-5)


@pytest.mark.parametrize("sides", [("near", "far"), ("near",)])
def test_strides_of_both_legs_are_windows_that_overlap_by_half(sides, rng):
    halves = rng.normal(size=(40_000, 8))
    windows = (halves[:, :-1] + halves[:, 1:]) / np.sqrt(2.0)  # of variance 1; every second is of one leg
    mine = windows if "far" in sides else windows[:, ::2]
    samples = {side: [Sample(0.0, 1.0)] * windows[:, n::2].shape[1] for n, side in enumerate(sides)}
    value = Measure.common("", "", {"near": [], "far": []} | samples).both
    assert value.count == mine.shape[1]
    assert value.error == pytest.approx(mine.mean(1).std(), rel=0.02)


def test_of_one_stride_a_leg_the_difference_counts_in_what_is_no_legs_own():
    value = Measure.common("", "", {"near": [Sample(8.8, 1.0)], "far": [Sample(14.0, 1.0)]}).both
    assert value.mean == pytest.approx(11.4)
    assert value.error == pytest.approx(np.sqrt(0.75 * np.var([8.8, 14.0], ddof=1)))


def test_two_errors_cover_the_truth_as_often_as_they_should_and_are_no_larger_than_they_were(rng):
    """Forty walks under the very noise that their covariance speaks of."""
    sigma, trials = 0.004, 40
    truth = {"stride time": (PERIOD, 0.0035), "step time": (PERIOD / 2.0, 0.0035)}
    truth["stance share"] = 100.0 * DUTY, 1.25
    inside = dict.fromkeys(truth, 0)
    for _ in range(trials):
        track = stroll(7.0, sigma=sigma)
        found = told(replace(track, q=track.q + rng.normal(scale=sigma, size=track.q.shape)))
        for name, (mean, error) in truth.items():
            value = found[name].near
            inside[name] += abs(value.mean - mean) < 2.0 * value.error
            assert value.error == pytest.approx(error, rel=0.2)
    assert min(inside.values()) >= 0.85 * trials
