"""Calibration: Gaussian errors of the tracked covariance and the mark's give 2 and 86.5 %, others do not."""

from dataclasses import replace

import numpy as np
import pytest

from tests.benchmarks.evaluation.calibration import distances, inside, mark_noise, nees
from tests.tracker.tracks import random_track, standing
from tracker.tables.keypoints import Mark

T = 2000
# Sliding along the thigh: variances along it and across, px^2.
ALONG, ACROSS = 16.0, 2.25


@pytest.fixture
def track(rng):
    """One pose throughout, with one covariance throughout."""
    made = random_track(rng, T)
    return standing(replace(made, cov=np.broadcast_to(made.cov[0], made.cov.shape)), made.q[0])


def drawn(track, rng, spread=1.0):
    """Marks about the tracked joints with errors of their covariance, spread by a factor."""
    places = dict(zip(track.figure.joints, track.joints()[0], strict=True))
    covs = dict(zip(track.figure.joints, track.joint_covs()[0], strict=True))
    marks = {t: {} for t in range(len(track))}
    for name, place in places.items():
        R = ACROSS * np.eye(2)
        if name in ("hip", "near_knee", "far_knee"):
            knee = places["far_knee" if name == "far_knee" else "near_knee"]
            angle = np.arctan2(*(knee - places["hip"])[::-1])
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            R = turn @ np.diag([ALONG, ACROSS]) @ turn.T
        errors = rng.multivariate_normal(np.zeros(2), spread**2 * (covs[name] + R), size=len(track))
        for t, error in enumerate(errors):
            marks[t][name] = Mark(*(place + track.shift[t] - track.shift[0] + error))
    return marks


def test_errors_of_the_right_size_give_two_and_86_5_per_cent_in_every_joint(track, rng):
    found = distances(track, drawn(track, rng), 0).reshape(T - 1, -1)
    # Of 1999 draws the mean's standard error is 2 / sqrt(1999) = 0.045, the share's 0.0077.
    for of_joint in found.T:
        assert nees(of_joint) == pytest.approx(2.0, abs=0.2)
        assert inside(of_joint) == pytest.approx(1.0 - np.exp(-2.0), abs=0.035)
    assert nees(found) == pytest.approx(2.0, abs=0.06)
    assert inside(found) == pytest.approx(1.0 - np.exp(-2.0), abs=0.012)


def test_errors_twice_as_large_give_eight_and_39_per_cent(track, rng):
    found = distances(track, drawn(track, rng, spread=2.0), 0)
    assert nees(found) == pytest.approx(8.0, rel=0.03)
    assert inside(found) == pytest.approx(1.0 - np.exp(-0.5), abs=0.012)


def test_a_mark_slides_four_pixels_along_its_limb_and_one_and_a_half_across():
    along, across = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    R = mark_noise([np.zeros(2), 30.0 * along])
    assert along @ R @ along == pytest.approx(ALONG)
    assert across @ R @ across == pytest.approx(ACROSS)
    assert along @ R @ across == pytest.approx(0.0, abs=1e-12)


def test_hidden_marks_and_those_up_to_the_start_do_not_count(track, rng):
    marks = {t: row for t, row in drawn(track, rng).items() if t < 6}
    marks[4] = {name: replace(mark, visible=False) for name, mark in marks[4].items()}
    joints = len(track.figure.joints)
    assert len(distances(track, marks, 2)) == 2 * joints


def test_marks_beyond_the_track_and_of_joints_it_has_not_do_not_count(rng):
    short = random_track(rng, 3)
    row = {"hip": Mark(100.0, 100.0), "tail": Mark(90.0, 90.0)}
    assert len(distances(short, {0: row, 2: row, 7: row}, 0)) == 1
