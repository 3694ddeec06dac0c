"""What a report tells of one run: facts, cautions and its gait in words, curves and stretches in numbers."""

from dataclasses import replace

import numpy as np
import pytest

from kinematics.spm import UNMOVED
from tests.kinematics.figures import HORSE, WALKER
from tests.tracker.report.reports import chapter
from tests.tracker.strolls import SWING, angle_of, bend, lost_in, posed, stroll
from tests.tracker.tracks import random_track
from tracker.gait.curves import norm_of
from tracker.gait.figures import gait_of
from tracker.gait.lengths import Known
from tracker.gait.strides import goes_backwards
from tracker.report.chapter import Chapter, headline, unusual


def said(chapter, words):
    return any(words in text for text in chapter.cautions())


def test_facts_count_the_outcomes_in_words():
    track = stroll(1.0)
    track = replace(track, outcome=("ok",) * 20 + ("lost",) * 6 + ("found",) + ("ok",) * 3)
    facts = dict(chapter(track).facts())
    assert facts["Tracked"] == "23 all in view, 6 lost: nothing matched, 1 found again"
    assert facts["Frames"] == "30 at 30 a second, 1.0 s"
    part = chapter(track)
    part = replace(part, run=replace(part.run, frames=100))  # of which the others were not followed
    assert dict(part.facts())["Frames"] == "30 at 30 a second, 1.0 s"
    assert facts["Faces"] == "right, so near is the right side"


def test_a_playback_speed_is_told_where_it_was_given_or_is_not_an_ordinary_one():
    def speed(**changes):
        return dict(chapter(**changes).facts()).get("Playback speed", "").partition(", ")[2]

    assert speed(rate=1.19) == ""
    assert speed(rate=0.5) == "as the motion looks"
    assert speed(given=True) == "as given"


def test_what_limits_a_gait_is_said_and_a_clear_walk_has_no_cautions():
    assert chapter().cautions() == []
    assert said(chapter(posed(stroll(), root_x=0.0)), "No lengths and no speed")
    assert said(chapter(stroll(0.9)), "No gait figures")
    assert said(chapter(stroll(2.0)), "A figure of one stride")
    assert said(chapter(lost_in(stroll(), 55)), "Left out: 2 strides with")
    apart = posed(stroll(), hip_far=angle_of(stroll(period=1.4), "hip_far"))
    assert said(chapter(apart), "The legs' stride times differ")


def test_facts_say_what_lengths_are_told_in_and_what_the_camera_does():
    facts = dict(chapter().facts())
    assert facts["Motion"] == "walk"
    assert facts["Lengths"] == "in leg lengths (thigh + shank); follow with a height for metres"
    moved = replace(stroll(), moved=np.arange(len(stroll()))[:, None] * (0.3, 0.4, 0.0) + UNMOVED)
    facts = dict(chapter(moved, gait=gait_of(moved, known=Known(height=1.75))).facts())
    assert "in metres; a leg length (thigh + shank) is 0." in facts["Lengths"]
    assert "against the background, which the camera moves by up to 90 px" in facts["Lengths"]


@pytest.mark.parametrize(
    ("rate", "given", "wanted"), [(0.5, False, True), (0.5, True, False), (0.9, False, False)]
)
def test_a_speed_that_was_only_found_is_warned_of_and_not_used(rate, given, wanted):
    told = Chapter.of(chapter(rate=rate, given=given).run)
    assert any("track again with --rate 0.5" in warning for warning in told.warnings) is wanted
    assert told.gait.rate == (rate if given else 1.0)


def test_curves_are_degrees_with_their_sigma(rng):
    track = random_track(rng, 6)
    drawn = chapter(track).drawn()
    (knee,) = [panel for panel in drawn["panels"] if panel["title"] == "Knee"]
    near, far = knee["curves"]
    assert (near["name"], far["name"]) == ("near", "far")
    k = WALKER.index("knee_far")
    assert far["mean"] == pytest.approx(np.degrees(track.q[:, k]), abs=0.051)
    assert far["sigma"] == pytest.approx(np.degrees(track.sigma(k)), abs=0.051)
    assert drawn["times"] == pytest.approx(track.times, abs=1e-4)


def test_stretches_lie_side_by_side_and_cover_every_frame():
    track = stroll(1.0)
    track = replace(
        track, motions=("walk",) * 15 + ("run",) * 5 + ("walk",) * 10, outcome=("ok",) * 12 + ("hidden",) * 18
    )
    drawn = chapter(track).drawn()
    assert drawn["motions"] == [[0, 15, "walk"], [15, 20, "run"], [20, 30, "walk"]]
    assert drawn["outcomes"] == [[0, 12, "ok"], [12, 30, "hidden"]]


def test_the_floor_has_a_stretch_for_every_stride():
    told = chapter()
    floor = told.drawn()["floor"]
    for side, stretches in floor.items():
        strides = told.gait.strides[side].sound
        assert stretches == [[round(s.strike.at, 2), round(s.off.at, 2)] for s in strides]
    assert floor["near"] != floor["far"]


def test_a_cycle_has_every_stride_of_either_leg_their_mean_and_their_spread():
    track = replace(stroll(), first=40)
    told = chapter(track)
    hip, knee, ankle = told.drawn()["cycles"]
    assert [cycle["title"] for cycle in (hip, knee, ankle)] == ["Hip", "Knee", "Ankle"]
    for side, leg in hip["legs"].items():
        assert np.shape(leg["strides"]) == (len(told.gait.strides[side].sound), 101)
        assert leg["mean"] == pytest.approx(np.mean(leg["strides"], axis=0), abs=0.11)
        assert leg["sigma"] == pytest.approx(np.std(leg["strides"], axis=0, ddof=1), abs=0.11)
        assert leg["mean"][0] == pytest.approx(28.0, abs=2.0)
        assert leg["off"] == pytest.approx(getattr(told.gait.named("stance share"), side).mean, abs=0.05)


def test_without_strides_there_are_no_cycles_and_one_stride_has_no_spread():
    assert chapter(stroll(0.9)).drawn()["cycles"] == []
    hip = chapter(stroll(2.0)).drawn()["cycles"][0]["legs"]
    assert [len(leg["strides"]) for leg in hip.values()] == [1] * len(hip)
    assert {leg["sigma"] for leg in hip.values()} == {None}


def test_the_norm_is_of_people_who_do_the_same_and_who_goes_backwards_is_said_to():
    told = chapter()
    knee = told.drawn()["cycles"][1]["norm"]
    assert knee == norm_of(told.gait, "knee")
    runs = replace(told, gait=replace(told.gait, motion="run"))
    backwards = chapter(replace(told.track, q=told.track.q[::-1].copy()))
    assert headline(backwards).startswith("Walks backwards at 109")
    for other in (runs, backwards):
        assert {cycle["norm"] for cycle in other.drawn()["cycles"]} == {None}


def test_what_was_not_measured_is_neither_told_nor_drawn():
    gait = chapter().gait
    kept = tuple(measure for measure in gait.measures if measure.name not in ("stance share", "speed"))
    told = chapter(gait=replace(gait, measures=kept))
    assert headline(told) == "Walks at 109 steps a minute."
    drawn = told.drawn()
    assert {leg["off"] for cycle in drawn["cycles"] for leg in cycle["legs"].values()} == {None}
    assert drawn["floor"] == {"near": [], "far": []}


def test_a_figure_of_another_kind_is_told_without_what_it_has_not(rng):
    told = chapter(random_track(rng, figure=HORSE))
    drawn = told.drawn()
    assert told.gait is None
    assert told.cautions() == []
    assert drawn["floor"] == {"near": [], "far": []}
    assert drawn["cycles"] == []
    assert all(panel["curves"] for panel in drawn["panels"])


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


def test_the_way_is_judged_by_the_seconds_walked():
    """In slow motion half a leg length back in six seconds of film is as quick as in three."""
    track = stroll(12.0)
    drift = posed(track, root_x=np.linspace(0.0, -0.9, len(track)))
    told = chapter(drift, rate=0.5, given=True, gait=gait_of(drift, 0.5))
    assert goes_backwards(drift) != told.gait.backwards
    assert ("backwards" in headline(told)) == told.gait.backwards
    assert all((cycle["norm"] is None) == told.gait.backwards for cycle in told.drawn()["cycles"])


def test_a_camera_that_hardly_moves_is_not_told():
    for moves, told in ((0.3, False), (3.0, True)):
        track = stroll()
        moved = track.moved.copy()
        moved[-1, 0] = moves
        assert ("camera moves" in dict(chapter(replace(track, moved=moved)).facts())["Lengths"]) == told


def test_without_gait_figures_nothing_is_said(rng):
    for track in (stroll(0.9), random_track(rng, figure=HORSE)):
        assert (headline(chapter(track)), unusual(chapter(track))) == ("", "")


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


def test_a_joint_that_turns_later_is_unusual():
    track = stroll(9.0)
    bent = posed(track, knee_near=bend(track, 0.8), knee_far=bend(track, 0.5, strike=0.85))
    told = chapter(bent)
    peak = told.gait.named("knee flexion peak")
    by = peak.near.mean - peak.far.mean
    assert by == pytest.approx(30.0, abs=3.0)
    assert f"knee flexion peak {by:.0f} % of the stride later on the near leg" in unusual(told)


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


def test_legs_in_discord_are_unusual_and_warnings_elsewhere_are_not():
    assert unusual(chapter(warnings=["a"])).startswith("Nothing unusual")
    apart = posed(stroll(9.0), hip_far=angle_of(stroll(9.0, period=1.5), "hip_far"))
    assert "the legs' stride times differ" in unusual(chapter(apart))
