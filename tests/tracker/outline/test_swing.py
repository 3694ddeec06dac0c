from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from kinematics.spm import joints
from tests.tracker.outline.films import WALKER, evidence
from tracker.outline.swing import TOGETHER, swing

SWING = 0.3  # of an arm for the distance of the knees
STRIPES = 0.15  # leg lengths from one stripe to the next

told = partial(evidence, swing)


def ahead(film):
    """(T, 1) leg lengths from the far to the near knee."""
    knees = [WALKER.joints.index(name) for name in ("far_knee", "near_knee")]
    return np.diff(joints(WALKER, film.q)[:, knees, 0], axis=1)


def dressed(film, stage, *, share=-SWING, light=0.0):
    """The film with stripes across the picture that move by a share of the distance between the knees."""
    x = film.facing * (np.arange(stage.light.shape[2]) - film.hips[:, :1]) / film.units[:, None]
    stripes = 100.0 + 60.0 * np.sin(2.0 * np.pi * (x - share * ahead(film)) / STRIPES)
    stripes += light * np.arange(len(film.q))[:, None]
    whole = np.broadcast_to(stripes[:, None], stage.light.shape)
    return replace(stage, light=np.rint(whole).astype(np.uint8))


def test_an_arm_that_swings_against_the_near_leg_says_that_it_is_the_nearer_one(either_way, rng):
    film, stage = either_way, either_way.stage(rng)
    most = np.sqrt((len(film.q) - 2) / TOGETHER)
    assert 0.6 * most < told(film, dressed(film, stage)) < most
    assert told(film, dressed(film, stage, share=SWING)) < -0.6 * most


def test_with_the_legs_exchanged_the_same_speaks_against_the_names(walk, stage):
    exchanged = walk.q[:, WALKER.exchanged]
    striped = dressed(walk, stage)
    assert told(walk, striped, q=exchanged) == pytest.approx(-told(walk, striped), rel=1e-9)


def test_a_trunk_on_which_nothing_moves_tells_nothing(walk, stage):
    assert abs(told(walk, dressed(walk, stage, share=0.0))) < 0.3
    assert told(walk, replace(stage, light=np.full_like(stage.light, 90))) == 0.0


def test_a_light_that_grows_is_no_motion(walk, stage):
    assert told(walk, dressed(walk, stage, light=2.0)) == pytest.approx(
        told(walk, dressed(walk, stage)), abs=0.1
    )


def test_a_light_that_changes_with_every_step_is_no_motion(walk, stage):
    x = (np.arange(stage.light.shape[2]) - walk.hips[:, :1]) / walk.units[:, None]
    shaded = np.clip(120.0 + 100.0 * x, 20.0, 220.0) + 30.0 * ahead(walk)
    lit = replace(stage, light=np.rint(np.broadcast_to(shaded[:, None], stage.light.shape)).astype(np.uint8))
    assert abs(told(walk, lit)) < 0.5


def test_frames_in_which_nothing_is_seen_are_not_heard(walk, stage):
    seen, striped = np.zeros(len(walk.q), bool), dressed(walk, stage)
    assert told(walk, striped, seen=seen) == 0.0
    seen[:20] = True
    spoiled = striped.light.copy()
    spoiled[20:] = dressed(walk, stage, share=SWING).light[20:]
    some = told(walk, striped, seen=seen)
    assert told(walk, replace(striped, light=spoiled), seen=seen) == pytest.approx(some, abs=0.02)
    assert some > 0.5


def test_a_film_with_every_frame_twice_tells_as_much(walk, stage):
    twice = np.repeat(np.arange(len(walk.q)), 2)
    double = replace(dressed(walk, stage).part(twice), fps=2.0 * stage.fps)
    assert told(walk.part(twice), double) == pytest.approx(told(walk, dressed(walk, stage)), rel=0.15)


def test_two_frames_tell_nothing(walk, stage):
    film = walk.part(slice(0, 2))
    assert told(film, stage.part(slice(0, 2))) == 0.0
