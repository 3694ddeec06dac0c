"""The rendered films: feet on the floor, truth on the figure, scores that count right."""

from dataclasses import replace
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from kinematics.mocap import Trial
from tests.benchmarks.evaluation.cases import LEGS
from tests.benchmarks.made_up import FPS, a_motion
from tests.benchmarks.rendered import plans
from tests.benchmarks.rendered.captures import GAITS, gait_of
from tests.benchmarks.rendered.filming import Film, film
from tests.benchmarks.rendered.measure import SCORED, Case, Followed, Start, judged, start_frame
from tests.benchmarks.rendered.page import by_kind, claims
from tests.benchmarks.rendered.plans import BEFORE, BEHIND, HEIGHT, MOMENTS, POST, SHRUB, Casting, planned
from tracker.clip.job import Found, Nearer
from tracker.scene.steps import joint_places, random_build
from tracker.tables.keypoints import Mark
from videos.frames import Video

pytestmark = pytest.mark.whole

TRIALS = [
    Trial(Path(), person, "1", gait, FPS, ((0, 240),), (), "") for gait in GAITS for person in ("a", "b")
]


@pytest.fixture(autouse=True)
def captures(monkeypatch):
    """Everybody's captures show one made-up walk."""
    monkeypatch.setattr(plans, "motions", lambda trial: [a_motion(trial.activity)])


def cast(**wanted):
    """The first seed whose film has this cast."""
    for seed in count():
        drawn = Casting.draw(np.random.default_rng([seed, 0]))
        if all(getattr(drawn, name) == value for name, value in wanted.items()):
            return planned(seed, TRIALS)


def cut(plan, first, frames):
    """Some frames of a plan."""
    moments = np.arange(MOMENTS * first, MOMENTS * (first + frames))
    walkers = tuple(replace(walker, gait=walker.gait.at(moments)) for walker in plan.walkers)
    return replace(plan, walkers=walkers, view=plan.view[moments], frames=frames)


def gone(walker):
    """Far beyond the picture."""
    return replace(walker, start=walker.start + np.array([1e5, 0.0]))


def empty(plan):
    """The same with nobody there."""
    return replace(plan, walkers=tuple(gone(walker) for walker in plan.walkers))


def differences(one, other):
    """(T, H, W) between the pictures of two films, grey levels."""
    return np.abs(np.array(one.images, float) - np.array(other.images, float)).mean(axis=-1)


@pytest.mark.parametrize("seed", range(3))
def test_a_foot_that_stands_is_on_the_floor_and_stays_there_whoever_walks_so(seed):
    build = random_build(np.random.default_rng(seed))
    times = np.arange(0.5, 3.5, 1.0 / 120.0)
    floating = a_motion()
    floating.y[:, :2] += np.outer(np.linspace(0.0, 1.0, len(floating.y)), (-1.2, 0.1))
    gait = gait_of(floating, build, times)
    places, low, slides = joint_places(build, gait), [], []
    for side, name in enumerate(("near", "far")):
        pitch, ankle = gait.foot[:, side], places[f"{name}_ankle"]
        ends = np.array([-build.heel, build.toe])[:, None]
        heights = ankle[:, 1] + ends * np.sin(pitch) - build.ankle * np.cos(pitch)
        at = ankle[:, 0] + ends * np.cos(pitch) + build.ankle * np.sin(pitch)
        stands = (heights.min(axis=0)[1:] < 0.005) & (np.abs(pitch[1:]) < 0.1)
        slides.append(120.0 * np.abs(np.diff(at, axis=1)).min(axis=0)[stands])
        low.append(heights.min(axis=0))
    assert np.min(low) > -0.005  # leg lengths; half a pixel
    assert np.quantile(np.min(low, axis=0), 0.9) < 0.01  # somebody who walks always stands
    # Feet of 1.2 leg lengths a second when they do not stand.
    assert np.median(np.concatenate(slides)) < 0.1
    assert gait.pose[-1, 0] - gait.pose[0, 0] == pytest.approx(np.ptp(a_motion().y[30:211, 0]), rel=0.15)


def test_a_motion_goes_on_without_a_jump_and_as_fast():
    short = a_motion(seconds=1.7)
    short.y[:, 2] += np.linspace(0.0, 0.2, len(short.y))
    longer = short.prolonged(6.0)
    assert longer.seconds >= 6.0
    steps = [np.abs(np.diff(np.c_[motion.y, motion.feet], axis=0)).max(axis=0) for motion in (short, longer)]
    assert (steps[1] < 1.3 * steps[0] + np.radians(0.5)).all()
    pace = [np.ptp(motion.y[:, 0]) / motion.seconds for motion in (short, longer)]
    assert pace[1] == pytest.approx(pace[0], rel=0.1)


def test_arms_swing_against_the_legs_and_a_runners_elbows_are_bent_more():
    build, times = random_build(np.random.default_rng(0)), np.arange(0.0, 4.0, 0.02)
    walking, running = (gait_of(a_motion(label), build, times) for label in GAITS)
    for gait in (walking, running):
        assert np.corrcoef(gait.arms[:, 0], gait.pose[:, 4])[0, 1] < -0.8
        assert np.corrcoef(gait.arms[:, 2], gait.pose[:, 6])[0, 1] < -0.8
        assert gait.phase[-1] - gait.phase[0] == pytest.approx(4.0 / 1.1, abs=0.5)
    assert running.arms[:, [1, 3]].min() > walking.arms[:, [1, 3]].max()


def test_the_same_seed_gives_the_same_film_and_another_seed_does_not():
    one, again, other = (film(cut(planned(seed, TRIALS), 0, 1)) for seed in (4, 4, 5))
    assert np.array_equal(one.images, again.images)
    assert one.marks == again.marks
    assert other.marks != one.marks


@pytest.mark.parametrize("width", sorted(set(plans.WIDTHS)))
def test_a_film_is_written_the_same_every_time(width, tmp_path):
    rng = np.random.default_rng(0)
    grain = cv2.GaussianBlur(rng.uniform(0.0, 255.0, (HEIGHT, width, 3)).astype(np.float32), (0, 0), 3.0)
    shift = [np.roll(grain, 3 * t, axis=1) + rng.normal(0.0, 3.0, grain.shape) for t in range(12)]
    images = [np.clip(image, 0.0, 255.0).astype(np.uint8) for image in shift]
    shown = Film(replace(planned(0, TRIALS), size=(width, HEIGHT)), images, {})
    seen = []
    for _ in range(3):
        shown.write(tmp_path / "film.mp4")
        seen.append([frame.image for frame in Video(tmp_path / "film.mp4")])
    assert np.array_equal(seen[0], seen[1])
    assert np.array_equal(seen[0], seen[2])


@pytest.mark.parametrize("camera", ["still", "drift", "pan", "shake"])
def test_the_figure_is_painted_at_its_true_joints_and_stays_in_the_picture(camera):
    plan = cast(camera=camera, crossing=None, occluder=None)
    part = cut(plan, plan.frames // 2, 2)
    shown = film(part)
    away = differences(shown, film(empty(part)))
    for t, row in shown.marks.items():
        on = [away[t][round(row[n].y), round(row[n].x)] for n in ("neck", "near_knee", "near_ankle")]
        assert min(on) > 3.0 * np.median(away[t]) + 1.0
    lead = plan.walkers[0]
    places = np.stack(list(joint_places(lead.build, lead.gait).values()))
    seen = lead.start + lead.leg_px * np.array([lead.facing, -1.0]) * places - plan.view
    assert (seen.min(axis=(0, 1)) > 0.0).all()
    assert (seen.max(axis=(0, 1)) < np.array(plan.size) - 1.0).all()


def test_the_street_that_a_moving_camera_sees_moves_against_it():
    plan = cast(camera="drift", crossing=None, occluder=None)
    still = empty(replace(plan, noise=0.0, moving_light=False, quality=95))
    images = [film(cut(still, first, 1)).images[0] for first in (0, plan.frames - 1)]
    dx = round(float(np.diff(plan.view[[1, -2], 0])[0]))
    wall = [image[20:60].astype(float).mean(axis=(0, 2)) for image in images]
    margin = abs(dx) + 10
    apart = [
        np.abs(wall[1][margin:-margin] - np.roll(wall[0], -way)[margin:-margin]).mean() for way in (dx, -dx)
    ]
    assert abs(dx) > 5
    assert apart[0] < 0.5 * apart[1]


@pytest.mark.parametrize(("where", "hidden"), [(BEFORE, True), (BEHIND, False)])
def test_somebody_comes_towards_the_walker_and_passes_on_the_side_that_is_told(where, hidden):
    plan = cast(camera="still", crossing=where, occluder=None)
    lead, other = plan.walkers
    assert lead.facing == -other.facing
    apart = (lead.x - other.x)[MOMENTS // 2 :: MOMENTS]
    meeting = int(np.abs(apart).argmin())
    assert 0 < meeting < plan.frames - 1
    assert apart[0] * apart[-1] < 0.0
    part = cut(plan, meeting, 1)
    alone = replace(part, walkers=part.walkers[:1])
    together = film(part).marks[0]
    covered = [mark.visible and not together[name].visible for name, mark in film(alone).marks[0].items()]
    assert any(covered) is hidden


def test_who_crosses_is_in_the_picture():
    plan = cast(camera="still", crossing=BEFORE, occluder=None)
    lead, other = plan.walkers
    inside = np.flatnonzero((other.x[::MOMENTS] > 20.0) & (other.x[::MOMENTS] < plan.size[0] - 20.0))
    frame = int(inside[np.abs(lead.x - other.x)[::MOMENTS][inside].argmax()])
    part = cut(plan, frame, 1)
    alone = replace(part, walkers=(part.walkers[0], gone(part.walkers[1])))
    trunk = round(other.start[1] - 1.3 * other.leg_px), round(other.x[MOMENTS * frame + MOMENTS // 2])
    assert differences(film(part), film(alone))[0][trunk] > 10.0


@pytest.mark.parametrize("kind", [SHRUB, POST])
def test_an_occluder_hides_legs_where_it_stands_and_nowhere_else(kind):
    plan = cast(camera="still", crossing=None, occluder=kind)
    away = np.abs(plan.walkers[0].x[::MOMENTS] - plan.occluder[1])
    clear, behind = int(away.argmax()), int(away.argmin())
    assert covered_by_it(plan, clear) == set()
    lost = set.union(*(covered_by_it(plan, frame) for frame in range(behind - 6, behind + 7, 6)))
    assert {"near_knee", "near_ankle"} & lost
    assert bool({"head_top", "neck"} & lost) is (kind == POST)


def covered_by_it(plan, frame):
    """Joints of one frame that only the occluder hides."""
    part = cut(plan, frame, 1)
    with_it, without = (film(each).marks[0] for each in (part, replace(part, occluder=None)))
    return {name for name, mark in without.items() if mark.visible and not with_it[name].visible}


def a_film(*rows):
    """A film with these marks, a frame each, of a walker who faces right with legs of 100 px."""
    plan = SimpleNamespace(walkers=[SimpleNamespace(leg_px=100.0, facing=1)])
    return SimpleNamespace(marks=dict(enumerate(rows)), plan=plan)


def row(spread, visible=True):
    """Marks whose near leg is ahead by this many pixels."""
    x = dict.fromkeys(SCORED, 0.0) | {name: spread / 2 * (1 if "near" in name else -1) for name in LEGS}
    y = {"head_top": -90.0, "neck": -60.0, "hip": 0.0} | {name: 50.0 for name in LEGS}
    return {name: Mark(x[name], y[name], visible or "far" not in name) for name in SCORED}


def test_the_start_is_where_the_ankles_are_farthest_apart_while_both_legs_show():
    assert start_frame(a_film(row(20.0), row(80.0, visible=False), row(-60.0), row(40.0))) == 2
    assert start_frame(a_film(row(20.0, visible=False), row(80.0, visible=False))) == 1


@pytest.mark.parametrize(
    ("spread", "moved", "facing", "told", "wrong"),
    [
        (60.0, 0.0, 1, "sure", False),
        (-60.0, 0.0, 1, "sure", True),
        (-60.0, 0.0, 1, "unsure", False),
        (60.0, 0.0, -1, "unsure", True),
        (60.0, 80.0, 1, "unsure", True),
    ],
)
def test_a_start_misleads_unless_all_is_right_or_a_warning_is_given_of_the_leg(
    spread, moved, facing, told, wrong
):
    marks = {name: Mark(mark.x + moved, mark.y) for name, mark in row(spread).items()}
    found = Found(0, marks, facing, Nearer.AHEAD, told)
    start = judged(a_film(row(60.0)), found)
    assert start.wrong_though_sure is wrong
    assert (start.placed, start.facing) == (moved == 0.0, facing == 1)


def a_case(seed, error=0.02, lost=None, exchanged=0, label="walk", gait="walk", start=(True,) * 4):
    track = Followed(error, lost, exchanged, 100, 0.9, 0.7 if seed else np.nan, label)
    found = None if start is None else Start(*start)
    unmarked = "nobody was found" if start is None else track
    return Case(seed, gait, {"gait": gait}, track, found, unmarked)


def test_claims_count_films_as_of_a_hundred_and_a_refusal_as_not_found():
    cases = [a_case(0), a_case(1, 0.04, exchanged=10), a_case(2, 0.3, lost=7), a_case(3, start=None)]
    cases[0] = replace(cases[0], marked="mark the start again")
    found = {claim.text: claim.value for claim in claims(cases)}
    assert found["followed, of 100"] == 50.0
    assert found["median error, leg lengths"] == pytest.approx(0.04)
    assert found["frames with exchanged legs"] == pytest.approx(100.0 * 10 / 300)
    assert found["found with the right facing, of 100"] == 75.0
    assert found["wrong without warning, of 100"] == 0.0


def test_rows_are_of_all_films_and_of_every_kind():
    cases = [a_case(0), a_case(1, label="run", gait="run"), a_case(2, gait="run", start=(1, 0, 0, 1))]
    rows = {cells[0]: cells[1:] for cells in by_kind(cases)}
    assert list(rows) == ["**all**", "gait: run", "gait: walk"]
    assert [rows[name][0] for name in rows] == ["3", "2", "1"]
    assert rows["**all**"][2] == "90/70"
    assert rows["gait: run"][3:7] == ["1", "1", "1", "1"]
