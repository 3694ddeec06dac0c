"""The outline's joints as points of a plan, and when there are none."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import expit

from tests.tracker.clip.filmed import QUIET, as_seen, away, mean_away, written
from tests.tracker.outline import films
from tests.tracker.outline.films import MIDDLE, SIZE, UNIT, WALKER, a_walk, film
from tests.tracker.tracks import random_track
from tracker.clip import outlines, part, staged
from tracker.clip.follow import follow, motions_of
from tracker.clip.job import Found, Nearer
from tracker.clip.outlines import DOUBTED, EXCHANGE, MOST, ONE_LEG, POINT, look
from tracker.clip.plan import prepare
from tracker.clip.staged import FEWEST
from tracker.loop.detections import Detector
from tracker.models.find import CONSTANT_VELOCITY, for_seen
from tracker.run.track import FREE
from tracker.tables.keypoints import Mark

WIDTH = 160  # of the film: at its end the walker is partly out of sight


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """The film with its middle frame marked."""
    return written(tmp_path_factory.mktemp("film"), a_walk().images[:, :, :WIDTH], a_walk().joints)


@pytest.fixture(scope="module")
def plan(job):
    return prepare(job)


@pytest.fixture(scope="module")
def found(plan):
    return as_seen(plan)


def test_the_points_of_every_frame_are_the_walkers_joints(found):
    walk = a_walk()
    assert sorted(found.seen.points) == list(range(len(walk.images)))
    assert mean_away(found.seen.points, walk) < 0.07
    assert found.seen.gait == ""  # constant velocity has no label for it
    settings = found.tracker.settings
    assert (settings.point, settings.one_leg) == (POINT, ONE_LEG)
    assert EXCHANGE <= settings.exchange < 0.1


def test_joints_beyond_the_picture_are_no_points(found):
    pixels = np.concatenate([each.pixels for each in found.seen.points.values()])
    assert np.all((pixels >= 0.0) & (pixels <= (WIDTH - 1, SIZE[1] - 1)))
    assert len(found.seen.points[MIDDLE].joint) == len(WALKER.joints)
    out = a_walk().joints[-1, :, 0] > WIDTH + 5
    assert 0 < out.sum() < len(out)
    assert not out[found.seen.points[len(a_walk().images) - 1].joint].any()


def test_who_comes_the_other_way_and_passes_in_front_is_not_taken_for_the_marked_one(tmp_path):
    one = film(np.random.default_rng(20), frames=60)
    job = written(tmp_path, one.behind(one.mirrored()).images, one.joints, 5)
    points = as_seen(prepare(job)).seen.points
    found = away(points, one).values()
    assert np.median(np.concatenate([*found])) < 0.07
    assert max(each.mean() for each in found) < 0.4
    assert max(points) > 55


def test_where_the_camera_looks_is_told_from_the_marked_frame_on(tmp_path):
    seen = film(np.random.default_rng(20), camera=(1.5, -0.4, 0.0, 0.0))
    places = as_seen(prepare(written(tmp_path, seen.images, seen.joints))).seen.places
    assert sorted(places) == list(range(len(seen.images)))
    truth = np.linalg.inv(seen.places[MIDDLE]) @ seen.places
    assert_allclose([places[t] for t in sorted(places)], truth, atol=0.6)


def test_of_a_high_frame_rate_some_frames_are_surveyed_and_the_outline_is_known_in_all(tmp_path, monkeypatch):
    walk = film(np.random.default_rng(20), frames=64, camera=(0.5, -0.2, 0.0, 0.0))
    monkeypatch.setattr(staged, "OFTEN", 15.0)  # of the film's 30 frames a second
    monkeypatch.setattr(staged, "ENOUGH", 32)
    surveyed, survey = [], staged.survey

    def counted(images, *rest):
        surveyed.append(survey(images, *rest))
        return surveyed[-1]

    monkeypatch.setattr(staged, "survey", counted)
    seen = as_seen(prepare(written(tmp_path, walk.images, walk.joints, 31))).seen
    assert len(surveyed[0].places) == 32
    assert sorted(seen.points) == sorted(seen.places) == list(range(1, 64))
    assert mean_away(seen.points, walk) < 0.07
    truth = np.linalg.inv(walk.places[31]) @ walk.places[1:]
    assert_allclose([seen.places[t] for t in sorted(seen.places)], truth, atol=0.6)


def test_where_the_film_does_not_show_the_cameras_path_none_is_told(job, monkeypatch):
    survey = staged.survey
    monkeypatch.setattr(staged, "survey", lambda *how: replace(survey(*how), sure=np.zeros(32, bool)))
    seen = look(prepare(job), QUIET)
    assert len(seen.points) == 32
    assert not seen.places


def test_legs_that_look_like_a_shadow_are_seen(tmp_path, monkeypatch):
    grey = (105.0, 112.0, 98.0)  # 0.7 of the scene's light
    monkeypatch.setattr(films, "LEGS", {"near": grey, "far": grey})
    walk = film(np.random.default_rng(20), alike=True)
    job = written(tmp_path, walk.images, walk.joints)
    ankles = [WALKER.joints.index(f"{side}_ankle") for side in ("near", "far")]
    apart = [
        np.hypot(*(each.pixels[i] - walk.joints[t][joint])) / UNIT
        for t, each in as_seen(prepare(job)).seen.points.items()
        for i, joint in enumerate(each.joint)
        if joint in ankles
    ]
    assert len(apart) > 0.9 * len(ankles) * len(walk.images)
    assert np.mean(apart) < 0.07


@pytest.mark.parametrize(
    ("fps", "count", "step"),
    [(30, 999, 1), (89, 999, 1), (120, 999, 2), (240, 250, 2), (1000, 99, 1), (240, None, 4)],
)
def test_at_a_high_frame_rate_one_of_several_frames_is_surveyed_but_never_too_few(fps, count, step):
    assert staged.every(SimpleNamespace(fps=fps, count_hint=count), 0, None) == step


@pytest.mark.parametrize(
    ("first", "last", "step"), [(1000, 1074, 1), (1000, 1299, 3), (2200, None, 2), (2200, 9999, 2)]
)
def test_of_a_part_of_a_film_enough_frames_are_surveyed_too(first, last, step):
    assert staged.every(SimpleNamespace(fps=240, count_hint=2400), first, last) == step


@pytest.fixture
def as_if(monkeypatch):
    """Have every film's outline seen alike: which frames show it, and how sure the legs' names are."""

    def fit(seen=lambda t: t >= 0, named=9.0, misnamed=0.01, spread=0.02):
        def fitted(stage, start, *rest):
            times = np.arange(len(stage))
            joints = np.broadcast_to(start.view.origin, (len(times), len(WALKER.joints), 2))
            shown = np.ones(joints.shape[:2], bool)
            found = SimpleNamespace(
                q=np.zeros((len(times), len(WALKER.freedoms))),
                joints=joints,
                shown=shown,
                seen=seen(times),
                spread=np.full(len(times), spread),
                wrong=expit(-named),
                misnamed=misnamed,
                gait="walk",
            )
            found.finer = lambda every: found
            return found

        monkeypatch.setattr(part, "fitted", fitted)

    return fit


@pytest.mark.parametrize(("spread", "doubt"), [(0.01, 1.0), (0.03, 1.8), (0.2, 3.0)])
def test_points_are_doubted_as_the_outline_is_within_bounds(job, as_if, spread, doubt):
    as_if(spread=spread)
    points = as_seen(prepare(job)).seen.points
    assert [each.doubt for each in points.values()] == pytest.approx([doubt] * len(points))


@pytest.mark.parametrize(("fps", "doubt"), [(24.0, 1.0), (120.0, 2.0)])
def test_points_of_many_frames_a_second_are_doubted_so_that_a_second_says_the_same(fps, doubt):
    joints, rows = np.full((4, 3, 2), 50.0), np.ones((4, 3), bool)
    outline = SimpleNamespace(joints=joints, spread=np.full(4, 0.01), shown=rows, seen=rows[:, 0])
    points = staged.detections(outline, 7, SimpleNamespace(fps=fps, width=99, height=99))
    assert {t: each.doubt for t, each in points.items()} == pytest.approx(dict.fromkeys(range(7, 11), doubt))


def test_a_frame_is_free_where_neither_the_model_nor_the_outline_knows_the_motion(job, as_if):
    as_if()
    plan = as_seen(prepare(replace(job, model="walk-run")))
    assert plan.seen.gait == "walk"
    track = random_track(np.random.default_rng(1), 5)
    track = replace(track, labels=("walk", "run", FREE), s=np.array([0, 1, 2, 2, 0]))
    whole = motions_of(plan, track, 1.0)
    assert set(whole) <= {"walk", "run"}
    shown = motions_of(replace(plan, seen=replace(plan.seen, gait="")), track, 1.0)
    assert shown == (*whole[:2], FREE, FREE, whole[4])


def test_the_state_is_the_motion_where_the_model_has_one_or_no_frame_shows_the_figure(plan):
    track = replace(random_track(np.random.default_rng(1), 3), labels=("walk", "run"), s=np.array([0, 1, 0]))
    lost = replace(track, outcome=("lost",) * 3)
    assert motions_of(plan, lost, 1.0) == ("walk", "run", "walk")
    assert motions_of(plan, replace(track, labels=("stroll", "stroll")), 1.0) == ("stroll",) * 3


@pytest.mark.parametrize(
    ("misnamed", "found", "mend"),
    [
        (0.9 * DOUBTED, "", ""),
        (1.1 * DOUBTED, "", "exchange near and far in the marks"),
        (1.1 * DOUBTED, "sure", ""),
        (1.1 * DOUBTED, "given", "give --near behind"),
    ],
)
def test_legs_that_are_probably_exchanged_by_the_user_are_told(misnamed, found, mend, job, as_if):
    as_if(misnamed=misnamed)
    start = Found(MIDDLE, job.marks[MIDDLE], 1, Nearer.AHEAD, found) if found else None
    finished = follow(replace(job, stop=20, found=start), QUIET)
    told = [said for said in finished.warnings if "the leg that is called far looks like" in said]
    assert [said.endswith(f"if it is, {mend}") for said in told] == [True] * bool(mend)
    assert finished.track.misnamed == (misnamed if mend else 0.0)


def test_ellipses_are_wider_where_the_outline_shows_the_figure_elsewhere(job, as_if, monkeypatch):
    short = replace(job, stop=20)
    own = follow(replace(short, settings=short.settings.model_copy(update={"outline": False})), QUIET).track
    as_if(spread=0.2)  # all joints at the start's hip, in every frame
    doubted = follow(short, QUIET).track
    ankle = WALKER.joints.index("near_ankle")
    wide, narrow = (np.sqrt(np.trace(track.joint_covs()[5, ankle])) / UNIT for track in (doubted, own))
    assert wide > 2.0 * narrow
    marks = job.marks | {
        5: {name: Mark(*place, True) for name, place in zip(WALKER.joints, a_walk().joints[5], strict=True)}
    }
    anchored = follow(replace(short, marks=marks, anchors=True, start=MIDDLE), QUIET).track
    assert np.sqrt(np.trace(anchored.joint_covs()[5, ankle])) / UNIT < 0.1
    monkeypatch.setattr(Detector, "elsewhere", lambda self, found, q: np.zeros((len(q), len(q))))
    filtered = np.sqrt(np.trace(follow(short, QUIET).track.joint_covs()[5, ankle])) / UNIT
    assert wide > 1.1 * filtered


@pytest.mark.parametrize(("model", "wider"), [("walk-run", True), (CONSTANT_VELOCITY, False)])
def test_a_learned_model_is_held_less_tightly_where_the_outline_is_seen(model, wider, job, as_if):
    plan = prepare(replace(job, model=model))
    as_if()
    seen = as_seen(plan)
    assert seen.seen.points
    assert_array_equal(seen.slds.Q, for_seen(plan.slds).Q if wider else plan.slds.Q)
    n = len(plan.slds.names)
    assert (np.diagonal(seen.tracker.slds.Q, axis1=1, axis2=2)[:, 2:n] > 0.0).all()
    assert_array_equal(seen.tracker.slds.Q[:, :n, :n], seen.slds.Q[:, :n, :n])


def test_beyond_a_part_at_whose_edges_the_figure_is_not_seen_there_are_no_points(plan, as_if, monkeypatch):
    as_if(seen=lambda t: (t > 3) & (t < 19))
    monkeypatch.setattr(outlines, "REACH", 11)
    monkeypatch.setattr(part, "EDGE", 3)
    assert sorted(as_seen(plan).seen.points) == list(range(MIDDLE - 7, MIDDLE + 8))


def test_frames_after_the_last_asked_for_or_in_which_the_outline_is_not_seen_have_no_points(plan, as_if):
    as_if(seen=lambda t: t % 3 == 1)
    stopped = as_seen(replace(plan, job=replace(plan.job, stop=24)))
    assert sorted(stopped.seen.points) == list(range(1, 25, 3))


@pytest.mark.parametrize(
    ("named", "exchange"), [(0.0, MOST), (2.0, 1.0 / (1.0 + np.exp(2.0))), (99.0, EXCHANGE)]
)
def test_the_legs_names_are_doubted_as_the_fit_says_within_bounds(named, exchange, plan, as_if):
    as_if(named=named)
    stopped = as_seen(replace(plan, job=replace(plan.job, stop=20)))
    assert stopped.tracker.settings.exchange == pytest.approx(exchange)


def untouched(plan, found):
    names = {each.name for each in fields(plan)} - {"seen"}
    return plan.seen == found.seen and all(getattr(plan, name) is getattr(found, name) for name in names)


def test_a_film_of_too_few_frames_leaves_the_plan_as_it_is(plan):
    short = replace(plan, job=replace(plan.job, stop=FEWEST - 2))
    assert untouched(short, as_seen(short))


def test_a_scene_of_too_few_frames_still_ends_at_its_cut(tmp_path):
    other, few = film(np.random.default_rng(77), frames=40), a_walk().images[: FEWEST - 5]
    found = look(prepare(written(tmp_path, np.concatenate([few, other.images]), a_walk().joints, 5)), QUIET)
    assert found.points == {}
    assert found.shot == (None, len(few) - 1)


@pytest.mark.parametrize("off", [0.0, 0.2, 0.8])
def test_marks_that_lie_beside_the_figure_are_told_and_no_speed_is(off, job):
    ((frame, row),) = job.marks.items()
    away = {frame: {name: replace(mark, x=mark.x - off * UNIT) for name, mark in row.items()}}
    run = follow(replace(job, marks=away), QUIET)
    told = [warning for warning in run.warnings if "from the figure in the film; check them" in warning]
    if off > 0.5:
        assert told == [
            f"the marks of frame {MIDDLE} lie 0.8 leg lengths from the figure in the film; check them"
        ]
        assert run.rate == 1.0
    else:
        assert told == []


@pytest.mark.parametrize("past", [5, 800])
@pytest.mark.parametrize("hint", [True, False])
def test_a_start_past_the_films_end_leaves_the_plan_as_it_is(past, hint, plan, monkeypatch):
    if not hint:
        monkeypatch.setattr(plan.video, "count_hint", None)
    late = replace(plan, frame=len(a_walk().images) + past)
    assert untouched(late, as_seen(late))


def test_a_film_in_which_nobody_stands_out_leaves_the_plan_as_it_is(plan, as_if):
    as_if(seen=lambda t: t < 0)
    stopped = replace(plan, job=replace(plan.job, stop=20))
    assert untouched(stopped, as_seen(stopped))


@pytest.mark.parametrize("change", [{"outline": False}, {"templates": False}, {"mode": "classic"}])
def test_settings_that_want_no_outline_leave_the_plan_as_it_is(change, plan, monkeypatch):
    monkeypatch.setattr(part, "surveyed", None)  # not even looked at
    settings = plan.tracker.settings.model_copy(update=change)
    other = replace(plan, tracker=replace(plan.tracker, settings=settings))
    assert untouched(other, as_seen(other))


def test_points_that_are_given_stay(plan, monkeypatch):
    monkeypatch.setattr(part, "surveyed", None)
    given = replace(plan, measured=object())
    assert untouched(given, as_seen(given))


def test_a_film_looked_at_before_is_followed_as_one_that_is_looked_at_now(job):
    short = replace(job, stop=MIDDLE + 3)
    before = follow(short, QUIET, seen=look(prepare(replace(short, model=CONSTANT_VELOCITY)), QUIET))
    assert_array_equal(before.track.q, follow(short, QUIET).track.q)
