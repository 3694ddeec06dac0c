"""Pieces of a path: which are of one person, and the path that they make."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.outline.films import FPS, UNIT, enlarged, film
from tracker.outline.bodies import Path
from tracker.outline.pieces import ALIKE, HIGHER, LONGEST, NEAR, SPEED, in_scene, joined

SPAN = 90  # frames
STEP = 1.6 * UNIT / FPS  # pixels a frame of who walks
NAMES = ("hips", "units", "score")


@pytest.fixture(scope="module")
def stage():
    """A scene over which the camera goes; nothing of the pictures is looked at."""
    few = film(np.random.default_rng(3), frames=4, walker=False).stage(np.random.default_rng(4))
    places = np.tile(np.eye(3), (SPAN, 1, 1))
    places[:, 0, 2] = 0.7 * np.arange(SPAN)
    return replace(few, odds=np.tile(few.odds[:1], (SPAN, 1, 1)), light=few.odds[:1], places=places)


def piece(stage, first, last, *, x=10.0, y=90.0, step=STEP, size=1.0, score=20.0):
    """Somebody who was, or would have been, at x in frame 0 and goes on evenly over the scene."""
    times = np.arange(first, last + 1)
    scene = np.column_stack([x + step * times, np.full(len(times), y)])
    hips = replace(stage, places=stage.places[first : last + 1]).in_frames(scene)
    return Path(first, hips, np.full(len(times), size * UNIT), np.full(len(times), score))


def test_who_was_hidden_for_a_while_is_one_path_straight_between(stage):
    whole = piece(stage, 0, 80)
    (path,) = joined(stage, [piece(stage, 0, 30), piece(stage, 50, 80)])
    assert (path.first, path.last) == (0, 80)
    np.testing.assert_allclose(path.hips, whole.hips, atol=1e-9)
    np.testing.assert_allclose(path.units, UNIT)
    assert np.all(path.score[31:50] == 0.0)


def test_three_pieces_are_one_and_the_surest_comes_first(stage):
    pieces = [piece(stage, 50, 70), piece(stage, 0, 20), piece(stage, 30, 40)]
    other = piece(stage, 10, 60, x=-3.0 * UNIT, score=90.0)
    surest, one = joined(stage, [*pieces, other])
    assert (surest.first, surest.last) == (10, 60)
    assert (one.first, one.last) == (0, 70)


@pytest.mark.parametrize("by", [0.4, 2.5])
def test_pieces_are_of_one_person_whatever_the_size_of_the_first_frame(by, stage):
    near = piece(stage, 50, 80, x=10.0 + 0.8 * NEAR * UNIT)
    off = piece(stage, 50, 80, x=10.0 + 1.2 * NEAR * UNIT)
    assert len(joined(enlarged(stage, by), [piece(stage, 0, 30), near])) == 1
    assert len(joined(enlarged(stage, by), [piece(stage, 0, 30), off])) == 2


@pytest.mark.parametrize(
    "other",
    [
        {"first": 32 + round(LONGEST * FPS)},  # hidden too long
        {"x": 10.0 + 1.1 * NEAR * UNIT},  # somewhere else
        {"y": 90.0 + 1.1 * HIGHER * UNIT},
        {"x": 10.0 + 80.0 * STEP, "step": -STEP},  # the other way, from where the first went to
        {"x": 10.0 - 40.0 * 1.1 * SPEED * UNIT / FPS, "step": STEP + 1.1 * SPEED * UNIT / FPS},  # faster
        {"size": 1.05 * ALIKE},
        {"first": 25},  # at the same time
    ],
)
def test_who_cannot_be_the_same_stays_another(other, stage):
    second = piece(stage, **{"first": 50, "last": 85} | other)
    assert len(joined(stage, [piece(stage, 0, 30), second])) == 2


def test_paths_that_went_back_with_who_was_met_are_put_right(stage):
    met = 40
    there, back = piece(stage, 0, met), piece(stage, met + 1, 80, x=10.0 + 2 * met * STEP, step=-STEP)
    exchanged = Path(0, *(np.concatenate([getattr(there, n), getattr(back, n)]) for n in NAMES))
    rest = piece(stage, 55, 80), piece(stage, 0, 25, x=10.0 + 2 * met * STEP, step=-STEP)
    found = joined(stage, [exchanged, *rest])
    assert [(path.first, path.last) for path in found] == [(0, 80), (0, 80)]
    ways = [np.diff(in_scene(stage, path)[:, 0]) for path in found]
    for way in ways:
        np.testing.assert_allclose(way, np.sign(way[0]) * STEP, atol=1e-6)
    assert {np.sign(way[0]) for way in ways} == {1.0, -1.0}


def test_a_few_places_on_who_is_met_do_not_tell_how_a_person_went(stage):
    second = piece(stage, 50, 80)
    second.hips[:4, 0] -= np.linspace(0.8 * UNIT, 0.2 * UNIT, 4)
    assert len(joined(stage, [piece(stage, 0, 30), second])) == 1
