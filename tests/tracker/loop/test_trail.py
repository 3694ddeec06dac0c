"""Columns of estimates hold what the estimates held, in half the memory."""

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from dynamics.gaussian import Gaussian
from tracker.loop.estimate import NOTHING, Estimate
from tracker.loop.outcome import Outcome
from tracker.loop.trail import ROOM, Trail

D = 17


def estimates(rng, T):
    outcomes = rng.choice(np.array(Outcome), T)
    covs = rng.normal(size=(T, D, D)).astype(np.float32)  # what single precision holds, it returns
    return [
        Estimate(Gaussian(rng.normal(size=D), cov), t % 3, Outcome(at), NOTHING, rng.normal(size=3), 0.5 * t)
        for t, (cov, at) in enumerate(zip(covs, outcomes, strict=True))
    ]


def trail_of(rows):
    trail = Trail(D)
    trail.extend(rows)
    return trail


def assert_holds(trail, rows):
    assert len(trail) == len(rows)
    assert_array_equal(trail.column("mean"), [row.pose.mean for row in rows])
    assert_array_equal(trail.column("cov"), [row.pose.cov for row in rows])
    assert_array_equal(trail.column("moved"), [row.moved for row in rows])
    assert_array_equal(trail.column("misfit"), [row.misfit for row in rows])
    assert_array_equal(trail.column("s"), [row.s for row in rows])
    assert trail.outcome == [row.outcome for row in rows]


@pytest.mark.parametrize("foreseen", [-1, 0, 3, 600, 10**12])
def test_more_or_fewer_frames_may_come_than_were_foreseen(rng, foreseen):
    rows = estimates(rng, ROOM + 5)
    trail = Trail(D, foreseen)
    trail.extend(rows)
    assert_holds(trail, rows)


def test_a_foreseen_number_of_frames_is_never_moved_to_a_larger_place(rng):
    rows, trail = estimates(rng, 3), Trail(D, 3 * ROOM)
    place = trail.column("cov").__array_interface__["data"]
    trail.extend(rows * ROOM)
    assert trail.column("cov").__array_interface__["data"] == place


def test_frames_that_are_taken_off_come_back_whole(rng):
    rows = estimates(rng, 7)
    trail = trail_of(rows)
    found = trail.pop(3)
    assert_holds(trail, rows[:4])
    assert_holds(trail_of(found), rows[4:])
    assert [row.misfit for row in found] == [row.misfit for row in rows[4:]]
    assert trail.pop(0) == []
    trail.extend(found)
    assert_holds(trail, rows)


def test_a_trail_turns_round(rng):
    rows = estimates(rng, 6)
    trail = trail_of(rows)
    trail.reverse()
    assert_holds(trail, rows[::-1])
    assert trail.pop(1)[0].misfit == rows[0].misfit


def test_what_was_read_of_a_trail_stays_as_it_grows(rng):
    rows = estimates(rng, ROOM + 2)
    trail = trail_of(rows[:2])
    read = trail.column("mean")
    trail.extend(rows[2:])
    assert_holds(trail, rows)
    assert_array_equal(read, [row.pose.mean for row in rows[:2]])


def test_a_frame_takes_little_more_than_its_numbers(rng):
    (row,) = estimates(rng, 1)
    tracemalloc.start()
    trail = trail_of([row] * (4 * ROOM))
    used, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert used / len(trail) < 1.2 * (4 * D * D + 8 * D + 3 * 8 + 2 * 8)
