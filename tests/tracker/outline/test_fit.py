"""The whole fit, from a mark in the middle of a film."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.special import expit

from kinematics.figure import SCALE
from kinematics.spm import joints
from tests.tracker.outline.films import FEW, FPS, MIDDLE, WALKER, film
from tracker.outline.climb import Marked
from tracker.outline.cycles import NECK, columns_of
from tracker.outline.fit import LASTING, RIGHTLY, agreeing, fitted, through

NEAR = 0.05  # leg lengths, in the mean


def fit(film, stage, start=None, frame=MIDDLE):
    return fitted(stage, start or film.start(frame), frame, FEW)


def errors(found, film):
    """(T, J) leg lengths from the true joints."""
    return np.hypot(*np.moveaxis(found - film.joints, -1, 0)) / film.units[:, None]


def exchanged(start):
    """The same marks with the legs' names exchanged."""
    return replace(start, q=start.q[WALKER.exchanged])


@pytest.fixture(scope="module")
def found(walk, stage):
    return fit(walk, stage)


def test_every_joint_is_found_in_every_frame(walk, found):
    away = errors(found.joints, walk)
    assert away.mean() < 0.5 * NEAR
    assert away.max() < 2.0 * NEAR
    assert found.seen.all()
    assert found.gait == "walk"
    assert found.named > 3.0
    assert found.misnamed < 0.05


def test_a_film_with_every_frame_twice_shows_the_same_poses(walk, stage, found):
    twice = np.repeat(np.arange(len(walk.q)), 2)
    double = replace(stage.part(twice), fps=2.0 * FPS)
    again = fitted(double, walk.start(), 2 * MIDDLE, FEW)
    apart = np.hypot(*np.moveaxis(again.joints[::2] - found.joints, -1, 0)) / walk.units[:, None]
    assert apart.mean() < 0.008
    assert again.named == pytest.approx(found.named, rel=0.25)


def test_at_a_low_rate_who_bounces_is_not_smoothed_away(walk, rng):
    some = walk.part(slice(None, None, 4))
    down = np.rint(8.0 * np.cos(0.5 * np.pi * np.arange(len(some.q)) + 0.8)).astype(int)
    bounces = some.carried(np.stack([0 * down, down], axis=1))
    found = fit(bounces, replace(bounces.stage(rng), fps=FPS / 4.0), frame=MIDDLE // 4)
    assert errors(found.joints, bounces).mean() < 0.4 * NEAR


def test_the_head_is_held_about_half_way_between_the_marked_angle_and_its_outline(walk, stage, found):
    neck = columns_of(WALKER)[NECK]
    start = walk.start()
    bowed = start.q.copy()
    bowed[neck] += np.radians(25.0)
    more = fit(walk, stage, replace(start, q=bowed)).q[:, neck] - found.q[:, neck]
    np.testing.assert_allclose(more, np.radians(11.5), atol=np.radians(3.0))


def test_a_fitted_pose_is_a_start_in_the_same_place(walk, found):
    start = found.start(WALKER, walk.facing, 20)
    axes = start.view.unit * np.array([walk.facing, -1.0])
    places = start.view.origin + axes * joints(WALKER, start.q)
    np.testing.assert_allclose(places, found.joints[20], atol=1e-9)
    assert start.known.all()
    assert start.q[WALKER.index(SCALE)] == 0.0


def test_a_mark_near_an_end_is_as_good_and_a_figure_may_face_left(walk, rng):
    left = walk.mirrored()
    assert errors(fit(left, left.stage(rng), frame=2).joints, left).mean() < NEAR


def test_exchanged_marks_give_way_to_which_leg_is_seen_in_front(walk, stage):
    found = fit(walk, stage, exchanged(walk.start()))
    assert errors(found.joints, walk).mean() < NEAR
    assert found.named > 0.0
    assert found.misnamed > 0.5


def test_exchanged_marks_hold_where_both_legs_look_the_same_though_the_camera_moves(rng):
    alike = film(rng, camera=(1.5, 0.3, 0.0, -0.003), alike=True)
    found = fit(alike, alike.stage(rng), exchanged(alike.start()))
    assert errors(found.joints[:, WALKER.joint_twins], alike).mean() < NEAR
    assert expit(-2.0 * RIGHTLY) < found.misnamed < 0.5


def test_marks_that_do_not_tell_the_legs_apart_name_them_neither_rightly_nor_wrongly(walk, stage):
    hips = [WALKER.index(name) for name in ("hip_near", "hip_far")]
    below = [WALKER.index(f"{part}_{side}") for part in ("knee", "ankle") for side in ("near", "far")]
    t = int(np.abs(walk.q[:, hips[0]] - walk.q[:, hips[1]]).argmin())
    start = walk.start(t)
    start.known[below] = False
    start.q[hips] = start.q[hips].mean()
    found = fit(walk, stage, start, t)
    assert errors(found.joints, walk).mean() < NEAR
    assert 0.5 * expit(-RIGHTLY) < found.misnamed < 2.0 * expit(-RIGHTLY)


@pytest.mark.parametrize(("one", "other"), [(2.0, 0.7), (-1.5, 0.3), (3.0, -8.0), (0.0, 5.0)])
def test_two_statements_agree_where_both_are_true_or_neither(one, other):
    p, q = expit(one), expit(other)
    both = p * q + (1.0 - p) * (1.0 - q)
    assert agreeing(one, other) == pytest.approx(np.log(both / (1.0 - both)))
    assert agreeing(800.0, other) == pytest.approx(other)


def test_a_path_is_drawn_to_the_marked_angles_the_less_the_longer_before_and_after(rng):
    columns = columns_of(WALKER)
    path = rng.normal(size=(40, len(WALKER.freedoms)))
    known = np.ones(len(WALKER.freedoms), bool)
    known[columns[-1]] = False
    marked = Marked(12, rng.normal(size=len(known)), known)
    drawn = through(WALKER, path, marked, FPS)[0] - path
    angles = columns[:-1]
    off = (marked.q - path[12])[angles]
    np.testing.assert_allclose(drawn[12, angles], off)
    later = 12 + round(LASTING * FPS)
    np.testing.assert_allclose(drawn[later, angles], np.exp(-(later - 12) / (LASTING * FPS)) * off)
    np.testing.assert_allclose(drawn[9, angles], drawn[15, angles])
    assert_array_equal(np.delete(drawn, angles, axis=1), 0.0)


def test_a_path_is_the_likelier_the_less_it_is_drawn(walk):
    marked = Marked(MIDDLE, walk.q[MIDDLE], np.ones(walk.q.shape[1], bool))
    likely = [through(WALKER, walk.q + by, marked, FPS)[1] for by in (0.0, 0.1, 0.5)]
    assert likely[0] == 0.0
    assert likely[0] > likely[1] > likely[2]


def test_where_nobody_walks_nothing_is_seen(walk, stage, rng):
    empty = replace(walk, cover=np.zeros_like(walk.cover))
    assert not fit(walk, empty.stage(rng)).seen.any()


def test_the_frames_around_some_end_where_the_figure_is_not_seen(found):
    score = np.ones(len(found.score))
    score[[2, 9]] = 0.0
    doubted = replace(found, score=score)
    assert doubted.around(slice(5, 7)) == slice(3, 9)
    assert doubted.around(slice(1, 12)) == slice(0, len(score))
    some = doubted.part(slice(3, 9))
    assert_array_equal(some.score, 1.0)
    assert len(some.joints) == 6


def test_a_frame_of_low_score_is_not_seen_and_none_is_if_most_score_low(found):
    third = np.arange(len(found.score)) % 3 == 0
    np.testing.assert_array_equal(replace(found, score=np.where(third, 0.05, 0.2)).seen, ~third)
    assert not replace(found, score=np.where(third, 1.0, 0.05)).seen.any()
