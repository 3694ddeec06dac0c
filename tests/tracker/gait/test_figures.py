"""Gait figures of walks whose cadence, stance and ranges are known, and of captured people."""

import csv
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kinematics.figure import load_figure
from kinematics.mocap import read_trials, sequences
from tests.kinematics.figures import HORSE, WALKER
from tests.tracker.strolls import SWING, stroll, track_of
from tests.tracker.tracks import random_track
from tracker.gait.figures import gait_of

PERIOD, DUTY = 1.1, 0.6


def told(track, rate=1.0):
    return {measure.name: measure for measure in gait_of(track, rate).measures}


def test_a_known_walk_gets_its_own_figures():
    found = told(stroll())
    cadence, stride = found["cadence"].both, found["stride time"].both
    assert cadence.mean == pytest.approx(120.0 / PERIOD, rel=0.005)
    assert cadence.error / cadence.mean == pytest.approx(stride.error / stride.mean)
    assert cadence.error > 0.0
    for side in ("near", "far"):
        assert getattr(found["stride time"], side).mean == pytest.approx(PERIOD, abs=0.005)
        assert getattr(found["step time"], side).mean == pytest.approx(PERIOD / 2.0, abs=0.005)
        # Off and strike are each a sixth of a frame of 33 aside.
        assert getattr(found["stance share"], side).mean == pytest.approx(100.0 * DUTY, abs=1.0)
        assert getattr(found["hip range"], side).mean == pytest.approx(2.0 * np.degrees(SWING), abs=0.3)
        assert getattr(found["knee range"], side).mean == 0.0
    assert found["torso range"].both.mean == 0.0
    assert found["torso range"].near is None


def test_at_half_speed_times_halve_and_angles_stay():
    track = stroll()
    slow, real = told(track, 0.5), told(track)
    assert slow["cadence"].both.mean == pytest.approx(2.0 * real["cadence"].both.mean)
    for name in ("stride time", "step time"):
        assert slow[name].far.mean == pytest.approx(0.5 * real[name].far.mean)
        assert slow[name].far.error == pytest.approx(0.5 * real[name].far.error)
    for name in ("stance share", "hip range"):
        assert slow[name] == real[name]


def test_seconds_are_those_of_the_frames_where_their_rate_varies():
    track = stroll()
    stretched = replace(track, times=track.times + 0.02 * np.sin(track.times))
    found = gait_of(stretched)
    span = found.strides["near"].sound[-1].end.at, found.strides["near"].sound[0].strike.at
    seconds = np.subtract(*np.interp(span, np.arange(len(track)), stretched.times))
    strides = next(m for m in found.measures if m.name == "stride time").near
    assert strides.mean * strides.count == pytest.approx(seconds)


def test_a_limp_shows_in_the_steps_and_not_in_the_strides():
    """The far foot follows the near one sooner than the near one follows it."""
    found = told(stroll(9.0, offset=0.42))
    steps, symmetry = found["step time"], found["step time"].symmetry
    assert (steps.near.mean, steps.far.mean) == pytest.approx((0.58 * PERIOD, 0.42 * PERIOD), abs=0.01)
    assert symmetry.mean == pytest.approx(100.0 * (0.58 - 0.42) / 0.5, abs=2.0)
    assert symmetry.mean > 10.0 * symmetry.error
    assert found["stride time"].symmetry is None


def test_the_legs_ranges_are_their_own_and_the_symmetry_is_between_them():
    found = told(stroll(swings=(SWING, 0.8 * SWING)))["hip range"]
    assert found.far.mean == pytest.approx(0.8 * found.near.mean, rel=0.01)
    assert found.both.mean == pytest.approx((found.near.mean + found.far.mean) / 2.0)
    assert found.symmetry.mean == pytest.approx(100.0 * 0.2 / 0.9, abs=1.0)
    exchanged = told(stroll(swings=(0.8 * SWING, SWING)))["hip range"]
    assert exchanged.symmetry.mean == pytest.approx(-found.symmetry.mean, abs=1.0)


def test_an_error_holds_what_the_covariance_says_and_what_strides_differ_by():
    """By hand, for ranges: two variances a stride, and the strides' own spread."""
    track = stroll(9.0, sigma=0.01)
    hip = WALKER.index("hip_near")
    track.q[:, hip] *= 1.0 + 0.1 * np.sin(track.times)
    found = gait_of(track)
    strides = found.strides["near"].sound
    measure = next(m for m in found.measures if m.name == "hip range").near
    angles = np.degrees(track.q[:, hip])
    own = [
        np.ptp([a for t, a in enumerate(angles) if stride.strike.at <= t <= stride.end.at])
        for stride in strides
    ]
    assert measure.mean == pytest.approx(np.mean(own))
    expected = np.sqrt((np.var(own, ddof=1) + 2.0 * np.degrees(0.01) ** 2) / len(own))
    assert measure.error == pytest.approx(expected)


def test_the_error_of_a_stance_is_what_independent_noise_does_to_it(rng):
    """The slow twin: one stride's stance found anew under many draws of the noise."""
    sigma = 0.002
    track = stroll(2.0, sigma=sigma)
    value = told(track)["stance share"].near
    assert value.count == 1
    found = [
        told(replace(track, q=track.q + rng.normal(scale=sigma, size=track.q.shape)))[
            "stance share"
        ].near.mean
        for _ in range(200)
    ]
    # 200 draws tell a spread to 5 %; linearising it costs some more.
    assert np.std(found) == pytest.approx(value.error, rel=0.17)


def test_errors_of_both_legs_and_of_their_symmetry_come_from_the_legs_own():
    track = stroll(9.0, swings=(SWING, 0.7 * SWING), sigma=0.01)
    unlike = np.ones(len(WALKER.freedoms))
    unlike[WALKER.index("hip_far")] = 3.0
    found = told(replace(track, cov=track.cov * np.outer(unlike, unlike)))["hip range"]
    near, far = found.near, found.far
    assert far.error > 2.0 * near.error
    assert found.both.error == pytest.approx((near.error + far.error) / 2.0)

    def index(a, b):
        return 100.0 * (a - b) / ((a + b) / 2.0)

    step = 1e-4
    by_near = (index(near.mean + step, far.mean) - index(near.mean - step, far.mean)) / (2.0 * step)
    by_far = (index(near.mean, far.mean + step) - index(near.mean, far.mean - step)) / (2.0 * step)
    assert found.symmetry.mean == pytest.approx(index(near.mean, far.mean))
    assert found.symmetry.error == pytest.approx(np.hypot(by_near * near.error, by_far * far.error), rel=1e-5)


def test_two_errors_cover_the_truth_about_as_often_as_they_should(rng):
    """Forty walks under the very noise that their covariance speaks of."""
    sigma, inside, trials = 0.004, {"stride time": 0, "step time": 0, "stance share": 0}, 40
    truth = told(stroll(7.0, sigma=sigma))
    for _ in range(trials):
        track = stroll(7.0, sigma=sigma)
        found = told(replace(track, q=track.q + rng.normal(scale=sigma, size=track.q.shape)))
        for name in inside:
            value = found[name].near
            inside[name] += abs(value.mean - truth[name].near.mean) < 2.0 * value.error
    assert min(inside.values()) >= 0.85 * trials


def test_one_stride_has_the_covariances_error_alone():
    found = told(stroll(2.0, sigma=0.01))["hip range"].near
    assert found.count == 1
    assert found.error == pytest.approx(np.sqrt(2.0) * np.degrees(0.01))


def test_less_than_a_stride_is_no_number():
    gait = gait_of(stroll(0.9))
    assert gait.measures == ()
    assert gait.summary()["measures"] == {}


def test_strides_in_which_the_figure_was_lost_are_counted_as_left_out():
    track = stroll()
    outcome = list(track.outcome)
    outcome[60] = "outside"
    gait = gait_of(replace(track, outcome=tuple(outcome)))
    assert gait.left_out == 2  # one of either leg
    assert sum(len(s.sound) for s in gait.strides.values()) == 6


def test_legs_that_were_exchanged_are_in_discord():
    assert gait_of(stroll()).discord < 0.01
    track = stroll(9.0)
    far = track.q.copy()
    far[:, WALKER.index("hip_far")] = stroll(9.0, period=1.5).q[:, WALKER.index("hip_far")]
    assert gait_of(replace(track, q=far)).discord == pytest.approx(1.5 / 1.1 - 1.0, abs=0.02)


def test_a_figure_without_these_legs_has_no_gait(rng):
    assert gait_of(random_track(rng, figure=HORSE)) is None


def test_without_feet_there_is_no_range_of_the_ankles():
    track = stroll()
    assert "ankle range" in told(track)
    bare = replace(WALKER, links=tuple(link for link in WALKER.links if "foot" not in link.name))
    kept = [track.figure.index(name) for name in bare.freedoms]
    found = told(replace(track, figure=bare, q=track.q[:, kept], cov=track.cov[:, kept][:, :, kept]))
    assert "ankle range" not in found
    assert found["hip range"] == told(track)["hip range"]


def test_the_summary_says_what_was_found():
    gait = gait_of(stroll(), rate=0.5)
    news = gait.summary()
    assert news["rate"] == 0.5
    assert news["measures"]["cadence"]["unit"] == "steps/min"
    value = next(m for m in gait.measures if m.name == "stance share").far
    assert news["measures"]["stance share"]["far"] == {
        "mean": round(value.mean, 4), "error": round(value.error, 4), "count": 4,
    }  # fmt: skip
    assert [s["strike"] for s in news["strides"]["near"]] == sorted(
        s["strike"] for s in news["strides"]["near"]
    )
    assert set(news["strides"]["near"][0]) == {"strike", "down", "off", "end"}


def captures(activity):
    """(trial's row, track) of every capture of one straight segment."""
    data = os.environ.get("FIGTRACK_DATA")
    table = Path(data) / "mocap" / "trials.csv" if data else None
    if table is None or not table.exists():
        pytest.skip("captures want $FIGTRACK_DATA/mocap/trials.csv")
    with table.open(newline="", encoding="utf-8") as file:
        rows = {Path(row["file"]).name: row for row in csv.DictReader(file)}
    walker = load_figure("walker")
    for trial in read_trials(table):
        row = rows[trial.path.name]
        if trial.activity != activity or not row["duty"] or not row["stride_s"] or ";" in row["segments"]:
            continue
        for sequence in sequences(trial, 30.0):
            q = np.zeros((len(sequence.y), len(walker.freedoms)))
            q[:, : sequence.y.shape[1]] = sequence.y
            yield row, track_of(q, np.arange(len(q)) / 30.0)


@pytest.mark.parametrize(
    ("activity", "least", "bias", "spread"), [("walk", 40, 3.0, 6.0), ("run", 15, 8.0, 7.0)]
)
def test_captured_people_have_the_stride_time_and_the_stance_that_their_table_says(
    activity, least, bias, spread
):
    """The table's duty is from the feet's heights in space; ours from thighs and shanks alone."""
    times, shares = [], []
    for row, track in captures(activity):
        found = told(track)
        if found:
            times.append(found["stride time"].both.mean - float(row["stride_s"]))
            shares.append(found["stance share"].both.mean - 100.0 * float(row["duty"]))
        if len(times) == 2 * least:
            break
    assert len(times) >= least
    assert np.sqrt(np.mean(np.square(times))) < 0.015  # half a frame
    assert abs(np.mean(shares)) < bias
    assert np.std(shares) < spread
