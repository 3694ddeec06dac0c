"""What a report says of a gait in two sentences."""

from dataclasses import replace

import pytest

from tests.kinematics.figures import HORSE, WALKER
from tests.tracker.report.test_chapter import chapter
from tests.tracker.strolls import SWING, stroll
from tests.tracker.tracks import random_track
from tracker.gait.figures import gait_of
from tracker.gait.lengths import Known
from tracker.report.chapter import headline, unusual


def test_the_headline_has_cadence_speed_and_stance():
    told = chapter()
    stance = told.gait.named("stance share")
    assert headline(told) == (
        "Walks at 109 steps a minute, 1.20 leg lengths a second; "
        f"stance {stance.near.mean:.0f} % near, {stance.far.mean:.0f} % far."
    )
    metres = chapter(gait=gait_of(told.track, known=Known(scale=160.0)))
    assert f"minute, {1.2 * metres.gait.leg:.2f} m a second;" in headline(metres)
    assert headline(chapter(gait=replace(told.gait, motion="run"))).startswith("Runs at 109 steps")


def test_what_was_not_measured_is_not_told():
    told = chapter()
    kept = tuple(m for m in told.gait.measures if m.name not in ("stance share", "speed"))
    assert headline(chapter(gait=replace(told.gait, measures=kept))) == "Walks at 109 steps a minute."


def test_who_goes_backwards_is_said_to():
    track = stroll()
    assert headline(chapter(replace(track, q=track.q[::-1].copy()))).startswith("Walks backwards at 109")


def test_without_gait_figures_nothing_is_said(rng):
    for track in (stroll(0.9), random_track(rng, figure=HORSE)):
        assert (headline(chapter(track)), unusual(chapter(track))) == ("", "")


def test_legs_that_do_alike_are_nothing_unusual():
    assert unusual(chapter()).startswith("Nothing unusual")


@pytest.mark.parametrize(("near", "far", "leg"), [(1.0, 0.8, "near"), (0.8, 1.0, "far")])
def test_a_leg_that_swings_further_is_unusual(near, far, leg):
    told = chapter(stroll(9.0, swings=(near * SWING, far * SWING)))
    by = abs(told.gait.named("hip range").symmetry.mean)
    assert by == pytest.approx(22.0, abs=1.0)
    assert f"hip range {by:.0f} % greater on the {leg} leg" in unusual(told)
    assert "swing share" not in unusual(told)


def test_a_step_that_lasts_longer_is_unusual():
    told = chapter(stroll(9.0, offset=0.42))
    by = told.gait.named("step time").symmetry.mean
    assert by == pytest.approx(32.0, abs=2.0)
    assert f"step time {by:.0f} % longer on the near leg" in unusual(told)


def test_differences_within_their_errors_or_of_a_few_per_cent_are_nothing_unusual():
    for track in (
        stroll(9.0, swings=(SWING, 0.93 * SWING)),
        stroll(9.0, swings=(SWING, 0.8 * SWING), sigma=0.2),
    ):
        assert "hip range" not in unusual(chapter(track))


def test_one_stride_is_too_few_to_compare_legs():
    track = stroll(3.2, swings=(SWING, 0.7 * SWING))
    told = chapter(track)
    assert min(len(of_side.sound) for of_side in told.gait.strides.values()) == 1
    assert unusual(told) == "Too few strides to compare the legs."


def test_warnings_and_legs_in_discord_are_counted_in():
    assert unusual(chapter(warnings=["a"])) == "Unusual: 1 warning at the top of the page."
    assert unusual(chapter(warnings=["a", "b"])).endswith("2 warnings at the top of the page.")
    track = stroll(9.0)
    q = track.q.copy()
    q[:, WALKER.index("hip_far")] = stroll(9.0, period=1.5).q[:, WALKER.index("hip_far")]
    assert "the legs' stride times differ" in unusual(chapter(replace(track, q=q)))
