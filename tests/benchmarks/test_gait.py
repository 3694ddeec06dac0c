"""What gait figures are measured by: contacts of a foot, strides with their truth, rows that count right."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kinematics.mocap import Trial
from tests.benchmarks.gait import learn as learn_module
from tests.benchmarks.gait.learn import Case as Taught
from tests.benchmarks.gait.learn import _weights, cases, shown_at
from tests.benchmarks.gait.measure import Case, Figure, Moment, _true_track, measured
from tests.benchmarks.gait.norms import norms
from tests.benchmarks.gait.page import claims, figure_rows, moment_rows, nobodys
from tests.benchmarks.gait.truth import contacts
from tests.benchmarks.made_up import a_motion
from tests.benchmarks.rendered import plans
from tests.benchmarks.rendered.captures import RATE
from tests.benchmarks.rendered.plans import MOMENTS, planned
from tests.tracker.strolls import track_of
from tracker.scene.steps import Gait, random_build

pytestmark = pytest.mark.whole


# Of a foot that is put down twice.
HEIGHTS = np.repeat([0.1, 0.0, 0.1, 0.0, 0.1], [200, 300, 200, 300, 200])


def standing(build, heights, speed=0.0):
    """A figure on straight legs whose feet are flat, the near foot at these heights."""
    S = len(heights)
    pose = np.zeros((S, 8))
    pose[:, 0] = speed * np.arange(S) / RATE
    pose[:, 1] = 1.0 + build.ankle + np.asarray(heights)
    return Gait(pose, np.zeros((S, 2)), np.zeros((S, 4)), np.zeros(S))


def test_a_foot_is_on_the_ground_while_it_is_low_and_slow_and_jitter_is_no_leaving(rng):
    build, heights = random_build(rng), HEIGHTS.copy()
    heights[350:370] = 0.1  # 40 ms
    pose = standing(build, heights)
    pose.pose[:, 0] = np.cumsum(np.where(heights > 0.05, 4.0, 0.0)) / RATE
    found = contacts(pose, build)["near"]
    moments = [moment for contact in found for moment in (contact.strike, contact.off)]
    assert moments == pytest.approx(np.array([200, 500, 700, 1000]) / RATE, abs=2.5 / RATE)
    fast = standing(build, heights, speed=3.0)
    assert contacts(fast, build)["near"] == []


def test_a_foot_that_slips_before_it_leaves_has_no_clear_moment_of_leaving(rng):
    build = random_build(rng)
    pose = standing(build, HEIGHTS)
    speeds = np.where(HEIGHTS > 0.05, 4.0, 0.0)
    pace = speeds.mean()
    speeds[900:1000] = np.linspace(0.0, pace, 100)  # faster and faster along the floor
    pose.pose[:, 0] = np.cumsum(speeds) / RATE
    sharp, slipping = contacts(pose, build)["near"]
    assert sharp.clear == ("strike", "off")
    assert slipping.clear == ("strike",)
    assert slipping.off == pytest.approx(950 / RATE, abs=0.03)


def test_weights_are_learned_from_clear_moments_alone(rng, monkeypatch):
    motion = a_motion("walk", 6.0)
    every = list(cases([("", motion)], True, rng))
    assert {kind for kind, _ in every} == {"strike", "off"}
    _, build, gait = shown_at(motion, 30.0, rng)
    told = {
        side: [replace(one, clear=("off",)) for one in found] for side, found in contacts(gait, build).items()
    }
    monkeypatch.setattr(learn_module, "contacts", lambda gait, build: told)
    assert {kind for kind, _ in cases([("", motion)], True, rng)} == {"off"}


def test_what_is_told_of_true_poses_is_nearly_true_and_legs_that_are_exchanged_are_missed(monkeypatch):
    monkeypatch.setattr(plans, "motions", lambda trial: [a_motion("walk", 6.0)])
    plan = planned(3, [Trial(Path(), "a", "1", gait, 60.0, ((0, 360),), (), "") for gait in ("walk", "run")])
    lead = plan.walkers[0]
    frames = len(lead.gait.pose) // MOMENTS
    bare = track_of(np.zeros((frames, 17)), np.arange(frames) / plan.fps)
    true = replace(_true_track(plan, bare), cov=bare.cov)
    case = measured(Case(3, "made up", plan.kinds), plan, true)
    assert min(case.strides) >= 1
    assert case.missed == 0
    assert np.median([abs(moment.late) for moment in case.moments]) < 0.02
    lengths = [figure for figure in case.figures if figure.name == "stride length"]
    assert lengths
    for figure in lengths:
        assert figure.told == pytest.approx(figure.true, rel=0.01)


def a_case(label="walk", camera="still", late=0.01, told=0.61):
    moments = (Moment("strike", late, 0.01), Moment("off", -late, 0.001))
    figures = (Figure("stance share", 100 * told, 60.0, 1.0), Figure("speed", 1.1, 1.0, 0.01))
    kinds = {"gait": label, "camera": camera}
    return Case(1, "35_01:0-9", kinds, label == "run", (1, 2), 0, 0, moments, figures)


def test_claims_and_rows_count_what_is_within():
    cases = [a_case(), a_case("run", "pan", 0.03, 0.66)]
    found = {claim.text: claim.value for claim in claims(cases)}
    assert found["strikes of walks, half within"] == pytest.approx(10.0)
    assert found["leavings of runs, nine in ten within"] == pytest.approx(30.0)
    assert found["stance of runs, half within"] == pytest.approx(6.0)
    assert found["moments inside"] == 25.0
    assert found["stance share inside"] == 50.0
    assert found["speed, half within"] == pytest.approx(10.0)
    assert found["walk or run rightly named"] == 100.0
    assert (found["strides of the near leg"], found["strides of the far leg"]) == (2.0, 4.0)
    rows = {row[0]: row[1:] for row in moment_rows(cases)}
    assert rows["walks, strikes, learned"] == ["1", "+10", "10", "10", "100"]
    assert rows["walks, strikes, others"][0] == "0"
    assert [row[:2] for row in figure_rows(cases)] == [
        [f"{label}, {name}", "1"]
        for label in ("walks", "runs")
        for name in ("stance share, points", "speed, %")
    ]
    told = nobodys([*cases, replace(cases[0], missed=3, unclear=2)])
    assert told.startswith("Of 14 strides found, 3 over")
    assert "and 2 with unclear moments" in told


def test_weights_find_what_is_linear_and_say_what_is_left_of_each_capture(rng):
    w, errors = rng.normal(size=(4, 5)), np.random.default_rng(1)
    taught = []
    for subject in range(4):
        for capture in range(3):
            off = 0.03 * rng.normal()
            for _ in range(200):
                x = rng.normal(size=(4, 5))
                late = 0.1 + float((w * x).sum()) + off + 0.01 * rng.normal()
                noisy = x + 0.02 * errors.normal(size=x.shape)  # whose part of the error is not learned
                taught.append(Taught(str(subject), f"{subject} {capture}", "", late, noisy, x))
    found = _weights(taught, taught)
    assert np.abs(found.w - w).max() < 0.02
    assert found.base == pytest.approx(0.1, abs=0.03)
    assert found.error == pytest.approx(0.01, rel=0.3)
    assert found.shared == pytest.approx(0.03, rel=0.5)


def test_norms_are_of_people_and_of_no_fewer_than_five():
    walk = a_motion("walk", 6.0)
    shown = [replace(walk, name=f"{person}_1:0-9") for person in "abcde"]
    found = norms([*shown, *(replace(shown[0], name=f"a_{again}:0-9") for again in range(3))])
    assert set(found) == {"walk_hip", "walk_knee", "walk_ankle"}
    assert {people for people, *_ in found.values()} == {5}
    assert norms(shown[:4]) == {}
    # The same walk all along: people differ by their feet alone.
    assert found["walk_knee"][102:].max() < 0.5
    truth = np.degrees(walk.y[:, 5])
    assert found["walk_knee"][1:102].max() == pytest.approx(truth.max(), abs=1.5)
