"""Who was found on a path: which way the person faces and goes, and where to start."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.outline.films import FEW, SIZE, UNIT, WALKER, a_walk, enlarged
from tracker.clip.found import TURNED
from tracker.outline import person as outlines
from tracker.outline.bodies import Path
from tracker.outline.person import GOES, person
from tracker.survey.evidence import NOTHING, UNITS

ANKLES = [WALKER.joints.index(name) for name in ("near_ankle", "far_ankle")]


def path_of(film, first=0):
    """A path along the walker, as large as it is found to be."""
    T = len(film.q)
    return Path(first, film.hips, film.units / 1.1, np.where(np.arange(T) == T // 2, 30.0, 20.0))


def found_in(film, rng):
    return person(film.stage(rng), WALKER, path_of(film), FEW)


def apart(joints):
    """(T,) columns between the ankles."""
    return np.abs(np.diff(joints[:, ANKLES, 0], axis=1))[:, 0]


@pytest.mark.parametrize(
    ("paint", "facing", "direction"),
    [(lambda: a_walk().mirrored(), -1, -1), (lambda: a_walk().backwards(), 1, -1)],
)
def test_which_way_somebody_faces_and_goes_are_told_apart(paint, facing, direction, rng):
    film = paint().part(slice(4, 28))
    found = found_in(film, rng)
    assert (found.facing, found.direction, found.outline.gait) == (facing, direction, "walk")
    assert found.turned > TURNED
    assert (found.first, found.last) == (0, 23)
    away = np.hypot(*np.moveaxis(found.outline.joints - film.joints, -1, 0)) / UNIT
    assert min(away.mean(), away[:, WALKER.joint_twins].mean()) < 0.1
    assert apart(film.joints)[found.frame] > 0.9 * apart(film.joints).max()


def test_a_start_is_taken_only_where_every_joint_is_in_the_picture(walk, rng):
    out = walk.shifted(-84).part(slice(0, 28))  # in its first frames the walker is partly out of sight
    cover = out.cover.copy()
    cover[:, :, SIZE[0] - 60 :] = 0.0  # what came back in on the other side
    out = replace(out, cover=cover)
    inside = (out.joints[..., 0] > 0.0).all(1)
    assert 0 < inside.sum() < len(inside)
    found = found_in(out, rng)
    assert inside[found.frame]
    widest = apart(out.joints)
    assert widest[found.frame] > 0.9 * widest[inside].max()


def test_a_start_is_a_frame_in_which_the_trunk_is_as_long_as_elsewhere(walk, rng):
    film = walk.part(slice(8, 28))
    stage, one = film.stage(rng), found_in(film, rng)
    hip, *trunk = (WALKER.joints.index(name) for name in ("hip", "neck", "head_top"))
    best = one.frame - one.first
    joints = one.outline.joints.copy()
    joints[best, trunk] -= 0.2 * (joints[best, trunk] - joints[best, hip])  # the head is taken for the scene
    short = replace(one.outline, joints=joints)
    found = outlines._clearest(stage, short, WALKER, slice(None))
    assert found not in (None, best)
    assert apart(joints)[found] >= 0.9 * apart(joints).max()


def test_a_start_is_found_where_every_link_is_seen_if_there_is_such_a_frame(walk, rng):
    film = walk.part(slice(8, 28))
    stage, one = film.stage(rng), found_in(film, rng)
    seen = np.ones_like(one.outline.shown)
    seen[one.frame - one.first, -1] = False  # something hides a foot
    hidden = replace(one.outline, shown=seen)
    found = outlines._clearest(stage, hidden, WALKER, slice(None))
    assert found not in (None, one.frame - one.first)
    nowhere = replace(one.outline, shown=np.zeros_like(seen))
    assert outlines._clearest(stage, nowhere, WALKER, slice(None)) is not None


def test_foreground_around_a_figure_speaks_against_it(walk, rng):
    film = walk.part(slice(8, 28))
    stage, outline = film.stage(rng), film.person().outline
    clear, beside = stage.odds.copy(), stage.odds.copy()
    for t, (x, y) in enumerate(film.hips.round().astype(int)):
        rows, columns = slice(y + 8, y + 22), slice(x + 33, x + 47)  # before the legs
        clear[t, rows, columns] = beside[t, rows, columns] = NOTHING
        beside[t, rows, columns][2:-2, 2:-2] = NOTHING + 2.0 * UNITS
    without, with_it = (
        outlines._explained(replace(stage, odds=odds), outline, WALKER) for odds in (clear, beside)
    )
    assert without - with_it == pytest.approx(100 * 2.0, rel=0.05)  # square pixels times log odds


def test_who_is_never_in_sight_as_a_whole_is_nobody(walk, rng):
    stage = walk.part(slice(8, 28)).stage(rng)
    cut = slice(0, 136)  # of rows: the feet are below
    low = replace(stage, odds=stage.odds[:, cut], light=stage.light[:, cut])
    assert person(low, WALKER, path_of(walk.part(slice(8, 28))), FEW) is None


@pytest.mark.parametrize("alone", [True, False])
def test_who_is_seen_before_and_after_a_path_is_followed_there_too(alone, walk, rng):
    film = walk.part(slice(4, 28))
    whole, cut = path_of(film), slice(6, 18)
    path = Path(cut.start, whole.hips[cut], whole.units[cut], whole.score[cut])
    cover = film.cover.copy()
    cover[:2] = 0.0  # nobody is there yet
    found = person(replace(film, cover=cover).stage(rng), WALKER, path, FEW, alone=alone)
    assert (found.first, found.last) == (2, 23)
    away = np.hypot(*np.moveaxis(found.outline.joints - film.joints[2:], -1, 0)) / UNIT
    assert min(away.mean(), away[:, WALKER.joint_twins].mean()) < 0.1
    # Beyond the path the outline may have gone over to somebody else.
    sure = slice(2, None) if alone else cut
    assert sure.start <= found.frame < (sure.stop or 24)
    assert apart(film.joints)[found.frame] > 0.9 * apart(film.joints[sure]).max()


@pytest.mark.parametrize("by", [0.3, 1.0, 3.0])
def test_who_steps_on_the_spot_goes_nowhere_whatever_the_size_of_the_first_frame(by, walk, rng):
    """The scene moves under a walker who stays: a treadmill, or a camera that goes along."""
    film = walk.part(slice(4, 28))
    spot = film.on_the_spot(12)
    assert np.ptp(spot.hips[:, 0]) < GOES * UNIT < np.ptp(film.hips[:, 0])
    for each, direction in ((film, 1), (spot, 0)):
        found = found_in(enlarged(each, by), rng)
        assert (found.facing, found.direction) == (1, direction)


def test_who_is_mostly_in_one_place_is_one_person_and_who_only_passes_is_not(walk):
    one = walk.person()
    again = walk.part(slice(6, 20)).person(frame=3).in_film(6, 1)
    assert one.same(again)
    assert again.same(one)
    assert one.same(walk.shifted(10).person())
    assert not one.same(walk.shifted(30).person())
    assert not one.same(walk.mirrored().person())  # the two meet in the middle
    assert not one.same(again.in_film(one.last, 1))
    assert not one.same(replace(again, direction=-1))  # who turns round


def test_a_facing_that_is_given_is_taken(walk, rng):
    film = walk.part(slice(8, 28))
    found = person(film.stage(rng), WALKER, path_of(film), FEW, facing=-1)
    assert (found.facing, found.direction, found.given) == (-1, 1, True)
    assert found.turned < -TURNED


def test_a_person_of_every_third_frame_is_known_between_them(walk):
    one = walk.person(frame=5)
    shown = one.outline.shown.copy()
    shown[7, 2] = False
    one = replace(one, first=2, outline=replace(one.outline, shown=shown))
    all_frames = one.in_film(600, 3)
    assert (all_frames.first, all_frames.last, all_frames.frame) == (606, 600 + 3 * one.last, 615)
    np.testing.assert_array_equal(all_frames.joints, one.joints)
    np.testing.assert_allclose(all_frames.outline.hips[4], one.outline.hips[[1, 1, 2]].mean(0))
    assert np.flatnonzero(~all_frames.outline.shown[:, 2]).tolist() == [19, 20, 21, 22, 23]


def test_exchanged_legs_are_the_same_figure_with_other_names(walk):
    one = walk.person(named=2.5)
    other = one.exchanged
    near, far = ANKLES
    np.testing.assert_array_equal(other.joints[near], one.joints[far])
    np.testing.assert_array_equal(other.joints[0], one.joints[0])
    assert other.outline.named == -2.5
    np.testing.assert_array_equal(other.exchanged.outline.q, one.outline.q)


def test_a_larger_size_is_not_taken_for_walking_ahead_alone(walk, rng, monkeypatch):
    # All walk ahead; facing right explains a little more than facing left does in the larger size.
    def explained(stage, outline, figure):
        right, first = stage.facing > 0, np.median(outline.units) < 1.1 * np.median(path.units)
        return float(
            100.0 + (0.01 * UNIT**2 if right and first else 0.0 if not right and not first else -1e4)
        )

    film = walk.part(slice(8, 20))
    path = path_of(film)
    usual = outlines.fitted

    def fitted(stage, start, *others):
        found = usual(stage, start, *others)
        return replace(found, way=1, units=np.full_like(found.units, start.view.unit))

    monkeypatch.setattr(outlines, "fitted", fitted)
    monkeypatch.setattr(outlines, "_explained", explained)
    facing, larger, _ = outlines._fits(film.stage(rng), WALKER, path, None, FEW)
    assert (facing, larger) == (1, 1.0)
