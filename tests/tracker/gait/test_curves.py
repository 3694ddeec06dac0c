"""Angles over the stride, of strides whose angle is known at every share."""

import numpy as np
import pytest

from tests.kinematics.figures import WALKER
from tests.tracker.strolls import stroll
from tracker.gait.curves import SHARES, norm_of, over_strides, spread
from tracker.gait.figures import Gait, gait_of
from tracker.gait.moments import Event
from tracker.gait.strides import Stride

TIMES = np.arange(100.0) / 30.0
WALK = Gait((), {}, 1.0, "walk", False, None)


def stride(strike, end):
    return Stride(*(Event(at, 0.1, 0.1) for at in (strike, (strike + end) / 2.0, end)))


def test_an_angle_is_read_at_even_shares_from_strike_to_strike():
    angle = 3.0 * np.arange(100.0)
    (curve,) = over_strides(angle, [stride(10.25, 50.75)], TIMES)
    assert curve == pytest.approx(3.0 * (10.25 + SHARES * 40.5))
    (later,) = over_strides(angle, [stride(17.25, 57.75)], TIMES, first=7)
    assert later == pytest.approx(curve)


def test_shares_are_of_the_time_where_frames_are_not_evenly_timed():
    times = np.append(np.arange(50.0), 50.0 + 2.0 * np.arange(50.0)) / 30.0
    (curve,) = over_strides(90.0 * times, [stride(20.0, 80.0)], times)
    assert curve == pytest.approx(60.0 + SHARES * 270.0)


def test_strides_of_any_length_lie_over_each_other():
    phase = np.concatenate([np.arange(40) / 40, np.arange(55) / 55, [0.0]])
    curves = over_strides(np.cos(2.0 * np.pi * phase), [stride(0.0, 40.0), stride(40.0, 95.0)], TIMES[:96])
    # A straight line between frames is off by (2 pi / 40)^2 / 8 at most.
    assert np.abs(curves - np.cos(2.0 * np.pi * SHARES)).max() < 0.0031
    assert spread(curves).max() < 0.003


def test_of_one_stride_there_is_no_spread_and_of_none_no_curve():
    curves = over_strides(np.arange(100.0), [stride(0.0, 40.0)], TIMES)
    assert curves.shape == (1, 101)
    assert spread(curves) is None
    assert over_strides(np.arange(100.0), [], TIMES).shape == (0, 101)
    assert spread(np.array([[1.0], [3.0]])) == pytest.approx([np.sqrt(2.0)])


def test_the_thigh_of_a_walk_is_ahead_at_either_strike_and_behind_where_the_foot_leaves():
    track = stroll()
    gait = gait_of(track)
    for side, strides in gait.strides.items():
        thigh = track.q[:, WALKER.index(f"hip_{side}")]
        curves = np.degrees(over_strides(thigh, strides.sound, track.times))
        assert len(curves) == len(strides.sound) > 2
        mean = curves.mean(axis=0)
        assert mean[[0, 100]] == pytest.approx([28.0, 28.0], abs=2.0)
        assert abs(int(mean.argmin()) - gait.named("stance share").near.mean) < 5


@pytest.mark.parametrize(("joint", "least", "most"), [("hip", 35, 60), ("knee", 45, 75), ("ankle", 15, 45)])
def test_people_who_walk_move_their_joints_as_far_as_gait_analysis_says(joint, least, most):
    norm = norm_of(WALK, joint)
    assert least < np.ptp(norm["mean"]) < most
    assert abs(norm["mean"][0] - norm["mean"][100]) < 3.0
    assert min(norm["sigma"]) > 0.0
    assert norm["people"] >= 5


def test_the_knee_of_people_is_bent_most_in_the_swing():
    assert 65 < np.argmax(norm_of(WALK, "knee")["mean"]) < 82
