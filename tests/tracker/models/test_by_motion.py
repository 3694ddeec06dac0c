"""What learning makes of labelled captures."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kinematics.mocap import POSE_COLUMNS, mirror
from tests.tracker.gaits import ONE, captures, gait, gait_model, learned
from tracker.models.by_motion import ESteps

LEGS_EXCHANGED = [0, 1, 2, 3, 6, 7, 4, 5]
TURNING = slice(2, None)  # columns of the angles


@pytest.fixture(scope="module")
def sequences():
    return captures()


def test_every_motion_has_its_own_labelled_states():
    slds = gait_model()
    assert slds.labels == ("walk", "walk", "run", "run")
    assert slds.names == POSE_COLUMNS
    assert slds.travelling == ("root_x", "root_y")
    assert (slds.fps, slds.order) == (30.0, 2)
    # To another motion in a thousand frames, whatever the states within.
    assert_allclose(slds.Pi[:2, 2:].sum(axis=1), 1e-3, rtol=1e-9)
    assert_allclose(slds.Pi[2:, :2].sum(axis=1), 1e-3, rtol=1e-9)


def test_a_motion_learned_beside_another_is_the_motion_learned_alone(sequences):
    both, alone = learned(sequences), learned([s for s in sequences if s[1] == "walk"])
    for name in ("A", "b", "Q", "mean0", "cov0"):
        assert_array_equal(getattr(both, name)[0], getattr(alone, name)[0])


def test_pooled_motions_share_states_named_after_all_of_them(sequences):
    slds = learned(sequences, replace(ONE, states=2), pooled=True)
    assert slds.labels == ("walk-run", "walk-run")
    assert not np.allclose(slds.Pi[0], [0.999, 0.001], atol=1e-4)


@pytest.mark.parametrize("order", [1, 2])
def test_one_state_knows_no_near_leg_from_far(sequences, order):
    slds = learned(sequences, replace(ONE, order=order))
    swap = np.concatenate([np.array(LEGS_EXCHANGED) + 8 * lag for lag in range(order)])
    for k in range(slds.K):
        # Sums over sequences in another order, through a regression of condition 1e5 or so.
        size = np.abs(slds.A[k]).max()
        assert_allclose(slds.A[k][np.ix_(swap, swap)], slds.A[k], atol=1e-8 * size)
        assert_allclose(slds.b[k][swap], slds.b[k], atol=1e-8)
        assert_allclose(slds.Q[k][np.ix_(swap, swap)], slds.Q[k], atol=1e-10)
        assert_allclose(slds.mean0[k][swap], slds.mean0[k], atol=1e-8)
        assert_allclose(slds.cov0[k][np.ix_(swap, swap)], slds.cov0[k], atol=1e-8)


@pytest.mark.parametrize(
    "changed",
    [lambda y, i: mirror(y), lambda y, i: y + i * np.r_[7.0, 0.0, 0.0, 0.4, np.zeros(4)]],
    ids=["which leg was called near", "where a subject holds the head and started"],
)
def test_the_near_leg_the_head_and_the_place_do_not_matter(sequences, changed):
    other = [(subject, label, changed(y, i)) for i, (subject, label, y) in enumerate(sequences)]
    first, second = learned(sequences), learned(other)
    for name in ("A", "b", "Q", "R", "mean0", "cov0"):
        assert_allclose(getattr(second, name), getattr(first, name), atol=1e-8)


def mean_speed(slds, poses):
    """How far the model goes forward in a frame, on the mean over these poses."""
    change = poses @ slds.A[0].T + slds.b[0] - poses
    return change[:, 0].mean()


@pytest.mark.parametrize(("label", "subjects"), [("walk", "bbbbb"), ("run", "bcdef")])
def test_subjects_and_pooled_motions_count_alike_however_much_there_is_of_them(rng, label, subjects):
    slow = [("a", "walk", gait("walk", 96, rng, speed=0.04))]
    fast = [(subject, label, gait("walk", 96, rng, speed=0.08)) for subject in subjects]
    slds = learned(slow + fast, replace(ONE, order=1), pooled=label == "run")
    whole = np.concatenate([y for _, _, y in slow + fast])
    whole[:, 3] -= whole[:, 3].mean()
    # Midway between the two; by sequences it would be 0.073. Slopes of noise 0.003 over sqrt(500) frames.
    assert mean_speed(slds, whole) == pytest.approx(0.06, abs=2e-3)


def test_noise_goes_to_the_angles_and_not_to_the_root(sequences):
    clean, noisy = learned(sequences), learned(sequences, noise=0.05)
    variance = noisy.R.diagonal() + noisy.Q.mean(axis=0).diagonal()[:8]
    # Some of what was added is taken for motion, the rest for measurement.
    assert (variance[TURNING] > 0.5 * 0.05**2).all()
    assert_allclose(noisy.R.diagonal()[:2], clean.R.diagonal()[:2], rtol=0.7)


def test_the_same_seed_learns_the_same_model_in_whatever_order_the_subjects_come(sequences):
    options = replace(ONE, states=2, rounds=1)
    other = sorted(sequences, key=lambda s: s[0], reverse=True)
    first, again = (learned(each, options, noise=0.02) for each in (sequences, other))
    assert_array_equal(first.A, again.A)
    assert_array_equal(first.Pi, again.Pi)


def test_sequences_are_left_as_they_were(sequences):
    before = [y.copy() for _, _, y in sequences]
    learned(sequences, noise=0.02)
    for old, (_, _, y) in zip(before, sequences, strict=True):
        assert_array_equal(y, old)


def test_every_round_of_every_motion_is_told(sequences):
    told = []
    learned(sequences, replace(ONE, rounds=2, tolerance=0.0), e_steps=ESteps(tick=lambda: told.append(1)))
    assert len(told) == 2 * 2


@pytest.mark.parametrize("pooled", [False, True])
def test_learning_from_nothing_is_refused(pooled):
    with pytest.raises(ValueError, match="at least one sequence"):
        learned([], pooled=pooled)
