"""Gait figures of walks whose cadence, stance, lengths and ranges are known."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from tests.kinematics.figures import HORSE, WALKER
from tests.tracker.strolls import DUTY, PERIOD, SWING, a_run, angle_of, bend, footless, posed, stroll, told
from tests.tracker.tracks import random_track
from tracker.gait.evened import evened
from tracker.gait.figures import LEAST_STANCE, _mean_around, gait_of
from tracker.gait.lengths import Known
from tracker.gait.strides import strides_of


def test_a_known_walk_gets_its_own_figures():
    found = told(stroll())
    cadence, stride = found["cadence"].both, found["stride time"].both
    assert cadence.mean == pytest.approx(120.0 / PERIOD, rel=0.005)
    assert cadence.error / cadence.mean == pytest.approx(stride.error / stride.mean)
    assert cadence.error > 0.0
    assert cadence.count == stride.count
    for side in ("near", "far"):
        assert getattr(found["stride time"], side).mean == pytest.approx(PERIOD, abs=0.005)
        assert getattr(found["step time"], side).mean == pytest.approx(PERIOD / 2.0, abs=0.01)
        # Straight legs are no walk of those that weights were learned from.
        assert getattr(found["stance share"], side).mean == pytest.approx(100.0 * DUTY, abs=4.0)
        swing = getattr(found["swing share"], side)
        assert swing.mean == pytest.approx(100.0 - getattr(found["stance share"], side).mean)
        assert swing.error == getattr(found["stance share"], side).error
        assert getattr(found["hip range"], side).mean == pytest.approx(2.0 * np.degrees(SWING), abs=0.3)
        assert getattr(found["knee range"], side).mean == 0.0
    assert found["torso range"].both.mean == 0.0


def test_a_joint_turns_when_its_angle_is_greatest_or_least():
    track = stroll()
    # The knee is most bent 70 per cent after the near foot's strikes at 0.3 s, 1.4 s ...
    gait = gait_of(posed(track, knee_near=bend(track, 0.7)))
    # Straight legs are no walk of those that weights were learned from: strikes are told late.
    strikes = np.array([stride.strike.at / 30.0 for stride in gait.strides["near"].sound])
    late = 100.0 * (((strikes - 0.3) / 1.1 + 0.5) % 1.0 - 0.5).mean()
    assert late == pytest.approx(2.0, abs=1.5)
    assert gait.named("knee flexion peak").near.mean == pytest.approx(70.0 - late, abs=0.5)
    # Straight legs are farthest back when they leave the floor.
    hip = gait.named("hip extension peak").far
    assert hip.mean == pytest.approx(60.0, abs=3.5)
    assert gait.named("torso range").near is None


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


def test_double_support_is_when_both_feet_are_on_the_ground():
    for offset in (0.5, 0.42):
        track = stroll(9.0, offset=offset)
        strides = strides_of(track, False)
        grid = np.arange(0.0, len(track), 0.05)
        down = {
            side: np.any([(grid >= s.strike.at) & (grid < s.off.at) for s in of.sound], axis=0)
            for side, of in strides.items()
        }
        first, last = strides["near"].sound[1].strike.at, strides["near"].sound[-1].strike.at
        whole = (grid >= first) & (grid < last)
        wanted = 100.0 * (down["near"] & down["far"])[whole].mean()
        assert told(track)["double support"].both.mean == pytest.approx(wanted, abs=0.7)


def test_a_walk_with_too_short_a_stance_is_a_warning_and_no_number():
    """A foot that leaves early: its leg swings back and stays there."""
    gait = gait_of(stroll(9.0, duty=0.35))
    (said,) = gait.warnings
    assert "no foot is on the ground for less than half of its stride" in said
    assert "for the near leg and" in said
    assert LEAST_STANCE == 50.0
    names = {measure.name for measure in gait.measures}
    assert not names & {"stance share", "swing share", "double support"}
    assert {"cadence", "stride time", "stride length"} <= names
    assert gait.summary()["warnings"] == [said]
    assert gait_of(stroll()).warnings == ()


def test_a_run_has_flight_and_no_double_support():
    gait = gait_of(a_run())
    assert gait.motion == "run"
    found = {measure.name: measure for measure in gait.measures}
    assert "double support" not in found
    stance, stride = found["stance share"].both.mean, found["stride time"].both.mean
    wanted = stride * (0.5 - stance / 100.0)
    assert found["flight time"].both.mean == pytest.approx(wanted, abs=0.01)
    assert gait.warnings == ()


@pytest.mark.parametrize("label", ["walk", "run", "free"])
def test_walk_or_run_is_one_decision_that_no_single_cue_makes(label):
    walking, running = stroll(), a_run()
    assert gait_of(replace(walking, labels=(label,))).motion == "walk"
    assert gait_of(replace(running, labels=(label,))).motion == "run"
    bent = posed(walking, knee_near=2.0 * (np.arange(len(walking)) % 33 < 4))
    assert gait_of(bent).motion == "walk"


def test_lengths_are_those_of_the_way_walked_and_metres_those_of_the_height():
    track = stroll(9.0)
    # The stroll's feet slide, so what its root travels is not what its feet say; here they stand.
    found, tall = told(track), told(track, known=Known(height=1.75))
    leg = gait_of(track, known=Known(height=1.75)).leg
    chain = sum(link.length for link in WALKER.links[:4])
    assert leg == pytest.approx(1.75 * 0.961 / chain)
    for name, metres in (("stride length", "m"), ("step length", "m"), ("speed", "m/s")):
        assert found[name].unit == metres.replace("m", "leg lengths")
        assert tall[name].unit == metres
        assert tall[name].both.mean == pytest.approx(leg * found[name].both.mean)
        assert tall[name].both.error == pytest.approx(leg * found[name].both.error)
    assert found["stride length"].near.mean == pytest.approx(1.2 * PERIOD, abs=0.02)
    assert found["speed"].both.mean == pytest.approx(1.2, abs=0.02)
    steps = found["step length"]
    assert steps.near.mean + steps.far.mean == pytest.approx(1.2 * PERIOD, abs=0.04)
    scaled = gait_of(track, known=Known(scale=160.0))
    assert scaled.leg == pytest.approx(track.view.unit / 160.0)


def test_every_stride_has_a_speed_though_the_last_foot_has_hardly_landed():
    gait = gait_of(stroll(6.13))  # the near foot strikes at 5.8 s and is not flat for long enough
    strides = {side: len(of_side.sound) for side, of_side in gait.strides.items()}
    assert gait.named("stride length").near.count == strides["near"] - 1
    assert gait.named("speed").both.count == sum(strides.values())
    assert gait.named("speed").both.mean == pytest.approx(1.2, abs=0.02)


def test_who_walks_backwards_makes_strides_of_the_same_length():
    track = stroll(9.0)
    back = told(replace(track, q=track.q[::-1].copy()))
    assert back["stride length"].both.mean == pytest.approx(told(track)["stride length"].both.mean, abs=0.02)
    assert back["speed"].both.mean > 1.0


def test_who_stays_in_place_has_no_lengths():
    found = told(posed(stroll(), root_x=0.0))
    assert not {"step length", "stride length", "speed"} & set(found)
    assert "stance share" in found


def thinned(walk, gone, **changes):
    """The walk without the rows `gone`."""
    rows = np.setdiff1d(np.arange(len(walk)), gone)
    arrays = {name: getattr(walk, name)[rows] for name in ("times", "q", "cov", "s", "moved")}
    said = {name: getattr(walk, name)[: len(rows)] for name in ("motions", "outcome")}
    return rows, replace(walk, **arrays, **(said | changes))


@pytest.mark.parametrize("gone", [range(1, 135, 2), range(136, 270, 2)])
def test_a_film_with_fewer_frames_in_half_of_it_gives_the_same_figures(gone):
    walk = stroll(9.0)
    rows, film = thinned(walk, gone, first=40)
    gait, whole = gait_of(film), gait_of(walk)
    assert gait.discord < 0.01
    for measure in whole.measures:
        found = gait.named(measure.name)
        assert (found.near and found.near.count) == (measure.near and measure.near.count)
        slack = 0.015 * abs(measure.both.mean) + 0.6 * ("%" in measure.unit)
        assert found.both.mean == pytest.approx(measure.both.mean, abs=slack), measure.name
    for side, of_side in gait.strides.items():
        frames = [stride.strike.at - 40 for stride in of_side.sound]
        strikes = [stride.strike.at for stride in whole.strides[side].sound]
        assert np.interp(frames, np.arange(len(rows)), rows) == pytest.approx(strikes, abs=0.4)


def test_frames_not_measured_stay_so_where_times_are_evened():
    walk = stroll(3.0)
    assert evened(walk) is walk
    outcome = ["ok"] * 60
    outcome[10] = "lost"  # row 20 of the walk
    _, film = thinned(walk, range(1, 60, 2), outcome=outcome)
    even = evened(film)
    assert even.times == pytest.approx(walk.times)
    assert np.flatnonzero(~even.measured).tolist() == [19, 20, 21]


def test_less_than_a_stride_is_no_number():
    gait = gait_of(stroll(0.9))
    assert gait.measures == ()
    assert gait.summary()["measures"] == {}


def test_legs_that_were_exchanged_are_in_discord():
    assert gait_of(stroll()).discord < 0.01
    far = posed(stroll(9.0), hip_far=angle_of(stroll(9.0, period=1.5), "hip_far"))
    assert gait_of(far).discord == pytest.approx(1.5 / 1.1 - 1.0, abs=0.02)


def test_a_figure_without_these_legs_has_no_gait(rng):
    assert gait_of(random_track(rng, figure=HORSE)) is None
    others = {"shank_near": "left_shin", "shank_far": "right_shin"}
    links = (replace(link, freedom=others.get(link.name, link.freedom)) for link in WALKER.links)
    assert gait_of(random_track(rng, figure=replace(WALKER, links=tuple(links), panels=()))) is None


def test_footless_there_is_no_range_of_the_ankles():
    track = stroll()
    assert "ankle range" in told(track)
    found = told(footless(track))
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
    assert set(news["strides"]["near"][0]) == {"strike", "off", "end"}
    assert (news["motion"], news["metres_in_leg"]) == ("walk", None)


def test_a_long_walk_takes_little_more_memory_than_its_poses():
    track = stroll(seconds=120.0)
    gait_of(track)  # what is read once stays
    tracemalloc.start()
    try:
        gait_of(track)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 5000 * len(track)


@pytest.mark.parametrize("wide", [1, 2, 3, 8, 11, 30])
def test_a_running_mean_is_over_the_values_around_however_few(wide, rng):
    values = rng.normal(size=9)
    before, after = wide // 2, (wide - 1) // 2
    want = [values[max(t - before, 0) : t + after + 1].mean() for t in range(len(values))]
    assert _mean_around(values, wide) == pytest.approx(want)
