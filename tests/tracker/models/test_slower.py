"""Slower and smaller copies of a motion, of poses whose motion is known."""

import numpy as np
from numpy.testing import assert_allclose

from kinematics.mocap import POSE_COLUMNS
from tracker.models.by_motion import learn_motions
from tracker.models.learn import gait_options
from tracker.models.slower import COPIES, slower

LEG = POSE_COLUMNS.index("knee_near")


def poses(T=80):
    """A root that travels evenly, and a knee that swings once in 25 frames about 0.5 radians."""
    y = np.zeros((T, len(POSE_COLUMNS)))
    y[:, 0] = 0.1 * np.arange(T)
    y[:, LEG] = 0.5 + 0.4 * np.sin(2.0 * np.pi * np.arange(T) / 25.0)
    return y


def test_a_copy_is_the_motion_played_slower_and_smaller():
    y = poses()
    for copy, (speed, size) in zip(slower(y), COPIES, strict=True):
        t = np.arange(len(copy)) * speed
        assert len(y) - 1 - speed < t[-1] <= len(y) - 1
        played = 0.5 + 0.4 * np.sin(2.0 * np.pi * t / 25.0)
        # A cubic spline of 25 points a period is within 1e-4 of a sine, its end within 1e-3.
        assert_allclose(copy[:, LEG], played.mean() + size * (played - played.mean()), atol=1e-3)
        assert_allclose(np.diff(copy[:, 0]), 0.1 * speed * size, atol=1e-9)
        assert_allclose(copy[:, 3], 0.0, atol=1e-12)


def test_only_the_motions_that_are_named_are_learned_slower_too(rng):
    data = [
        (who, label, poses() + 0.01 * rng.normal(size=(80, 8))) for who in "ab" for label in ("walk", "run")
    ]
    options = gait_options(states=1, rounds=2)
    usual = learn_motions(data, fps=30.0, options=options)
    both = learn_motions(data, fps=30.0, options=options, slower_too=("run",))
    walk, run = (usual.labels.index(label) for label in ("walk", "run"))
    assert_allclose(both.A[walk], usual.A[walk], atol=1e-12)
    assert both.cov0[run][LEG, LEG] < 0.95 * usual.cov0[run][LEG, LEG]
