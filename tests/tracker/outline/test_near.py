from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.tracker.outline.films import WALKER, evidence, film
from tracker.outline.near import SAME, Leg, _evidence, nearness

told = partial(evidence, nearness)


def test_the_leg_in_front_is_told_from_the_leg_behind(either_way, rng):
    assert told(either_way, either_way.stage(rng)) > 2.0  # sqrt(n / TOGETHER), of n frames, is the most


def test_with_the_legs_exchanged_the_same_speaks_against_the_names(walk, stage):
    exchanged = walk.q[:, WALKER.exchanged]
    assert told(walk, stage, q=exchanged) == pytest.approx(-told(walk, stage), rel=1e-9)


def test_a_pose_that_is_off_by_a_few_degrees_is_told_from_as_well(walk, stage, rng):
    off = walk.q + np.radians(3.0) * rng.normal(size=walk.q.shape[1])
    off[:, WALKER.index("scale") :] = 0.0
    assert told(walk, stage, q=off) > 2.0


def test_two_legs_of_one_colour_tell_nothing(rng):
    alike = film(rng, alike=True)
    assert abs(told(alike, alike.stage(rng))) < 1.0


def test_frames_in_which_nothing_is_seen_are_not_heard(walk, stage):
    seen = np.zeros(len(walk.q), bool)
    assert told(walk, stage, seen=seen) == 0.0
    seen[:15] = True
    spoiled = stage.light.copy()
    spoiled[18:] = 255 - spoiled[18:]  # beyond the frames that tell a look
    assert told(walk, replace(stage, light=spoiled), seen=seen) == told(walk, stage, seen=seen) != 0.0


def test_what_stands_before_the_legs_is_not_heard(walk, stage):
    rows = slice(int(stage.odds.shape[1] * 0.75), None)  # below the knees
    odds, spoiled = stage.odds.copy(), stage.light.copy()
    odds[:10, rows.start - 2 :] = 0
    spoiled[:10, rows] = 255 - spoiled[:10, rows]
    hidden = replace(stage, odds=odds)
    assert told(walk, replace(hidden, light=spoiled)) == told(walk, hidden) > 1.5
    assert told(walk, replace(stage, light=spoiled)) != told(walk, stage)


def test_a_film_with_every_frame_twice_tells_as_much(walk, stage):
    twice = np.repeat(np.arange(len(walk.q)), 2)
    double = replace(stage.part(twice), fps=2.0 * stage.fps)
    assert told(walk.part(twice), double) == pytest.approx(told(walk, stage), rel=0.15)


def test_a_band_beside_the_place_where_the_pose_has_it_does_not_speak_against_the_names():
    place = np.stack([np.zeros(30), 0.4 * SAME * np.arange(30)], axis=1)[None]
    dark, banded, seen = (np.full((1, 30), 40.0) for _ in range(3))
    banded[:, 10:15] = seen[:, 12:17] = 200.0
    near, far = (Leg(place, seen, look, np.ones((1, 30), bool)) for look in (banded, dark))
    told = _evidence(near, far, 0)
    assert told.min() == 0.0
    assert np.count_nonzero(told) == 10
    np.testing.assert_array_equal(_evidence(far, near, 0), -np.roll(told, 30))
