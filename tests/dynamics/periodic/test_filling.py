"""Gaps filled by a stride: what it draws itself, which strides are counted, and where gaps are cut."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.periodic.filling import SPACING, around, fill, gaps, hypotheses, spaced, starts
from dynamics.stride import combine_strides
from tests.dynamics.periodic.strides import FPS, drawn, little, noisy


def interpolate(stride, y, fps):
    return [fill(stride, y, rows, fps) for rows in gaps(stride, y, fps)]


def holed(stride, T, first, stop, rng, **more):
    """Poses without noise, and measured ones with a gap."""
    _, y, _ = drawn(stride, T, rng, **more)
    given = noisy(stride, y, rng)
    given[first:stop] = np.nan
    return y, given


def test_the_best_start_is_near_the_true_phase_and_speed(rng):
    stride = little(rng, drift=0.05)
    t, y, phase = drawn(stride, 80, rng)
    begin, speed, _ = starts(stride, 0, t, noisy(stride, y, rng))[0]
    away = begin - np.interp(0.0, t, phase)
    assert abs((away + np.pi) % (2.0 * np.pi) - np.pi) < 0.5
    assert speed == pytest.approx(np.polyfit(t, phase, 1)[0], rel=0.1)


def test_two_sigma_hold_most_of_what_the_stride_draws_itself(rng):
    stride = little(rng)
    inside, errors = [], []
    for _ in range(12):
        y, given = holed(stride, 60, 22, 38, rng)
        (gap,) = interpolate(stride, given, FPS)
        assert_array_equal(gap.rows, np.arange(22, 38))
        away = gap.poses.mean - y[22:38]
        inside.append(np.abs(away) <= 2.0 * np.sqrt(np.diagonal(gap.poses.cov, axis1=1, axis2=2)))
        errors.append(away[:, 1:])
    # 768 cells that are far from independent.
    assert 0.85 < np.mean(inside) < 0.995
    assert np.sqrt(np.mean(np.square(errors))) < 0.07


def test_single_freedoms_that_are_missing_are_filled_from_the_others(rng):
    stride = little(rng)
    y, given = holed(stride, 60, 0, 0, rng)
    given[20:40, 2] = np.nan
    (gap,) = interpolate(stride, given, FPS)
    assert np.sqrt(np.mean((gap.poses.mean - y[20:40])[:, 2] ** 2)) < 0.06


def test_the_motion_is_the_one_that_explains_what_was_measured(rng):
    walk, run = little(rng), little(rng, speed=10.0, hurry=0.3, label="run")
    both = combine_strides([walk, run])
    for stride in (walk, run):
        t, y, _ = drawn(stride, 70, rng)
        given = noisy(stride, y, rng)
        given[30:40], given[:, 0] = np.nan, np.nan
        best = hypotheses(both, t, given)[0]
        assert both.labels[best.stretch.k] == stride.labels[0]


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_strides_across_a_long_gap_are_counted_in_more_ways_than_one_and_each_once(noise, rng):
    stride = little(rng, hurry=1.5)
    t, y, _ = drawn(stride, 130, rng)
    given = noisy(stride, y, rng) + noise * rng.normal(size=y.shape)
    given[10:120] = np.nan
    given[:, 0] = np.nan
    found = hypotheses(stride, t, given)
    turns = {round((h.phase[-1] - h.phase[0]) / (2.0 * np.pi)) for h in found}
    assert len(turns) > 1
    evidence = [h.log_evidence for h in found]
    assert evidence == sorted(evidence, reverse=True)
    for one, other in combinations(found, 2):
        apart = (one.phase - other.phase) / (2.0 * np.pi)
        assert np.abs(apart - np.round(apart.mean())).max() > 0.05


def test_noise_beyond_what_was_learned_is_noticed(rng):
    stride = little(rng)
    _, y, _ = drawn(stride, 60, rng)
    given = y + 0.1 * rng.normal(size=y.shape) * [0.3, 1.0, 1.0, 1.0]
    given[25:35] = np.nan
    best = hypotheses(stride, (np.arange(60) - 30) / FPS, given)[0]
    assert 0.04 <= np.sqrt(best.stretch.noise[1]) <= 0.15
    quiet = hypotheses(
        stride, (np.arange(60) - 30) / FPS, np.where(np.isnan(given), np.nan, noisy(stride, y, rng))
    )
    assert np.max(quiet[0].stretch.noise) < 0.03**2


@pytest.mark.parametrize(("times", "kept"), [(2, 1), (8, 1), (8, 8)])
def test_of_a_faster_camera_thirty_frames_a_second_are_used_around_a_gap(times, kept, rng):
    stride = little(rng)
    _, y, _ = drawn(stride, 20 * times + 1, rng, fps=30.0 * times)
    given = noisy(stride, y, rng)
    given[8 * times + 1 : 11 * times] = np.nan
    given[np.arange(len(given)) % kept > 0] = np.nan
    fast = fill(stride, given, np.arange(8 * times + 1, 11 * times), 30.0 * times)
    (slow,) = interpolate(stride, given[::times], 30.0)
    # The phase may drift in other shapes between more frames.
    assert_allclose(fast.poses.mean[times - 1 :: times], slow.poses.mean, atol=2e-3)
    assert_allclose(fast.poses.cov[times - 1 :: times], slow.poses.cov, atol=1e-4)


def test_a_place_that_was_never_measured_makes_no_gap_and_long_runs_are_cut(rng):
    stride = little(rng)
    y = np.zeros((200, 4))
    y[:, 0] = np.nan
    assert list(gaps(stride, y, FPS)) == []
    y[3:190, 2] = np.nan
    runs = list(gaps(stride, y, FPS))
    assert_array_equal(np.concatenate(runs), np.arange(3, 190))
    assert max(map(len, runs)) == 60
    y[:, 1:] = np.nan
    y[0], y[-1] = 0.0, 0.0
    assert [len(run) for run in gaps(stride, y, FPS)] == [198]


def test_a_window_holds_two_seconds_of_measured_frames_on_either_side():
    y = np.zeros((300, 4))
    y[100:150] = np.nan
    assert around(y, np.arange(100, 150), FPS) == slice(40, 210)
    assert around(y[:160], np.arange(100, 150), FPS) == slice(40, 160)
    assert around(y[100:160], np.arange(50), FPS) == slice(0, 60)
    y[60:90] = np.nan
    assert around(y, np.arange(100, 150), FPS) == slice(10, 210)
    y[np.arange(300) % 10 > 0] = np.nan
    assert around(y, np.arange(151, 160), FPS) == slice(30, 281)


def test_nothing_measured_and_a_very_long_gap_are_refused(rng):
    y = np.full((9, 4), np.nan)
    y[:3, 0] = 0.0
    with pytest.raises(ValueError, match="no angle was measured near a gap"):
        interpolate(little(rng), y, FPS)
    with pytest.raises(ValueError, match="a gap has 2000 frames, of which a stride fills 1800 at most; give"):
        fill(little(rng), y, np.arange(2000), FPS)


def test_frames_that_are_judged_are_measured_and_lie_apart():
    y = np.arange(40.0).repeat(2).reshape(40, 2)
    y[[0, 1, 6, 7, 8]] = np.nan
    y[3, 0] = np.nan
    for fps, every in ((30.0, 6), (60.0, 12), (10.0, 2), (4.0, 1)):
        found = spaced(y, fps)
        kept = np.flatnonzero(np.isfinite(found).any(1))
        assert_array_equal(kept, np.flatnonzero(np.isfinite(y).any(1))[::every])
        assert_array_equal(found[kept], y[kept])
    y[np.arange(40) % 8 > 0] = np.nan
    assert_array_equal(spaced(y, FPS), y)


def test_the_evidence_is_that_of_frames_apart(rng):
    stride = little(rng)
    _, given = holed(stride, 20, 9, 12, rng, fps=1.0 / SPACING)
    (gap,) = interpolate(stride, given, 1.0 / SPACING)
    t = (np.arange(20) - gap.rows.mean()) * SPACING
    best = hypotheses(stride, t, np.where(stride.travels, np.nan, given))[0]
    # What the search still gains from where it ended.
    assert gap.log_evidence == pytest.approx(best.log_evidence, abs=1e-2)
    _, given = holed(stride, 80, 36, 42, rng)
    (gap,) = interpolate(combine_strides([stride, replace(stride, labels=("run",))]), given, FPS)
    t = (np.arange(80) - gap.rows.mean()) / FPS
    (coarse, *_) = hypotheses(stride, t[::6], np.where(stride.travels, np.nan, given)[::6])
    # Every motion is as probable; the residual's scales and the search differ a little between the two ways.
    assert gap.log_evidence == pytest.approx(coarse.log_evidence - np.log(2.0), abs=1.0)
