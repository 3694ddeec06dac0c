"""What a film tells of one person where others walk through it too."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.outline.films import SPEED, UNIT, enlarged
from tracker.outline.bodies import Path
from tracker.outline.others import ABOVE, BESIDE, forget_others, path_of
from tracker.survey.evidence import NOTHING


def path(walker, first=0):
    hips, units = walker.hips[first:], walker.units[first:]
    return Path(first, hips, units, np.ones(len(hips)))


def without_others(stage, own, everybody):
    """The film's log odds without other people."""
    copied = replace(stage, odds=stage.odds.copy())
    forget_others(copied, own, everybody)
    return copied.odds


def test_nothing_is_known_of_others_and_all_of_oneself(two, rng):
    left, right = two
    stage = left.behind(right).stage(rng)
    one, other = map(path, two)
    found = without_others(stage, one, [one, other])
    own, theirs = left.cover > 0.5, right.cover > 0.9
    np.testing.assert_array_equal(found[own], stage.odds[own])
    assert (found[theirs] == NOTHING).mean() > 0.95
    small = replace(other, units=0.4 * other.units)  # a path of limbs alone
    np.testing.assert_array_equal(without_others(stage, one, [one, small]), found)


def test_of_who_passes_close_nothing_is_known_either(two, rng):
    left, _ = two
    stage, own = left.stage(rng), path(left)
    near = replace(own, hips=own.hips + np.array([0.3 * UNIT, 0.0]))
    found = without_others(stage, own, [own, near])
    hidden = found == NOTHING
    covered = left.cover > 0.9
    assert 0.5 < hidden[covered].mean() < 1.0


def test_before_the_own_path_begins_the_own_figure_is_kept_where_it_must_have_been(two, rng):
    left, _ = two
    stage, late = left.stage(rng), path(left, first=12)
    piece = replace(path(left), hips=left.hips[:8], units=left.units[:8], score=np.ones(8))
    np.testing.assert_array_equal(without_others(stage, late, [late, piece]), stage.odds)
    away = replace(piece, hips=piece.hips + np.array([2.0 * UNIT, 0.0]))
    assert (without_others(stage, late, [late, away])[:8] != stage.odds[:8]).any()


@pytest.fixture
def led(two, rng):
    """Which path leads to a hip in a frame."""
    stage = two[0].behind(two[1]).stage(rng)
    return lambda hip, frame, paths: path_of(stage, hip, UNIT, frame, paths)


def test_the_path_of_a_marked_hip_is_the_one_that_leads_there(two, led):
    paths = [path(each) for each in two]
    hip = two[1].hips[5]
    assert led(hip, 5, paths) is paths[1]
    assert led(hip + UNIT * np.array([0.9 * BESIDE, 0.9 * ABOVE]), 5, paths) is paths[1]
    assert led(hip + UNIT * np.array([1.1 * BESIDE, 0.0]), 5, paths) is None
    assert led(hip + UNIT * np.array([0.0, 1.1 * ABOVE]), 5, paths) is None
    assert led(hip, 19, paths) is None  # gone on since
    close = replace(paths[1], hips=paths[1].hips + np.array([3.0 * SPEED, 0.0]))
    assert led(hip, 5, [close, *paths]) is paths[1]


def test_where_two_meet_the_path_is_that_of_who_goes_the_way_the_figure_faces(two, led):
    hip, own = two[1].hips[5], path(two[1])
    against = replace(own, hips=2.0 * hip - own.hips)
    beside = replace(own, hips=own.hips + np.array([0.5 * BESIDE * UNIT, 0.0]))
    assert led(hip, 5, [against, beside]) is beside
    assert led(hip, 5, [against]) is against  # who walks backwards alone


@pytest.mark.parametrize("by", [0.3, 3.0])
def test_which_way_a_path_goes_is_told_whatever_the_size_of_the_first_frame(by, two, rng):
    hip, own = two[1].hips[5], path(two[1])
    little = (own.hips - hip) * 0.8 * UNIT / np.ptp(own.hips[:, 0])  # too little to be against the facing
    slow, beside = (
        replace(own, hips=hip - little),
        replace(own, hips=own.hips + np.array([0.5 * BESIDE * UNIT, 0.0])),
    )
    stage = enlarged(two[0].behind(two[1]).stage(rng), by)
    assert path_of(stage, hip, UNIT, 5, [slow, beside]) is slow


def test_a_path_leads_on_where_who_goes_along_it_is_hidden(two, led):
    hip, own = two[1].hips[5], path(two[1])
    later, earlier = own.part(slice(8, None)), own.part(slice(0, 4))
    later.hips[0, 0] += 0.3 * UNIT  # one place is inexact
    assert led(hip, 5, [later]) is later
    assert led(hip, 5, [earlier, own]) is own
