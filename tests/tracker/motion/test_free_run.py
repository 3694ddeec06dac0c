"""Motions of a model's own."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.store import load_shipped
from tests.tracker.gaits import gait_hmm, gait_model
from tracker.motion.free_run import free_run, of_motion

THIGHS = [4, 6]


def made(seed=0, frames=90, **how):
    return free_run(load_shipped("stride", 30.0), frames, 30.0, np.random.default_rng(seed), **how)


def test_one_motion_of_a_model_has_its_states_alone():
    walk = of_motion(gait_model(), "walk")
    assert set(walk.labels) == {"walk"}
    assert_allclose(walk.Pi.sum(1), 1.0, atol=1e-12)
    assert_allclose(walk.pi0.sum(), 1.0, atol=1e-12)
    kept = [i for i, label in enumerate(gait_model().labels) if label == "walk"]
    assert_array_equal(walk.A, gait_model().A[kept])
    assert of_motion(gait_model(), None) is gait_model()


def test_a_stride_makes_one_person_s_gait_of_the_motion_that_is_asked_for():
    states, labels, y = made(label="run")
    assert set(labels) == {"run"}
    assert len(set(states)) == 1
    assert y.shape == (90, 8)
    assert 2.0 < y[-1, 0] - y[0, 0] < 20.0
    swing = np.degrees(np.ptp(y[:, THIGHS], axis=0))
    assert ((swing > 30.0) & (swing < 120.0)).all()
    assert {made(seed)[1][0] for seed in range(12)} == {"walk", "run"}
    with pytest.raises(ValueError, match="no motion 'swim'; it has walk, run"):
        made(label="swim")


def test_more_noise_is_a_rougher_motion():
    def roughness(noise):
        _, _, y = free_run(gait_model(), 60, 30.0, np.random.default_rng(2), "walk", noise)
        return np.diff(y[:, 2:], 4, axis=0).std()

    assert roughness(0.1) < 0.6 * roughness(1.0) < 0.6 * roughness(2.0)


@pytest.mark.parametrize(("frames", "told"), [(60, " at frame"), (2000, ";")])
def test_a_frame_is_named_only_where_it_is_known(frames, told):
    model = load_shipped("gait", 30.0)
    with pytest.raises(ValueError, match=f"leaves all that a figure can do{told}"):
        free_run(replace(model, A=1.2 * model.A), frames, 30.0, np.random.default_rng(0))


def test_what_has_no_dynamics_is_refused():
    with pytest.raises(ValueError, match="hidden Markov model, which cannot synthesise"):
        free_run(gait_hmm(), 10, 30.0, np.random.default_rng(0))


def test_the_states_of_one_motion_keep_their_numbers():
    model = gait_model()
    states, labels, _ = free_run(model, 20, 30.0, np.random.default_rng(0), "run")
    assert set(labels) == {"run"}
    assert [model.labels[k] for k in states] == labels
