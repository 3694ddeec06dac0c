"""What a finished track and the outline of its figure share of their constant difference."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.kinematics.figures import WALKER
from tests.tracker.strolls import stroll
from tracker.clip.agreement import FEWEST, agreed, constant_difference
from tracker.loop.detections import Detections
from tracker.settings import Settings

KNEES = [WALKER.index(name) for name in ("knee_near", "knee_far")]
ROOT, TRUNK = dict(root_x=0.02, root_y=-0.01), dict(torso=0.04, stretch_torso=0.03)
OFF = ROOT | TRUNK | dict(hip_near=0.05, hip_far=-0.03, knee_far=0.05)


@pytest.fixture
def track():
    """A walk that a camera follows, with bent knees."""
    walk = stroll(3.0)
    walk.q[:, KNEES] = 0.3
    moved = np.linspace([0.0, 0.0, 1.0], [40.0, -5.0, 1.2], len(walk))
    return replace(walk, moved=moved)


def outline_of(track, by=0.0, frames=None):
    """The joints of the track, its pose changed by so much, as an outline of some of its frames."""
    places = replace(track, q=track.q + by).joints()
    return {t: Detections(np.arange(len(WALKER.joints)), places[t]) for t in frames or range(len(track))}


def change(**by):
    return np.array([by.get(name, 0.0) for name in WALKER.freedoms])


def plan_of(outline, *, smooth=True, found=None, marked=1, measured=None):
    passed = dict.fromkeys(range(marked))
    return SimpleNamespace(
        job=SimpleNamespace(smooth=smooth, found=found, passed=lambda start: passed),
        frame=0,
        measured=measured,
        seen=SimpleNamespace(points=outline),
        video=SimpleNamespace(fps=30.0),
        tracker=SimpleNamespace(settings=Settings()),
    )


def test_a_constant_difference_is_found(track):
    by = change(**OFF)
    found, truth = constant_difference(track, outline_of(track, by)), replace(track, q=track.q + by).joints()
    apart, left = truth - track.joints(), truth - replace(track, q=track.q + found).joints()
    assert np.linalg.norm(left, axis=-1).mean() < 0.15 * np.linalg.norm(apart, axis=-1).mean()
    assert_allclose(found[:3], by[:3], atol=0.01)


def test_single_frames_elsewhere_and_those_in_which_nothing_was_measured_do_not_count(track):
    outline = outline_of(track, change(**OFF))
    alone = constant_difference(track, outline)
    away = outline_of(track, change(root_x=2.0), range(0, len(track), 5))
    assert_allclose(constant_difference(track, outline | away)[:8], alone[:8], atol=0.01)
    lost = replace(track, outcome=tuple("lost" if t in away else "ok" for t in range(len(track))))
    assert_array_equal(constant_difference(lost, outline | away), constant_difference(lost, outline))


def test_an_outline_much_farther_off_than_marks_are_is_not_believed(track):
    near, far = (constant_difference(track, outline_of(track, change(root_x=by))) for by in (0.085, 0.095))
    assert near[0] > 0.08
    assert_array_equal(far, 0.0)


def test_a_few_frames_tell_nothing(track):
    by = change(**OFF)
    few = range(10, 10 + FEWEST)
    assert np.abs(constant_difference(track, outline_of(track, by, few))).max() > 0.01
    assert_array_equal(constant_difference(track, outline_of(track, by, few[1:])), 0.0)
    assert_array_equal(constant_difference(track, {}), 0.0)


@pytest.mark.parametrize(
    ("given", "share"),
    [
        ({}, 0.3),
        ({"marked": 3}, 0.125),
        ({"found": object()}, 0.5),
        ({"found": object(), "marked": 2}, 1.0 / (1.0 + 7.0 / 3.0 + 1.0)),
        ({"smooth": False}, 0.0),
        ({"measured": object()}, 0.0),
    ],
)
def test_the_more_frames_are_marked_the_less_the_track_is_moved(track, given, share):
    outline = outline_of(track, change(**OFF))
    moved = agreed(plan_of(outline, **given), track).q - track.q
    assert_allclose(moved, np.tile(share * constant_difference(track, outline), (len(track), 1)), atol=1e-12)
