"""How fast a clip is played, from the tracked poses."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.motion.rate import backwards
from dynamics.motion.tasks import synthesise
from tracker.clip import playback
from tracker.clip.playback import RATES, motions_at, playback_rate
from tracker.models.find import switching_model
from tracker.motion.free_run import of_motion

T = 90


@pytest.fixture(scope="module")
def walked() -> np.ndarray:
    """Poses of a walk at 30 frames a second, as the model of many states makes them up."""
    gait = switching_model("gait", 30.0)
    return synthesise(of_motion(gait, "walk"), 4 * T, np.random.default_rng(2))[1]


def played(poses: np.ndarray, rate: float) -> np.ndarray:
    """The first T frames of the same motion shown at another speed."""
    times = np.arange(T) * rate
    return np.stack([np.interp(times, np.arange(len(poses)), column) for column in poses.T], axis=1)


@pytest.fixture(scope="module")
def found(walked: np.ndarray) -> float:
    """The pace of the walk at half its speed."""
    return playback_rate("walk-run", played(walked, 0.5), 30.0)


@pytest.mark.parametrize("rate", [0.25, 1.0, 2.0])
def test_slow_and_quick_motion_is_told_from_the_pace_of_the_gait(walked, rate):
    found = playback_rate("walk-run", played(walked, rate), 30.0)
    assert abs(np.log2(found / rate)) <= 0.5


def test_the_frame_rate_of_the_clip_is_taken_into_account(walked):
    as_filmed = playback_rate("walk-run", played(walked, 0.5), 60.0)
    assert abs(np.log2(as_filmed)) <= 0.5


def test_a_clip_played_backwards_has_the_same_pace(walked):
    poses = played(walked, 0.5)
    assert abs(np.log2(playback_rate("walk-run", poses[::-1], 30.0) / 0.5)) <= 0.5


def test_who_walks_on_bent_knees_is_no_runner(walked):
    poses = played(walked, 1.0)
    poses[:, 4:] += np.radians([15.0, 25.0, 15.0, 25.0])
    assert abs(np.log2(playback_rate("walk-run", poses, 30.0))) <= 0.5
    assert motions_at("walk-run", poses, 30.0).count("walk") > 0.9 * T


def test_frames_where_the_figure_was_lost_say_nothing(walked):
    poses = played(walked, 0.5)
    poses[40:50] = np.nan
    assert abs(np.log2(playback_rate("walk-run", poses, 30.0) / 0.5)) <= 0.5


def test_constant_velocity_has_no_pace_of_its_own_and_asks_the_shipped_model(walked, found):
    assert playback_rate("cv", played(walked, 0.5), 30.0) == found


def test_where_the_first_frame_finds_the_figure_and_where_the_neck_was_marked_do_not_matter(walked, found):
    """A track's origin is the hip of the marked frame, which need not be its first."""
    moved = played(walked, 0.5)
    moved[:, :2] += (-2.0, 0.1)
    moved[:, 3] += 0.4
    assert playback_rate("walk-run", moved, 30.0) == found


def test_speeds_from_a_quarter_to_double_are_tried():
    assert_allclose([min(RATES), max(RATES)], [0.25, 2.0])


def test_the_pace_is_that_of_the_frames_after_a_long_loss(walked, found):
    poses = played(walked, 0.5)
    late = np.concatenate([np.full((700, poses.shape[1]), np.nan), poses])
    assert playback_rate("walk-run", late, 30.0) == found


def test_a_figure_that_is_hardly_seen_is_taken_to_move_as_filmed(walked):
    assert playback_rate("walk-run", np.full_like(walked, np.nan), 30.0) == 1.0
    assert playback_rate("walk-run", played(walked, 0.5)[:14], 30.0) == 1.0


def test_time_running_back_is_tried_for_who_may_walk_backwards_alone(walked, monkeypatch):
    tried = []
    monkeypatch.setattr(playback, "backwards", lambda slds: tried.append(slds) or backwards(slds))
    poses, on_the_spot = played(walked, 0.5), played(walked, 0.5)
    on_the_spot[:, 0] = 0.0
    for each, wanted in ((poses, False), (poses[::-1], True), (on_the_spot, True)):
        tried.clear()
        playback_rate("walk-run", each, 30.0)
        assert bool(tried) == wanted


@pytest.fixture(scope="module")
def both() -> np.ndarray:
    """120 frames of a walk and 120 of a run at 30 frames a second, one after the other."""
    ways = [
        synthesise(of_motion(switching_model("gait", 30.0), motion), 120, np.random.default_rng(3))[1]
        for motion in ("walk", "run")
    ]
    ways[1][:, :2] += ways[0][-1, :2] - ways[1][0, :2]
    return np.concatenate(ways)


def right(said: tuple[str, ...]) -> float:
    """Share of the frames of a walk and then as many of a run."""
    half = len(said) // 2
    return (said[:half].count("walk") + said[half:].count("run")) / len(said)


@pytest.mark.parametrize("rate", [0.5, 1.0])
def test_the_motions_are_told_at_the_speed_that_the_clip_is_played_at(both, rate):
    times = np.arange(0.0, len(both) - 1, rate)
    poses = np.stack([np.interp(times, np.arange(len(both)), column) for column in both.T], axis=1)
    said = motions_at("walk-run", poses, 30.0 / rate)
    assert len(said) == len(poses)
    assert right(said) > 0.93


def test_a_run_at_half_its_speed_has_the_pace_of_a_walk_and_is_a_run_all_the_same(both):
    half = played(both[120:], 0.5)
    assert playback_rate("walk-run", half, 30.0) < 0.7
    assert motions_at("walk-run", half, 60.0).count("run") > 0.95 * T


def test_frames_of_no_pose_show_the_motion_of_those_around(both, monkeypatch):
    monkeypatch.setattr(playback, "ENOUGH", 50)
    poses = both.copy()
    whole = motions_at("walk-run", poses, 30.0)
    assert right(whole) > 0.93
    lost = [*range(10), *range(40, 120), *range(230, 240)]  # at the start, a whole piece, at the end
    poses[lost] = np.nan
    said = motions_at("walk-run", poses, 30.0)
    assert [said[t] for t in lost] == ["walk"] * 90 + ["run"] * 10
    assert right(said) > 0.93
