"""Strikes and leavings against walks whose every moment is known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import find_peaks

from tests.kinematics.figures import WALKER
from tests.tracker.strolls import stroll, track_of
from tracker.gait.strides import _peaks, strides_of

FPS, PERIOD, DUTY, START = 30.0, 1.1, 0.6, 0.3
# Frames: ahead of an extreme the foot is not slowed quite as it is quickened after it, and no parabola knows.
CLOSE = 0.15


def expected(offset=0.0, count=5):
    return FPS * (START + PERIOD * (offset + np.arange(count)))


def moments(strides, name):
    return [getattr(stride, name).at for stride in strides.sound]


@pytest.mark.parametrize(("side", "offset"), [("near", 0.0), ("far", 0.5)])
def test_a_foot_strikes_and_leaves_the_floor_when_it_does(side, offset):
    strides = strides_of(stroll(), side)
    strikes = expected(offset)
    n = len(strides.sound)
    assert n == 4
    assert moments(strides, "strike") == pytest.approx(strikes[:n], abs=CLOSE)
    assert moments(strides, "end") == pytest.approx(strikes[1 : n + 1], abs=CLOSE)
    assert moments(strides, "off") == pytest.approx(strikes[:n] + FPS * PERIOD * DUTY, abs=CLOSE)
    assert moments(strides, "down") == moments(strides, "strike")
    assert strides.left_out == 0


def test_moments_fall_between_frames():
    for late in (0.0, 0.25, 0.5, 0.75):
        strides = strides_of(stroll(start=START + late / FPS), "near")
        assert moments(strides, "strike") == pytest.approx(expected()[:4] + late, abs=CLOSE)


def test_at_any_frame_rate_the_strides_are_the_same():
    lengths = []
    for fps in (24.0, 60.0, 120.0):
        strides = strides_of(stroll(fps=fps), "near").sound
        lengths += [(s.end.at - s.strike.at) / fps for s in strides]
    assert lengths == pytest.approx([PERIOD] * len(lengths), abs=0.01)


def test_frames_are_those_of_the_clip():
    track = stroll()
    later = strides_of(replace(track, first=100), "near")
    assert moments(later, "off") == pytest.approx(np.array(moments(strides_of(track, "near"), "off")) + 100)


def test_who_walks_backwards_strikes_behind_the_hip():
    """Time runs back: what was a leaving is now a strike."""
    track = stroll()
    back = replace(track, q=track.q[::-1].copy())
    found = moments(strides_of(back, "near"), "strike")
    leavings = len(track) - 1 - (expected() + FPS * PERIOD * DUTY)[::-1]
    for strike in found:
        assert np.abs(leavings - strike).min() < CLOSE


def test_strides_in_which_the_figure_was_lost_are_left_out():
    track = stroll()
    outcome = list(track.outcome)
    outcome[50] = "lost"  # in the second stride
    strides = strides_of(replace(track, outcome=tuple(outcome)), "near")
    assert moments(strides, "strike") == pytest.approx(expected()[[0, 2, 3]], abs=CLOSE)
    assert strides.left_out == 1


def test_a_stride_that_missed_a_strike_is_left_out():
    track = stroll(9.0)
    q = track.q.copy()
    hip = WALKER.index("hip_near")
    gone = round(expected()[2])
    q[gone - 15 : gone + 15, hip] = np.linspace(q[gone - 15, hip], q[gone + 15, hip], 30)  # no strike there
    strides = strides_of(replace(track, q=q), "near")
    lengths = np.subtract(moments(strides, "end"), moments(strides, "strike"))
    assert lengths.max() < 1.2 * FPS * PERIOD
    assert strides.left_out == 1


@pytest.mark.parametrize("swing", [0.0, 0.05])
def test_who_stands_has_no_strides(swing):
    assert strides_of(stroll(swings=(swing, swing)), "near").sound == ()


def test_a_figure_lost_throughout_has_no_strides():
    track = stroll()
    assert strides_of(replace(track, outcome=("lost",) * len(track)), "near").sound == ()


@pytest.mark.parametrize("T", [1, 2, 3, 8])
def test_a_clip_of_a_few_frames_has_no_strides(T):
    track = stroll(T / FPS)
    assert len(track) == T
    assert strides_of(track, "near").sound == ()


def run(seconds, *, fps=60.0, period=0.75, duty=0.3, sigma=0.002):
    """The foot goes back at one speed for a share of the stride and is never as fast outside it."""
    times = np.arange(round(seconds * fps)) / fps
    phase = (times / period) % 1.0
    # Ankle ahead of the hip by phase: landing, sweep, follow-through behind, swing ahead, drawn back.
    ahead = np.interp(phase, [0.0, duty, 0.5, 0.9, 1.0], [0.35, -0.35, -0.45, 0.40, 0.35])
    q = np.zeros((len(times), len(WALKER.freedoms)))
    q[:, WALKER.index("hip_near")] = np.arcsin(ahead)
    return track_of(q, times, sigma)


def test_a_runner_is_on_the_floor_only_while_the_foot_sweeps_back():
    fps, period, duty = 60.0, 0.75, 0.3
    strides = strides_of(run(5.0), "near").sound
    assert len(strides) > 3
    shares = [(s.off.at - s.down.at) / (s.end.at - s.strike.at) for s in strides]
    assert shares == pytest.approx([duty] * len(shares), abs=0.04)  # two frames of 45
    for s in strides:
        assert s.strike.at < s.down.at < s.off.at < s.end.at
    whole = np.array([s.down.at for s in strides]) / fps / period
    assert np.mean(whole - np.round(whole)) * period * fps == pytest.approx(0.0, abs=0.3)  # of a frame


@pytest.mark.parametrize(
    ("gait", "name"), [("walk", "strike"), ("walk", "off"), ("run", "down"), ("run", "off")]
)
def test_errors_are_what_independent_noise_does_to_a_moment(rng, gait, name):
    """The slow twin: the moment found anew under many draws of the noise that the covariance speaks of."""
    sigma = 0.002
    # A walker's moments fall well between frames.
    track = run(2.0, sigma=sigma) if gait == "run" else stroll(2.0, start=START + 0.4 / FPS, sigma=sigma)
    event = getattr(strides_of(track, "near").sound[0], name)
    found = []
    for _ in range(130):
        noisy = track.q.copy()
        noisy += rng.normal(scale=sigma, size=noisy.shape)
        found.append(getattr(strides_of(replace(track, q=noisy), "near").sound[0], name).at)
    # 130 draws tell a spread to 6 %; linearising it costs some more.
    assert np.std(found) == pytest.approx(event.error, rel=0.18)


# Late by parts of a frame: the moment before and after the frame it is next to.
@pytest.mark.parametrize(("name", "late"), [("strike", 0.6), ("off", 0.1)])
def test_an_extremes_error_weighs_every_frame_by_what_it_does_to_the_moment(name, late):
    """The delta method with differences, where the frames after the moment are the less sure."""
    track = stroll(2.0, start=START + late / FPS, sigma=0.002)
    event = getattr(strides_of(track, "near").sound[0], name)
    doubt = np.where(np.arange(len(track)) > event.at, 9.0, 1.0)
    track = replace(track, cov=track.cov * doubt[:, None, None])

    def moved(t, i, by):
        q = track.q.copy()
        q[t, i] += by
        return getattr(strides_of(replace(track, q=q), "near").sound[0], name).at

    variance, step = 0.0, 1e-5
    for t in range(round(event.at) - 3, round(event.at) + 4):
        slope = [(moved(t, i, step) - moved(t, i, -step)) / (2.0 * step) for i in range(track.q.shape[1])]
        variance += np.array(slope) @ track.cov[t] @ slope
    error = getattr(strides_of(track, "near").sound[0], name).error
    assert abs(event.at - round(event.at)) > 0.1
    assert error == pytest.approx(np.sqrt(variance), rel=1e-5)  # second order of a step


@pytest.mark.parametrize("count", [2, 3, 40, 400])
def test_peaks_are_those_that_scipy_finds(count, rng):
    for steps in (3, 1000):  # with values alike, and without
        values = rng.integers(0, steps, count) / steps
        for prominence in (0.1, 0.5):
            assert (
                _peaks(values, prominence).tolist() == find_peaks(values, prominence=prominence)[0].tolist()
            )
