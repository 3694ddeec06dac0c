from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.outline.films import CYCLES, FPS, FRAMES, MIDDLE, SHAPE, SIZE, UNIT, film
from tracker.outline import place
from tracker.outline.kernels import Kernels
from tracker.outline.place import DENSITY
from tracker.survey.evidence import NOTHING


def off(found, seen):
    """Farthest from the true hip, leg lengths, and the largest log ratio of sizes."""
    hips, units = found
    away = np.hypot(*(hips - seen.hips).T) / seen.units
    return away.max(), np.abs(np.log(units / seen.units)).max()


@pytest.mark.parametrize("frame", [0, FRAMES - 1])
def test_the_hip_is_found_within_two_places_of_the_truth(frame, either_way, rng):
    found = place.walk(either_way.stage(rng), SHAPE, CYCLES, either_way.start(frame), frame)
    away, size = off(found, either_way)
    assert away < 2.0 / DENSITY
    assert size < np.log(1.12)


def test_who_comes_nearer_is_found_larger_before_a_camera_that_moves(rng):
    seen = film(rng, camera=(1.0, 0.0, 0.0, -0.008))
    found = place.walk(seen.stage(rng), SHAPE, CYCLES, seen.start(), MIDDLE)
    away, size = off(found, seen)
    assert seen.units[-1] > 1.25 * seen.units[0]
    assert found[1][MIDDLE] == pytest.approx(seen.units[MIDDLE])
    assert away < 3.0 / DENSITY
    assert size < 0.09


@pytest.mark.parametrize("frame", [0, FRAMES - 1])
def test_wherever_the_mark_is_a_camera_that_zooms_changes_nothing(frame, rng):
    seen = film(rng, camera=(0.0, 0.0, 0.0, 0.02))
    away, size = off(place.walk(seen.stage(rng), SHAPE, CYCLES, seen.start(frame), frame), seen)
    assert away < 1.0 / DENSITY
    assert size < 0.02


def test_far_as_a_camera_pans_no_more_is_kept_of_a_frame_than_it_shows(rng, monkeypatch):
    seen, kept = film(rng, camera=(4.0, 0.0, 0.0, 0.0)), []
    sums = Kernels.sums
    monkeypatch.setattr(Kernels, "sums", lambda self, odds: kept.append(odds.shape) or sums(self, odds))
    found = place.walk(seen.stage(rng), SHAPE, CYCLES, seen.start(), MIDDLE)
    assert off(found, seen)[0] < 2.0 / DENSITY
    assert max(columns for _, columns in kept) < SIZE[0] * DENSITY / UNIT + 7.0


def test_of_two_alike_the_path_stays_with_the_marked_one(walk, stage):
    behind = np.roll(stage.odds, -70, axis=2)
    both = replace(stage, odds=np.maximum(stage.odds, behind))
    for away in (0.0, -70.0):
        hips = walk.hips + np.array([away, 0.0])
        found, _ = place.walk(both, SHAPE, CYCLES, replace(walk, hips=hips).start(), MIDDLE)
        assert np.hypot(*(found - hips).T).max() < 2.0 * UNIT / DENSITY


def test_who_was_found_is_not_left_for_somebody_who_stands_out_more(walk, stage):
    """From a start without marks; the path that was found tells where."""
    start = replace(walk.start(MIDDLE), known=np.zeros(len(walk.start().known), bool))
    faint = (NOTHING + 0.4 * (stage.odds.astype(float) - NOTHING)).astype(np.uint8)
    both = replace(stage, odds=np.maximum(faint, np.roll(stage.odds, -70, axis=2)))

    def farthest(found):
        hips, _ = place.walk(both, SHAPE, CYCLES, start, MIDDLE, found)
        return np.hypot(*(hips - walk.hips).T).max()

    assert farthest(walk.hips) < 2.0 * UNIT / DENSITY < 50.0 < farthest(None)


def test_what_stands_still_beside_the_way_does_not_catch_the_path(walk, stage):
    odds = stage.odds.copy()
    odds[:, :, 190:220] = np.maximum(odds[:, :, 190:220], NOTHING + 40)
    found = place.walk(replace(stage, odds=odds), SHAPE, CYCLES, walk.start(0), 0)
    assert off(found, walk)[0] < 2.0 / DENSITY


def test_a_sprinter_at_a_low_rate_is_followed_from_either_end(walk, rng):
    some = walk.part(slice(None, None, 4))
    faster = 20 * np.arange(len(some.q))
    sprint = some.carried(np.stack([faster - faster[len(faster) // 2], 0 * faster], axis=1))
    stage = replace(sprint.stage(rng), fps=FPS / 4.0)
    for frame in (0, len(sprint.q) - 1):
        away, size = off(place.walk(stage, SHAPE, CYCLES, sprint.start(frame), frame), sprint)
        assert away < 2.0 / DENSITY
        assert size < np.log(1.12)
