"""Strikes and leavings of walks whose every moment is known, and what must hold of any."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import find_peaks

from tests.benchmarks.gait.learn import figure_of, poses
from tests.benchmarks.gait.truth import contacts
from tests.benchmarks.rendered.captures import RATE
from tests.kinematics.figures import WALKER
from tests.tracker.strolls import angle_of, footless, lost_in, posed, stroll, track_of
from tracker.gait.moments import _peaks
from tracker.gait.strides import goes_backwards, strides_of
from tracker.scene.steps import random_build, walk

FPS, PERIOD, START = 30.0, 1.1, 0.3


def of(track, side):
    return strides_of(track, False)[side]


def moments(strides, name):
    return np.array([getattr(stride, name).at for stride in strides.sound])


def a_walk(seed):
    """A textbook's walk in somebody's lengths, and when its feet are on the ground."""
    rng = np.random.default_rng(seed)
    build = random_build(rng)
    gait = walk(build, round(6.0 * RATE), PERIOD * RATE, rng)
    shown = np.arange(0, len(gait.pose), round(RATE / FPS))
    figure = figure_of(build)
    track = track_of(poses(figure, build, gait.at(shown)), shown / RATE)
    return replace(track, figure=figure), contacts(gait, build)


@pytest.mark.parametrize(("feet", "leaves"), [(True, 0.025), (False, 0.03)])
def test_a_walk_that_no_weight_was_learned_from_strikes_and_leaves_when_it_does(feet, leaves):
    late = {"strike": [], "off": []}
    for seed in range(6):
        track, truth = a_walk(seed)
        if not feet:
            track = footless(track)
        for side, strides in strides_of(track, False).items():
            for name, found in late.items():
                true = np.array([getattr(contact, name) for contact in truth[side]])
                for event in strides.strikes if name == "strike" else strides.offs:
                    away = np.abs(event.at / FPS - true).min()
                    found += [away] * bool(away < 0.5 * PERIOD)  # others have their truth beyond the end
    assert min(map(len, late.values())) > 45
    assert np.median(late["strike"]) < 0.015
    assert np.quantile(late["strike"], 0.9) < 0.025
    # The made-up figure drags its toes: when it leaves the ground is less exact than where it strikes.
    assert np.median(late["off"]) < leaves


@pytest.mark.parametrize("side", ["near", "far"])
def test_every_stride_of_an_even_walk_is_alike(side):
    strides = of(stroll(), side)
    assert len(strides.sound) == 4
    assert np.diff(moments(strides, "strike")) == pytest.approx(FPS * PERIOD, abs=0.1)
    assert moments(strides, "end")[:-1].tolist() == moments(strides, "strike")[1:].tolist()
    assert np.ptp(moments(strides, "off") - moments(strides, "strike")) < 0.1
    assert strides.left_out == 0


def test_moments_fall_between_frames():
    """To 10 ms: the ramps of the made-up swing have corners, and are sampled elsewhere."""
    first = moments(of(stroll(), "near"), "strike")
    for late in (0.25, 0.5, 0.75):
        moved = moments(of(stroll(start=START + late / FPS), "near"), "strike")
        assert moved == pytest.approx(first + late, abs=0.3)


def test_at_any_frame_rate_the_strides_are_the_same():
    lengths = []
    for fps in (24.0, 60.0, 120.0):
        strides = of(stroll(fps=fps), "near").sound
        lengths += [(s.end.at - s.strike.at) / fps for s in strides]
    assert lengths == pytest.approx([PERIOD] * len(lengths), abs=0.015)


def test_frames_are_those_of_the_clip():
    track = stroll()
    later = of(replace(track, first=100), "near")
    for name in ("strike", "off", "end"):
        assert moments(later, name) == pytest.approx(moments(of(track, "near"), name) + 100)
    assert later.strikes[0].at == pytest.approx(of(track, "near").strikes[0].at + 100)


def test_who_walks_backwards_strikes_where_with_time_running_back_a_foot_leaves():
    track = stroll()
    ahead, back = of(track, "near"), of(replace(track, q=track.q[::-1].copy()), "near")
    last = len(track) - 1
    assert [event.at for event in back.strikes] == pytest.approx([last - e.at for e in ahead.offs[::-1]])
    assert [event.at for event in back.offs] == pytest.approx([last - e.at for e in ahead.strikes[::-1]])


def test_who_stays_in_place_or_drifts_back_on_a_treadmill_walks_forwards():
    track = stroll(20.0)
    ways = 0.0, np.linspace(0.0, -0.8, len(track))
    there, here = (of(posed(track, root_x=way), "near") for way in ways)
    assert len(there.sound) == len(of(track, "near").sound)
    assert moments(here, "strike") == pytest.approx(moments(there, "strike"), abs=0.01)
    assert goes_backwards(replace(track, q=track.q[::-1].copy()))


def test_strides_in_which_the_figure_was_lost_are_left_out():
    track = stroll()
    strides = of(lost_in(track, 50), "near")  # in the second stride
    whole = moments(of(track, "near"), "strike")
    assert moments(strides, "strike").tolist() == whole[[0, 2, 3]].tolist()
    assert strides.left_out == 1


@pytest.mark.parametrize(
    ("walks", "kept"),
    [((0.7, 9.0), slice(1, None)), ((1.2, 9.0), slice(2, None)), ((0.0, 8.2), slice(-1))],
    ids=["from a stand", "from a longer one", "to a stand"],
)
def test_strides_within_half_a_stride_of_a_stand_are_left_out(walks, kept):
    track = stroll(9.0)
    every = of(track, "near").sound  # strikes at 0.3 s, 1.4 s .. 6.9 s, the last stride ends at 8 s
    found = of(posed(track, root_x=1.2 * np.clip(track.times, *walks)), "near")
    assert found.sound == every[kept]
    assert found.left_out == len(every) - len(found.sound)


def test_who_is_lost_does_not_stand():
    track = stroll(9.0)
    lost = track.times < 0.25
    held = posed(track, root_x=np.where(lost, 0.3, angle_of(track, "root_x")))
    found = of(lost_in(held, *np.flatnonzero(lost)), "near")
    assert len(found.sound) == len(of(track, "near").sound)


def test_nobody_stands_in_slow_motion(rng):
    track = stroll(9.0, fps=240.0)
    shaky = posed(track, root_x=angle_of(track, "root_x") + rng.normal(scale=0.005, size=len(track)))
    slow = replace(shaky, times=8.0 * track.times)
    assert len(of(slow, "near").sound) == len(of(track, "near").sound)


def test_a_stride_that_missed_a_strike_is_left_out():
    track = stroll(9.0)
    q = track.q.copy()
    hip = WALKER.index("hip_near")
    gone = round(of(track, "near").strikes[2].at)
    q[gone - 15 : gone + 15, hip] = np.linspace(q[gone - 15, hip], q[gone + 15, hip], 30)  # no strike there
    strides = of(replace(track, q=q), "near")
    lengths = moments(strides, "end") - moments(strides, "strike")
    assert lengths.max() < 1.2 * FPS * PERIOD
    assert strides.left_out == 1


NO_STRIDES = {"standing": stroll(swings=(0.0, 0.0)), "swaying": stroll(swings=(0.05, 0.05))}
NO_STRIDES |= {f"{T} frames": stroll(T / FPS) for T in (1, 2, 3, 8)}
NO_STRIDES["lost throughout"] = lost_in(stroll(), *range(180))


@pytest.mark.parametrize("what", NO_STRIDES)
def test_who_stands_or_is_hardly_seen_has_no_strides(what):
    assert of(NO_STRIDES[what], "near").sound == ()


def test_an_error_grows_with_the_poses_covariance():
    """The delta method with differences: the moment found anew with each pose moved a little."""
    track = stroll(2.6, sigma=0.05)
    event, sure = of(track, "near").sound[0].strike, of(stroll(2.6, sigma=0.0), "near").sound[0].strike

    def moved(t, i, by):
        q = track.q.copy()
        q[t, i] += by
        return of(replace(track, q=q), "near").sound[0].strike.at

    variance, step = 0.0, 1e-6
    for t in range(round(event.at) - 6, round(event.at) + 7):
        slope = [(moved(t, i, step) - moved(t, i, -step)) / (2.0 * step) for i in range(track.q.shape[1])]
        variance += np.array(slope) @ track.cov[t] @ slope
    assert event.error**2 - sure.error**2 == pytest.approx(variance, rel=1e-3)


@pytest.mark.parametrize("count", [2, 3, 40, 400])
def test_peaks_are_those_that_scipy_finds(count, rng):
    for steps in (3, 1000):  # with values alike, and without
        values = rng.integers(0, steps, count) / steps
        for prominence in (0.1, 0.5):
            assert (
                _peaks(values, prominence).tolist() == find_peaks(values, prominence=prominence)[0].tolist()
            )
