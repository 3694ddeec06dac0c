"""Models by name, at any frame rate."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.motion.rate import backwards
from dynamics.store import load_shipped
from kinematics.figure_file import load_figure
from kinematics.mocap import POSE_COLUMNS
from tests.tracker.gaits import gait_model, saved
from tests.tracker.painted import FULL
from tracker.clip.asked import asked
from tracker.clip.job import Following
from tracker.clip.start import FoundError
from tracker.models.find import (
    FREE_ANGLE,
    FREE_PLACE,
    SEEN_OWN,
    SEEN_WIDER,
    compared,
    find_model,
    for_seen,
    from_a_stand,
    seen_backwards,
)
from tracker.progress import Progress


@pytest.mark.parametrize(
    ("figure", "names"),
    [("walker", ["walk-run", "walk-run-1", "cv"]), ("walker-arms", ["walk-run", "cv"]), ("horse", ["cv"])],
)
def test_models_that_follow_the_figure_are_compared(figure, names):
    body = load_figure(figure)
    assert compared(figure) == names
    for name in names:
        assert find_model(name, 30.0, FULL, figure=body).names == body.learned_freedoms


def test_who_is_to_be_labelled_may_start_from_a_stand_but_a_file_s_name_stays(tmp_path, monkeypatch):
    assert from_a_stand("gait") == "gait-started"
    assert from_a_stand("walk-run") == "walk-run"
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gait").write_text("a file of somebody's own")
    assert from_a_stand("gait") == "gait"


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


def test_the_free_state_is_taken_up_by_surprise_and_left_as_rarely(tmp_path):
    slds = gait_model()
    joined = find_model(str(saved(tmp_path / "mine.npz", slds)), 30.0, FULL)
    assert joined.labels == (*slds.labels, "free")
    assert_array_equal(joined.A[:-1], slds.A)
    assert_allclose(joined.Pi[:-1, -1], FULL.surprise, rtol=1e-9)
    assert_allclose(joined.Pi[-1], [*[FULL.surprise / slds.K] * slds.K, 1.0 - FULL.surprise], rtol=1e-9)
    assert_allclose(joined.pi0[-1], FULL.surprise, rtol=1e-9)


@pytest.mark.parametrize(("fps", "entries"), [(24.0, 24.0), (60.0, 30.0), (120.0, 30.0)])
def test_the_free_state_is_taken_up_as_often_in_a_second(fps, entries):
    joined = find_model("walk-run", fps, FULL)
    assert fps * joined.Pi[0, -1] == pytest.approx(entries * FULL.surprise, rel=0.01)


def test_the_free_state_goes_on_as_it_went_from_where_any_learned_one_starts(tmp_path):
    free = find_model(str(saved(tmp_path / "mine.npz", gait_model())), 60.0, FULL)
    d = len(free.names)
    assert_array_equal(free.A[-1, :d], np.hstack([2.0 * np.eye(d), -np.eye(d)]))
    # A change of speed a frame, in half the time: of the speed 1 / sqrt(2), and of the step half of that.
    assert_allclose(np.sqrt(free.Q[-1, 0, 0]), FREE_PLACE / np.sqrt(8.0), rtol=1e-12)
    assert_allclose(np.sqrt(free.Q[-1, d - 1, d - 1]), FREE_ANGLE / np.sqrt(8.0), rtol=1e-12)
    assert_allclose(free.mean0[-1], free.mean0[:-1].mean(axis=0), rtol=1e-9, atol=1e-12)


def test_the_free_state_goes_on_as_it_went_backwards_too(tmp_path):
    found = find_model(str(saved(tmp_path / "mine.npz", gait_model())), 30.0, FULL)
    turned, free = seen_backwards(found), len(found.labels) - 1
    assert found.labels[free] == "free"
    for name in ("A", "b", "Q"):
        assert_array_equal(getattr(turned, name)[free], getattr(found, name)[free])
        assert_array_equal(getattr(turned, name)[:free], getattr(backwards(found), name)[:free])
    assert_array_equal(turned.Pi, backwards(found).Pi)


def test_inflation_widens_what_was_learned_and_not_constant_velocity():
    tight, wide = (FULL.model_copy(update={"inflation": x}) for x in (1.0, 3.0))
    for name, factor in (("walk-run", 3.0), ("cv", 1.0)):
        a, b = find_model(name, 30.0, tight), find_model(name, 30.0, wide)
        learned_states = [k for k, label in enumerate(a.labels) if label != "free"]
        assert_allclose(b.Q[learned_states], factor * a.Q[learned_states], rtol=1e-12)
        others = [k for k in range(a.K) if k not in learned_states]
        assert_array_equal(b.Q[others], a.Q[others])


def test_the_noise_of_a_figure_that_is_seen_is_larger_and_shared_less_between_freedoms():
    learned = find_model("walk-run", 30.0, FULL)
    seen = for_seen(learned)
    own = np.eye(seen.Q.shape[-1], dtype=bool)
    assert_allclose(seen.Q[:, own], SEEN_WIDER * learned.Q[:, own], rtol=1e-12)
    assert_allclose(seen.Q[:, ~own], SEEN_WIDER * (1.0 - SEEN_OWN) * learned.Q[:, ~own], rtol=1e-12)
    assert np.linalg.eigvalsh(seen.Q).min() > -1e-12
    assert_array_equal(seen.A, learned.A)


def test_constant_velocity_carries_poses_on_as_they_moved(rng):
    slds = find_model("cv", 30.0, FULL)
    now, before = rng.normal(size=(2, 8))
    state = np.concatenate([now, before])
    assert_allclose(slds.A[0] @ state + slds.b[0], np.concatenate([2 * now - before, now]), rtol=1e-14)
    assert (slds.K, slds.order, slds.labels, slds.names) == (1, 2, ("cv",), POSE_COLUMNS)


def test_constant_velocity_scales_with_the_frame_rate():
    at_30, at_60 = (find_model("cv", fps, FULL) for fps in (30.0, 60.0))
    assert at_60.fps == 60.0
    assert_allclose(np.sqrt(at_30.Q[0].diagonal()[:3]), [FULL.cv_place] * 2 + [np.radians(FULL.cv_angle)])
    difference = np.hstack([np.eye(8), -np.eye(8)])
    first_step = [difference @ slds.cov0[0] @ difference.T for slds in (at_30, at_60)]
    assert_allclose(first_step[1], first_step[0] / 4.0, atol=1e-12)


@pytest.mark.parametrize("fps", [60.0, 120.0, 240.0])
@pytest.mark.parametrize("name", ["cv", "walk-run"])
def test_the_speed_at_constant_velocity_changes_as_much_in_a_second_at_any_rate(name, fps):
    def spread(fps):
        """Standard deviations of the speeds after a second that was begun for certain, per second."""
        slds = find_model(name, fps, FULL)
        A, Q, d = slds.A[-1], slds.Q[-1], len(slds.names)
        cov = np.zeros_like(Q)
        for _ in range(round(fps)):
            cov = A @ cov @ A.T + Q
        difference = np.eye(d, 2 * d) - np.eye(d, 2 * d, d)
        return fps * np.sqrt(np.diagonal(difference @ cov @ difference.T))

    assert_allclose(spread(fps), spread(30.0), rtol=1e-9)


@pytest.mark.parametrize("fps", [1000.0, 480.0, 1.0, 0.1])
def test_a_frame_rate_too_far_from_the_models_is_refused_with_what_works(fps):
    with pytest.raises(ValueError, match=f"cannot be had at {fps:g} frames .* give --model cv"):
        find_model("walk-run", fps, FULL)
    assert find_model("cv", fps, FULL).fps == fps


def test_a_playback_speed_counts_before_anybody_is_looked_for(monkeypatch, tmp_path):
    """Filmed at 480 frames a second, played at 120, a clip has a model."""
    short = SimpleNamespace(last=0, cut=False, enough=False, survey=SimpleNamespace(places=[0]))
    monkeypatch.setattr(
        "tracker.clip.asked.Video", lambda _, rate: SimpleNamespace(fps=480.0 / rate, count_hint=None)
    )
    monkeypatch.setattr("tracker.clip.found.surveyed", lambda *_: short)
    with pytest.raises(ValueError, match="cannot be had at 480"):
        asked(Following(), tmp_path / "a.mp4", None, None, Progress("quiet"))
    with pytest.raises(FoundError, match="in fewer than 40 frames"):
        asked(Following(rate=4.0), tmp_path / "a.mp4", None, None, Progress("quiet"))
