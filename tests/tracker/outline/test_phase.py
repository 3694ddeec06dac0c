from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.outline.films import CYCLES, FPS, MIDDLE, SHAPE, WALK, WALKER, enlarged
from tracker.outline.cycles import PHASES, columns_of
from tracker.outline.phase import phases

NOT_MARKED = np.full(len(columns_of(WALKER)), np.nan)


def found(film, stage, *, hips=None, marked=None):
    angles = film.q[MIDDLE, columns_of(WALKER)] if marked is None else marked
    hips = film.hips if hips is None else hips
    return phases(stage, SHAPE, CYCLES, hips, film.units, angles, MIDDLE)


def late(film, phase):
    """(T,) by how much phases come after the true ones."""
    return (phase - film.phase + PHASES / 2) % PHASES - PHASES / 2


@pytest.mark.parametrize("way", [1, -1], ids=["ahead", "backwards"])
def test_the_walkers_own_cycle_and_phase_are_found_and_which_way_time_runs_in_it(way, either_way, rng):
    film = either_way if way > 0 else either_way.backwards()
    seen = found(film, film.stage(rng))
    assert (seen.cycle, seen.way) == (WALK, way)
    assert np.abs(late(film, seen.phase)).max() < 1.5


def test_of_who_stays_in_one_place_the_poses_alone_tell_that_they_run_back(walk, rng):
    seen = walk.backwards().on_the_spot()  # as on a treadmill
    hips = np.tile(seen.hips[MIDDLE], (len(seen.hips), 1))
    assert found(seen, seen.stage(rng), hips=hips).way == -1


@pytest.mark.parametrize("by", [0.3, 3.0])
def test_who_goes_backwards_is_told_whatever_the_size_of_the_first_frame(by, walk, rng):
    assert found(walk, enlarged(walk.stage(rng), by)).way == 1
    spot = walk.backwards().on_the_spot()
    hips = np.tile(spot.hips[MIDDLE], (len(spot.hips), 1)) + np.linspace(0.0, 16.0, len(spot.hips))[
        :, None
    ] * [1, 0]
    assert found(spot, enlarged(spot.stage(rng), by), hips=hips).way == -1  # too little travel to decide


@pytest.mark.parametrize("times", [4, 6])
def test_the_phase_is_found_in_slow_motion(times, walk, rng):
    slow = walk.part(np.repeat(np.arange(len(walk.q)), times))
    seen = found(slow, slow.stage(rng))
    assert (seen.cycle, seen.way) == (WALK, 1)
    assert np.abs(late(slow, seen.phase)).max() < 2.0


def test_with_the_legs_marked_the_other_way_round_the_phase_is_half_a_stride_off(walk, stage):
    exchanged = walk.q[MIDDLE, WALKER.exchanged][columns_of(WALKER)]
    seen = found(walk, stage, marked=exchanged)
    assert np.abs(np.abs(late(walk, seen.phase)) - PHASES / 2).max() < 2.0


def test_the_phase_is_found_whatever_the_rate_of_the_frames(walk, stage):
    seen = found(walk, replace(stage, fps=2.0 * FPS))
    assert np.abs(late(walk, seen.phase)).max() < 1.5


def test_the_shift_leads_from_where_the_hip_was_put_to_where_it_is(walk, rng):
    film = walk.mirrored()
    off = np.array([0.12, -0.06])  # ahead and up, leg lengths
    hips = film.hips - off * film.units[:, None] * (film.facing, -1.0)
    shift = found(film, film.stage(rng), hips=hips, marked=NOT_MARKED).shift
    np.testing.assert_allclose(np.median(shift, axis=0), off, atol=1.0 / 16.0)


def test_a_trunk_that_leans_further_than_the_cycles_is_found_to_lean(walk, stage):
    upright = replace(CYCLES, pose=CYCLES.pose[[WALK]])
    back = upright.pose.copy()
    back[..., 0] -= np.radians(30.0)
    angles = walk.q[MIDDLE, columns_of(WALKER)]
    leans = [
        phases(stage, SHAPE, each, walk.hips, walk.units, angles, MIDDLE).lean
        for each in (upright, replace(upright, pose=back))
    ]
    assert np.all(leans[0] == 0.0)
    assert np.median(leans[1]) == pytest.approx(np.radians(30.0))


def test_a_rare_kind_of_stride_is_taken_only_where_the_film_shows_it_clearly(walk, stage):
    pose, runs = CYCLES.pose[[WALK, WALK, 1]], CYCLES.runs[[WALK, WALK, 1]]
    angles = walk.q[MIDDLE, columns_of(WALKER)]

    def cycle(*rare):
        kinds = replace(CYCLES, pose=pose, runs=runs, rare=np.array(rare))
        return phases(stage, SHAPE, kinds, walk.hips, walk.units, angles, MIDDLE).cycle

    assert cycle(True, False, False) == 1
    assert cycle(True, True, False) < 2  # the other one is a run
