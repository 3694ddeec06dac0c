"""Who is found in a film file, and the start that comes of it."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.tracker.clip.filmed import as_video
from tests.tracker.outline.films import BORDER, MIDDLE, SIZE, UNIT, WALKER, film
from tracker.clip import found as found_module
from tracker.clip import staged as staged_module
from tracker.clip.found import AGAIN, CLEARLY, DOUBTED, NARROW, TURNED, people, start_of
from tracker.clip.job import Following, Nearer
from tracker.clip.naming import nearer, sure_of_leg
from tracker.clip.outlines import look
from tracker.clip.plan import prepare
from tracker.clip.staged import FEWEST, LEAST, fewest
from tracker.clip.start import FoundError
from tracker.outline.spot import Spot
from tracker.progress import Progress
from tracker.survey.evidence import FULL_OF_SHADOWS, ORDINARY

QUIET = Progress("quiet")


@pytest.fixture(scope="module")
def found(video):
    return people(video, QUIET)


def test_the_walker_of_a_film_is_found_where_the_walker_is(found, walk):
    (one,) = found
    assert (one.first, one.last) == (0, len(walk.q) - 1)
    assert (one.facing, one.direction, one.outline.gait) == (1, 1, "walk")
    assert np.hypot(*(one.joints - walk.joints[one.frame]).T).mean() < 0.06 * UNIT
    assert one.outline.units == pytest.approx(UNIT, rel=0.2)


def test_a_frame_that_does_not_show_the_scene_is_none_to_start_from(walk, tmp_path, rng):
    images = np.array(walk.images)
    images[MIDDLE] = cv2.resize(rng.integers(0, 256, (8, 12, 3)).astype(np.uint8), SIZE)
    (one,) = people(as_video(images, tmp_path), QUIET)
    assert one.frame != MIDDLE
    assert np.hypot(*(one.joints - walk.joints[one.frame]).T).mean() < 0.06 * UNIT
    assert one.turned > 2.0 * TURNED
    assert sure_of_leg(one)


def test_a_start_is_what_was_found(found, walk, video):
    start = start_of(found, Following(), video)
    places = np.array([[start.marks[name].x, start.marks[name].y] for name in WALKER.joints])
    assert np.hypot(*(places - walk.joints[start.frame]).T).mean() < 0.06 * UNIT
    assert (start.frame, start.facing, start.near_leg) == (found[0].frame, 1, "sure")


def test_of_a_high_frame_rate_some_frames_are_searched_and_the_person_is_known_in_all(tmp_path, monkeypatch):
    walk = film(np.random.default_rng(20), frames=64)
    monkeypatch.setattr(staged_module, "OFTEN", 15.0)  # of the film's 30 frames a second
    monkeypatch.setattr(staged_module, "ENOUGH", 32)
    video = as_video(walk.images, tmp_path)
    monkeypatch.setattr(found_module, "WINDOW", 20)  # surveyed frames: 40 of the film
    (one,) = people(video, QUIET)
    assert (one.first, one.last) == (0, 38)
    away = np.hypot(*(one.outline.joints - walk.joints[:39]).transpose(2, 0, 1))
    assert away.mean() < 0.08 * UNIT


def test_who_goes_on_beyond_the_frames_that_are_searched_is_seen_there_too(tmp_path, monkeypatch):
    video = as_video(film(np.random.default_rng(20), frames=64).images, tmp_path)
    monkeypatch.setattr(found_module, "WINDOW", 40)
    (one,) = people(video, QUIET)
    assert one.last == 39
    start = start_of([one], Following(), video)
    assert sorted(look(prepare(Following().job(video.path, start)), QUIET).points) == list(range(64))
    (same,) = people(video, QUIET, stop=39)
    assert same.last == 39


@pytest.mark.whole
def test_two_people_who_cross_are_each_seen_throughout(tmp_path):
    one = film(np.random.default_rng(20), frames=60)
    other = one.mirrored()
    found = people(as_video(one.behind(other).images, tmp_path), QUIET)
    assert [(each.facing, each.direction) for each in found] == [(1, 1), (-1, -1)]
    for each, truth in zip(found, (one, other), strict=True):
        assert each.turned > TURNED
        assert (each.first, each.last) == (0, 59)
        away = np.hypot(*(each.outline.hips - truth.hips).T) / UNIT
        assert np.median(away) < 0.1
        assert away.max() < 0.6  # while one hides the other


def test_where_nobody_walks_nobody_is_found_though_the_camera_moves(rng, tmp_path):
    empty = film(rng, frames=FEWEST, camera=(1.2, 0.3, 0.0, 0.001), walker=False)
    assert people(as_video(empty.images, tmp_path), QUIET) == []


def test_where_the_light_changes_nobody_is_found(rng, tmp_path):
    empty = film(rng, frames=FEWEST, walker=False).images
    ramp = np.linspace(1.0, 0.7, len(empty))[:, None, None, None]
    ramp = np.where(np.arange(len(empty))[:, None, None, None] > 12, 0.6, ramp)  # and jumps
    assert people(as_video(np.rint(empty * ramp).astype(np.uint8), tmp_path), QUIET) == []


@pytest.fixture
def expected(monkeypatch):
    """What clothes and shadows are expected to look like at every look at the film."""
    looks, stage = [], staged_module.Surveyed.stage

    def noted(surveyed, facing, expected=ORDINARY):
        looks.append(expected)
        return stage(surveyed, facing)

    monkeypatch.setattr(staged_module.Surveyed, "stage", noted)
    return looks


@pytest.mark.parametrize(
    ("turned", "looks"),
    [
        ((0.01, 0.3), 2),
        ((0.08, 0.02, 0.2), 3),
        ((0.01, 0.02, 0.01, 0.01, 0.03), 5),
        ((0.05, 0.04, 0.02, 0.01, 0.01), 5),
        ((0.01, -0.3), 2),
    ],
)
def test_who_is_not_seen_clearly_is_looked_for_again_with_other_clothes_and_shadows_expected(
    turned, looks, walk, video, expected, monkeypatch
):
    def before(*_):
        look = len(expected) - 1
        one = replace(walk.person(turned=turned[look], frame=look), given=min(turned) < 0.0)
        return [one, walk.shifted(60).person(frame=look)]

    monkeypatch.setattr(found_module, "_before", before)
    (one, sure) = people(video, QUIET)
    assert expected == [ORDINARY, *AGAIN][:looks]
    assert (one.frame, one.turned) == (int(np.argmax(np.abs(turned))), max(turned, key=abs))
    assert (sure.frame, sure.turned) == (0, 0.3)  # who was clear stays


def spread(one, by):
    """The person with joints that may be this far off."""
    return replace(one, outline=replace(one.outline, spread=np.full_like(one.outline.spread, by)))


@pytest.mark.parametrize(
    ("turned", "spreads", "which"),
    [
        ((0.12, 0.13, 0.1), (0.0, 0.0, 0.0), 0),
        ((0.12, 0.14, 0.15), (0.0, 0.0, 0.0), 1),
        ((0.12, 0.08, 0.16), (0.0, 0.0, 0.0), 2),
        ((0.9 * CLEARLY, 0.3), (0.0, 2.0 * DOUBTED), 0),
        ((0.3, 0.2), (0.5 * (NARROW + DOUBTED), 0.0), 1),
    ],
    ids=["hardly better", "better", "better at last", "better but doubted", "worse but clear"],
)
def test_a_later_look_counts_where_it_is_not_doubted_and_clear_or_better_by_a_tenth(
    turned, spreads, which, walk, video, monkeypatch
):
    seen = zip((*turned, 0.01, 0.01, 0.01), (*spreads, 0.0, 0.0, 0.0), strict=True)
    looks = (spread(walk.person(turned=t, frame=i), by) for i, (t, by) in enumerate(seen))
    monkeypatch.setattr(found_module, "_before", lambda *_: [next(looks)])
    (found,) = people(video, QUIET)
    assert (found.frame, found.turned) == (which, turned[which])


@pytest.fixture
def grey(walk, tmp_path):
    """The film without colours."""
    return as_video(np.repeat(walk.images.mean(-1, keepdims=True), 3, axis=-1).astype(np.uint8), tmp_path)


def test_a_film_without_colours_is_looked_through_again_where_nobody_is_seen(
    walk, grey, expected, monkeypatch
):
    def before(_, facing, those=None):
        assert those is None
        return [walk.person()] if len(expected) == 6 else []

    monkeypatch.setattr(found_module, "_before", before)
    assert len(people(grey, QUIET)) == 1
    assert expected == [ORDINARY, *AGAIN, FULL_OF_SHADOWS]


@pytest.mark.whole
def test_a_walker_without_colours_is_found(walk, grey):
    (one,) = people(grey, QUIET)
    assert one.facing == 1
    assert np.hypot(*(one.joints - walk.joints[one.frame]).T).mean() < 0.08 * UNIT


def on_the_spot(walk):
    """The same with the hip at rest before a scene at rest."""
    spot, still = walk.on_the_spot(), walk.scene[BORDER:-BORDER, BORDER:-BORDER]
    cover = spot.cover[..., None]
    return np.rint(cover * spot.images + (1.0 - cover) * still).astype(np.uint8)


def test_of_who_walks_on_the_spot_about_the_joints_are_suggested_and_no_limb_is_a_person(walk, tmp_path):
    video = as_video(on_the_spot(walk), tmp_path)
    found = people(video, QUIET)
    assert found == []
    with pytest.raises(FoundError, match="move on the spot, as on a treadmill") as said:
        start_of(found, Following(), video)
    ((frame, marks),) = said.value.suggested.items()
    assert f"frame {frame}" in str(said.value)
    assert abs(marks["hip"].x - walk.hips[MIDDLE, 0]) < 0.4 * UNIT


def test_limbs_of_who_moves_on_the_spot_are_nobody(walk, video, monkeypatch):
    """Those who are as large or go through the scene are, if the camera's path is known; else who goes and is
    as large."""
    one = walk.person()
    hip = one.outline.hips.mean(0)
    stays = replace(one, outline=replace(one.outline, hips=np.tile(hip, (len(walk.q), 1))))

    def left(person, unit):
        monkeypatch.setattr(found_module, "spot", lambda _: Spot(3, hip, unit))
        monkeypatch.setattr(found_module, "_before", lambda *_: [person])
        return people(video, QUIET, stop=FEWEST)

    small, large = 2.2 * UNIT, 1.6 * UNIT  # of the other person
    assert left(replace(stays, direction=0), small) == []
    assert len(left(replace(stays, direction=0), large)) == 1
    assert len(left(stays, small)) == 1
    monkeypatch.setattr(found_module, "MOSTLY", 1.0)  # no camera's path is known well enough
    assert left(stays, small) == []
    assert left(replace(stays, direction=0), large) == []
    assert len(left(stays, large)) == 1


def test_beside_who_goes_through_the_film_nobody_counts_who_stays(walk, video, monkeypatch):
    goes, stays = walk.person(), walk.person(direction=0)
    stays = replace(stays, outline=replace(stays.outline, hips=stays.outline.hips + 3.0 * UNIT))

    def left(*seen):
        monkeypatch.setattr(found_module, "_before", lambda *_: list(seen))
        return [one.direction for one in people(video, QUIET, stop=FEWEST)]

    assert left(stays, goes) == [1]
    assert left(stays) == [0]
    monkeypatch.setattr(found_module, "MOSTLY", 1.0)  # where a camera may go along, either may be the walker
    assert left(stays, goes) == [0, 1]


def test_of_several_scenes_the_first_is_searched_in_which_anybody_walks(walk, tmp_path, capsys):
    empty = 255 - np.repeat(film(np.random.default_rng(3), frames=1, walker=False).images, 25, axis=0)
    (one,) = people(as_video(np.concatenate([empty, walk.images, empty]), tmp_path), Progress("json"))
    assert (one.first, one.last) == (25, 25 + len(walk.q) - 1)
    assert np.hypot(*(one.joints - walk.joints[one.frame - 25]).T).mean() < 0.06 * UNIT
    (note,) = (line for line in capsys.readouterr().err.splitlines() if "note" in line)
    beyond = one.last + 1
    assert f"from frame {beyond} on another scene is shown; 'figtrack track --from {beyond}'" in note


def test_in_fewer_frames_than_tell_the_scene_nobody_is_looked_for(video, monkeypatch):
    monkeypatch.setattr(found_module, "paths", None)
    assert people(video, QUIET, stop=FEWEST - 2) == []


def test_at_a_low_rate_fewer_frames_tell_the_scene(walk, tmp_path):
    assert [fewest(fps) for fps in (60.0, 30.0, 24.0, 15.0, 5.0)] == [FEWEST, FEWEST, 16, LEAST, LEAST]
    (one,) = people(as_video(walk.images[::3], tmp_path, fps=10.0), QUIET)
    assert np.hypot(*(one.joints - walk.joints[3 * one.frame]).T).mean() < 0.1 * UNIT
    with pytest.raises(FoundError, match=f"fewer than {LEAST} frames"):
        start_of([], Following(stop=LEAST - 2), as_video(walk.images[::3], tmp_path, fps=10.0))


@pytest.mark.parametrize("hint", [None, 10, 32])  # joined recordings announce the frames of one
def test_who_comes_after_a_long_empty_part_is_found_in_the_next_one(hint, walk, video, monkeypatch):
    monkeypatch.setattr(video, "count_hint", hint)
    parts = []

    def paths(stage, *rest):
        parts.append(len(stage))
        return ["path"] * (len(parts) - 1)

    monkeypatch.setattr(staged_module, "FEWEST", 12)
    monkeypatch.setattr(found_module, "WINDOW", 16)
    monkeypatch.setattr(found_module, "paths", paths)
    monkeypatch.setattr(found_module, "joined", lambda _, paths: paths)
    monkeypatch.setattr(found_module, "forget_others", lambda *_: None)
    monkeypatch.setattr(found_module, "forget_occluders", lambda *_: None)
    monkeypatch.setattr(found_module, "person", lambda *_, **__: walk.person(frame=5))
    (one,) = people(video, QUIET)
    assert parts == [16, 16]
    assert (one.first, one.frame) == (16, 21)


def test_who_is_found_twice_by_a_further_search_is_one(walk, video, monkeypatch):
    unclear = [walk.shifted(by).person(turned=0.0) for by in (-24, 24)]
    searches = iter([unclear, *([[walk.person(turned=9.0)]] * len(AGAIN))])
    monkeypatch.setattr(found_module, "_before", lambda *_: next(searches))
    monkeypatch.setattr(found_module.Person, "same", lambda one, other: True)
    (one,) = people(video, QUIET)
    assert one.turned == 9.0


def test_of_several_one_must_be_named(walk, video):
    both = [walk.person(frame=12), walk.shifted(44).person(frame=20)]
    with pytest.raises(FoundError, match="2 people walk through the film; name one with --person N") as said:
        start_of(both, Following(), video)
    assert list(said.value.suggested) == [12]
    start = start_of(both, Following(person=2), video)
    assert (start.frame, start.marks["hip"].x) == (20, pytest.approx(both[1].joints[0, 0], abs=0.01))
    with pytest.raises(FoundError, match="there is no person 3; found are 2"):
        start_of(both, Following(person=3), video)


def test_people_of_a_part_have_the_numbers_that_they_have_in_the_film(walk, video):
    one, other, third = walk.person(frame=12), walk.shifted(44).person(frame=20), walk.shifted(88).person()
    for number, frame in ((1, 20), (2, 12)):
        assert start_of([one, other], Following(person=number), video, [other, one]).frame == frame
    with pytest.raises(FoundError, match="person 1 is not seen in that part of the film"):
        start_of([one], Following(person=1), video, [other, one])
    assert start_of([one, other], Following(person=1), video, [third]).frame == 12


def test_a_facing_that_nobody_has_is_said(walk, video, monkeypatch):
    monkeypatch.setattr(found_module, "people", lambda *_: [walk.person()])
    with pytest.raises(FoundError, match="does not face left; leave out --facing"):
        start_of([], Following(facing="left"), video)
    monkeypatch.setattr(found_module, "people", lambda *_: [])
    with pytest.raises(FoundError, match=r"^nobody"):
        start_of([], Following(facing="left"), video)


def bent(one):
    """The person in a pose that no body has."""
    joints = one.outline.joints.copy()
    joints[:, WALKER.joints.index("near_ankle")] += (0.0, 60.0)
    return replace(one, outline=replace(one.outline, joints=joints))


@pytest.mark.parametrize(
    ("doubted", "said"),
    [
        (lambda one: replace(one, turned=0.9 * TURNED), "not sure which way the figure faces in frame 16"),
        (bent, "pose found in frame 16 may be wrong: .*; mark its joints"),
        (lambda one: spread(one, 1.1 * DOUBTED), "found in frame 16 may be wrong: much that stands out"),
    ],
    ids=["facing", "pose", "outline"],
)
def test_who_is_doubted_is_no_start(doubted, said, walk, video):
    with pytest.raises(FoundError, match=said) as caught:
        start_of([doubted(walk.person())], Following(), video)
    assert caught.value.suggested[MIDDLE].keys() == set(WALKER.joints)


def test_who_is_just_sure_enough_is_a_start(walk, video):
    start = start_of([spread(walk.person(turned=1.1 * TURNED), 0.9 * DOUBTED)], Following(), video)
    assert (start.frame, start.facing, start.against) == (MIDDLE, 1, False)

    given = [replace(walk.person(turned=turned), given=True) for turned in (0.0, -TURNED)]
    assert [start_of([one], Following(), video).against for one in given] == [False, True]


def test_the_nearer_leg_may_be_given(walk, video):
    one = walk.person(named=1.0)
    seen = start_of([one], Following(), video)
    same = start_of([one], Following(near=nearer(one)), video)
    other = start_of([one], Following(near=nearer(one).other), video)
    assert (seen.near_leg, same.near_leg, other.near_leg) == ("unsure", "given", "given")
    assert (seen.nearer, same.nearer, other.nearer) == (nearer(one), nearer(one), nearer(one).other)
    assert seen.marks == same.marks
    assert other.marks["near_knee"] == seen.marks["far_knee"]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("frame", [2, 8, 17])
def test_the_leg_ahead_is_the_one_further_on_where_the_figure_faces(mirrored, frame, walk):
    one = (walk.mirrored() if mirrored else walk).person(frame=frame)
    hip, near, far = (one.joints[WALKER.joints.index(name), 0] for name in ("hip", "near_ankle", "far_ankle"))
    ahead = one.facing * (near - hip) > one.facing * (far - hip)
    assert nearer(one) is (Nearer.AHEAD if ahead else Nearer.BEHIND)
    assert nearer(one.exchanged) is nearer(one).other
