"""Models by name, at any frame rate; and what learning makes of captures."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.learning.options import Options
from dynamics.motion.rate import at_rate
from dynamics.store import ModelError, load_shipped, save
from kinematics.mocap import POSE_COLUMNS, mirror
from tests.kinematics.figures import ARMS
from tests.tracker.painted import FULL
from tracker.clip.asked import asked
from tracker.clip.job import Following
from tracker.clip.start import FoundError
from tracker.models.find import ESteps, find_model, learn_motions
from tracker.progress import Progress

ONE = Options(states=1, order=2, rounds=3)
LEGS_EXCHANGED = [0, 1, 2, 3, 6, 7, 4, 5]
TURNING = slice(2, None)  # columns of the angles


def gait(rng, *, T=80, period=32.0, speed=0.045, size=1.0, noise=0.003):
    """Pose rows of a walk: sinusoids of one stride, a little unsteady."""
    phase = 2.0 * np.pi * (rng.random() + np.arange(T) / period)
    y = np.zeros((T, len(POSE_COLUMNS)))
    y[:, 0], y[:, 1] = speed * np.arange(T), 0.9 + 0.02 * np.cos(2.0 * phase)
    y[:, 2], y[:, 3] = 0.08 + 0.02 * np.sin(2.0 * phase), 0.15 + 0.03 * np.cos(2.0 * phase)
    for hip, knee, p in ((4, 5, phase), (6, 7, phase + np.pi)):
        y[:, hip] = 0.1 + 0.4 * size * np.sin(p)
        y[:, knee] = 0.5 * size * (1.0 + np.cos(p + 0.6))
    return y + rng.normal(scale=noise, size=y.shape)


@pytest.fixture(scope="module")
def sequences():
    rng = np.random.default_rng(20)
    walks = [(subject, "walk", gait(rng)) for subject in ("a", "a", "b")]
    runs = [(subject, "run", gait(rng, period=22.0, speed=0.1, size=1.4)) for subject in ("a", "c")]
    return walks + runs


@pytest.fixture(scope="module")
def two_states(sequences):
    """Learned with two states a motion."""
    return learned(sequences, replace(ONE, states=2))


def learned(sequences, options=ONE, **more):
    return learn_motions(sequences, fps=30.0, options=options, **more)


def test_every_motion_has_its_own_labelled_states(two_states):
    slds = two_states
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


def test_it_does_not_matter_which_leg_was_called_near(sequences):
    other = [(subject, label, mirror(y)) for subject, label, y in sequences]
    first, second = learned(sequences), learned(other)
    for name in ("A", "b", "Q", "R", "mean0", "cov0"):
        assert_allclose(getattr(second, name), getattr(first, name), atol=1e-8)


def test_where_a_subject_holds_the_head_and_where_it_started_do_not_matter(sequences):
    moved = np.r_[7.0, 0.0, 0.0, 0.4, np.zeros(4)]
    other = [(subject, label, y + moved * i) for i, (subject, label, y) in enumerate(sequences)]
    first, second = learned(sequences), learned(other)
    for name in ("A", "b", "Q", "R", "mean0", "cov0"):
        assert_allclose(getattr(second, name), getattr(first, name), atol=1e-8)


def mean_speed(slds, poses):
    """How far the model goes forward in a frame, on the mean over these poses."""
    change = poses @ slds.A[0].T + slds.b[0] - poses
    return change[:, 0].mean()


def test_subjects_count_alike_however_much_there_is_of_them(rng):
    slow = [("a", "walk", gait(rng, T=96, speed=0.04))]
    fast = [("b", "walk", gait(rng, T=96, speed=0.08)) for _ in range(5)]
    slds = learned(slow + fast, replace(ONE, order=1))
    whole = np.concatenate([y for _, _, y in slow + fast])
    whole[:, 3] -= whole[:, 3].mean()
    # Midway between the two; by sequences it would be 0.073. Slopes of noise 0.003 over sqrt(500) frames.
    assert mean_speed(slds, whole) == pytest.approx(0.06, abs=2e-3)


def test_motions_count_alike_when_pooled(rng):
    walk = [("a", "walk", gait(rng, T=96, speed=0.04))]
    run = [(str(i), "run", gait(rng, T=96, speed=0.08)) for i in range(5)]
    slds = learned(walk + run, replace(ONE, order=1), pooled=True)
    whole = np.concatenate([y for _, _, y in walk + run])
    whole[:, 3] -= whole[:, 3].mean()
    assert mean_speed(slds, whole) == pytest.approx(0.06, abs=2e-3)


def test_noise_goes_to_the_angles_and_not_to_the_root(sequences):
    clean, noisy = learned(sequences), learned(sequences, noise=0.05)
    variance = noisy.R.diagonal() + noisy.Q.mean(axis=0).diagonal()[:8]
    # Some of what was added is taken for motion, the rest for measurement.
    assert (variance[TURNING] > 0.5 * 0.05**2).all()
    assert_allclose(noisy.R.diagonal()[:2], clean.R.diagonal()[:2], rtol=0.7)


def test_the_same_seed_learns_the_same_model(sequences):
    options = replace(ONE, states=2, rounds=1)
    first, again = (learned(sequences, options, noise=0.02) for _ in range(2))
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


def test_a_figure_with_arms_has_models_of_its_own_under_the_same_names():
    for name in ("walk-run", "gait"):
        assert find_model(name, 30.0, FULL, figure=ARMS).names == ARMS.learned_freedoms
        assert find_model(name, 30.0, FULL).names == POSE_COLUMNS
    assert find_model("cv", 30.0, FULL, figure=ARMS).names == ARMS.learned_freedoms


@pytest.mark.parametrize("name", ["walk-run", "walk-run-1"])
def test_a_shipped_model_comes_at_the_clip_s_frame_rate(name):
    own = find_model(name, 30.0, FULL)
    assert own.fps == 30.0
    assert_array_equal(own.A[:-1], load_shipped(name, 30.0).A)
    for fps in (24.0, 60.0):
        other = find_model(name, fps, FULL)
        assert other.fps == fps
        assert (other.labels, other.names) == (own.labels, own.names)
        assert not np.allclose(other.A, own.A)
        # The same speeds in leg lengths a second, from the mean pose.
        speed, want = (s.fps * (s.A @ s.mean0[..., None] + s.b[..., None])[:-1, 0, 0] for s in (other, own))
        assert_allclose(speed, want, rtol=0.1)


def test_the_free_state_is_taken_up_by_surprise_and_left_as_rarely(two_states, tmp_path):
    slds = two_states
    path = tmp_path / "mine.npz"
    save(slds, path, "tests")
    joined = find_model(str(path), 30.0, FULL)
    assert joined.labels == (*slds.labels, "free")
    assert_array_equal(joined.A[:-1], slds.A)
    assert_allclose(joined.Pi[:-1, -1], FULL.surprise, rtol=1e-9)
    assert_allclose(joined.Pi[-1], [*[FULL.surprise / slds.K] * slds.K, 1.0 - FULL.surprise], rtol=1e-9)
    assert_allclose(joined.pi0[-1], FULL.surprise, rtol=1e-9)


def test_a_playback_speed_is_another_frame_rate_of_the_motion(two_states, tmp_path):
    path = tmp_path / "mine.npz"
    save(two_states, path, "tests")
    played = find_model(str(path), 30.0, FULL, 0.5)
    assert played.fps == 30.0
    # What takes 60 filmed frames takes 120 played at half speed.
    assert_array_equal(played.A[:-1], at_rate(two_states, 60.0).A)


def test_the_free_state_goes_on_as_it_went_from_where_any_learned_one_starts(sequences, tmp_path):
    slds = learned(sequences)
    path = tmp_path / "mine.npz"
    save(slds, path, "tests")
    settings = FULL.model_copy(update={"free_angle": 2.0, "free_place": 0.03})
    free = find_model(str(path), 60.0, settings)
    d = len(free.names)
    assert_array_equal(free.A[-1, :d], np.hstack([2.0 * np.eye(d), -np.eye(d)]))
    # A change of speed a frame: a quarter as much in half the time.
    assert_allclose(np.sqrt(free.Q[-1, 0, 0]), 0.03 / 4, rtol=1e-12)
    assert_allclose(np.sqrt(free.Q[-1, d - 1, d - 1]), np.radians(2.0) / 4, rtol=1e-12)
    assert_allclose(free.mean0[-1], free.mean0[:-1].mean(axis=0), rtol=1e-9, atol=1e-12)


def test_inflation_widens_what_was_learned_and_not_constant_velocity():
    tight, wide = (FULL.model_copy(update={"inflation": x}) for x in (1.0, 3.0))
    for name, factor in (("walk-run", 3.0), ("cv", 1.0)):
        a, b = find_model(name, 30.0, tight), find_model(name, 30.0, wide)
        learned_states = [k for k, label in enumerate(a.labels) if label != "free"]
        assert_allclose(b.Q[learned_states], factor * a.Q[learned_states], rtol=1e-12)
        others = [k for k in range(a.K) if k not in learned_states]
        assert_array_equal(b.Q[others], a.Q[others])


def test_constant_velocity_knows_no_playback_speeds():
    slds, slow = find_model("cv", 30.0, FULL), find_model("cv", 30.0, FULL, 0.5)
    assert slds.K == slow.K == 1
    assert_array_equal(slow.Q, slds.Q)


def test_a_model_file_is_read_and_converted(sequences, tmp_path):
    slds = learned(sequences)
    path = tmp_path / "mine.npz"
    save(slds, path, "tests")
    assert_array_equal(find_model(str(path), 30.0, FULL).A[:-1], slds.A)
    assert find_model(str(path), 50.0, FULL).fps == 50.0


def test_a_name_that_means_no_model_is_refused_with_what_there_is():
    with pytest.raises(ModelError, match=r"no model 'hop' ships; there are .*walk-run.* also cv"):
        find_model("hop", 30.0, FULL)
    with pytest.raises(ModelError, match=r"no model file hop\.npz"):
        find_model("hop.npz", 30.0, FULL)


def test_constant_velocity_carries_poses_on_as_they_moved(rng):
    slds = find_model("cv", 30.0, FULL)
    now, before = rng.normal(size=(2, 8))
    state = np.concatenate([now, before])
    assert_allclose(slds.A[0] @ state + slds.b[0], np.concatenate([2 * now - before, now]), rtol=1e-14)
    assert (slds.K, slds.order, slds.labels, slds.names) == (1, 2, ("cv",), POSE_COLUMNS)


def test_constant_velocity_scales_with_the_frame_rate():
    at_30, at_60 = (find_model("cv", fps, FULL) for fps in (30.0, 60.0))
    assert at_60.fps == 60.0
    # Acceleration: a change of speed a frame goes with the square of the frame's length, Q with its square.
    assert_allclose(at_60.Q[0], at_30.Q[0] / 16.0, rtol=1e-12)
    assert_allclose(np.sqrt(at_30.Q[0].diagonal()[:3]), [FULL.cv_place] * 2 + [np.radians(FULL.cv_angle)])
    difference = np.hstack([np.eye(8), -np.eye(8)])
    first_step = [difference @ slds.cov0[0] @ difference.T for slds in (at_30, at_60)]
    assert_allclose(first_step[1], first_step[0] / 4.0, atol=1e-12)


@pytest.mark.parametrize(("fps", "rate"), [(1000.0, 1.0), (240.0, 0.5), (1.0, 1.0), (0.1, 1.0)])
def test_a_frame_rate_too_far_from_the_models_is_refused_with_what_works(fps, rate):
    with pytest.raises(ValueError, match=f"cannot be had at {fps / rate:g} frames .* give --model cv"):
        find_model("walk-run", fps, FULL, rate)
    assert find_model("cv", fps, FULL, rate).fps == fps


def test_a_playback_speed_counts_before_anybody_is_looked_for(monkeypatch, tmp_path):
    """Filmed at 480 frames a second, played at 120, a clip has a model."""
    monkeypatch.setattr("tracker.clip.asked.Video", lambda path: SimpleNamespace(fps=480.0))
    monkeypatch.setattr("tracker.clip.found.people", lambda *_: [])
    with pytest.raises(ValueError, match="cannot be had at 480"):
        asked(Following(), tmp_path / "a.mp4", None, None, Progress("quiet"))
    with pytest.raises(FoundError, match="nobody was found"):
        asked(Following(rate=4.0), tmp_path / "a.mp4", None, None, Progress("quiet"))
