"""Copies of a motion slower, smaller and begun from a stand, of poses whose motion is known."""

import numpy as np
from numpy.testing import assert_allclose

from kinematics.mocap import POSE_COLUMNS
from tracker.models.copies import COPIES, RISE, STAND, STILL, slower, started, with_copies

LEG = POSE_COLUMNS.index("knee_near")
LEGS = [POSE_COLUMNS.index(name) for name in ("hip_near", "hip_far", "knee_near", "knee_far")]


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


def test_a_started_copy_stands_then_is_the_motion():
    y = poses()
    y[:, 1:3] = 1.0, 0.1
    for fps in (30.0, 60.0):
        copy = started(y, fps)
        still, risen = round(STILL * fps), round((STILL + RISE) * fps)
        assert_allclose(np.diff(copy[:still], axis=0), 0.0, atol=1e-12)
        assert_allclose(np.degrees(copy[0, [2, *LEGS]]), list(STAND.values()), atol=1e-9)
        assert_allclose(copy[:, 1], 1.0, atol=1e-12)
        u = np.clip((np.arange(len(copy) - 1) / fps - STILL) / RISE, 0.0, 1.0)
        assert_allclose(np.diff(copy[:, 0]), 0.1 * (3.0 * u**2 - 2.0 * u**3), atol=1e-9)
        # From then on it is the motion itself, where it has come to by then.
        assert_allclose(np.diff(copy[risen:, 0]), 0.1, atol=1e-9)
        t = copy[risen:, 0] / 0.1
        assert_allclose(copy[risen:, LEG], 0.5 + 0.4 * np.sin(2.0 * np.pi * t / 25.0), atol=1e-3)
        assert (np.diff(copy[:, 0]) >= -1e-12).all()
        assert len(y) - 2 < t[-1] <= len(y) - 1


def test_only_the_motions_that_are_named_are_copied():
    data = [(who, label, poses()) for who in "ab" for label in ("walk", "run")]
    found = with_copies(data, ("run",), ("walk",), 30.0)
    assert [(who, label) for who, label, _ in found] == [
        (who, label) for who in "ab" for label in ("walk",) * 2 + ("run",) * (1 + len(COPIES))
    ]
    assert_allclose(found[0][2], poses())
    assert_allclose(found[1][2], started(poses(), 30.0))
    assert_allclose(found[3][2], slower(poses())[0])
