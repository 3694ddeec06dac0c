"""Scores: every number as the scoring tool gives it, and what counts as lost, swapped or untracked."""

import numpy as np
import pytest

from kinematics.figure import Figure, Link
from kinematics.sides import other_side
from tests.kinematics.figures import WALKER, Puppet
from tests.tracker.records import validator
from tests.tracker.tracks import random_track
from tracker.run.score import leg_length, places, score
from tracker.tables.keypoints import KEYPOINTS, Mark

# A leg of 100 px on each side, hanging straight.
STANDING = {
    "head_top": (0.0, -90.0),
    "neck": (0.0, -60.0),
    "hip": (0.0, 0.0),
    "near_knee": (10.0, 50.0),
    "near_ankle": (10.0, 99.0),
    "far_knee": (-10.0, 50.0),
    "far_ankle": (-10.0, 99.0),
}
LEG = float(np.hypot(10.0, 50.0)) + 49.0


def marks(frames, pose=STANDING, hidden=()):
    return {t: {name: Mark(x, y, name not in hidden) for name, (x, y) in pose.items()} for t in frames}


def off_by(error):
    """Every joint this many leg lengths aside."""
    return {name: (x + error * LEG, y) for name, (x, y) in STANDING.items()}


def exchanged(pose=STANDING):
    """The legs' names exchanged."""
    return {name: pose[other_side(name)] for name in pose}


def random_case(rng):
    """Marks in some frames and of some joints, and a track that drifts, swaps legs or stops."""
    frames = sorted(rng.choice(60, size=rng.integers(2, 14), replace=False).tolist())
    truth, found = {}, {}
    drift = rng.choice([0.0, 2.0, 12.0])
    for t in range(frames[0], frames[-1] + 1):
        pose = {name: np.array(STANDING.get(name, (0.0, 110.0))) + rng.normal(size=2) for name in KEYPOINTS}
        if t in frames:
            # The first and the last frame are marked whole: the leg is measured there.
            whole = t in (frames[0], frames[-1])
            left_out = set() if whole else set(rng.choice(KEYPOINTS, size=rng.integers(0, 4)))
            truth[t] = {
                name: Mark(float(x), float(y), bool(rng.random() < 0.7))
                for name, (x, y) in pose.items()
                if name not in left_out - {"hip"}
            }
        swap = exchanged({name: pose[name] for name in STANDING}) if rng.random() < 0.3 else pose
        if rng.random() < 0.9:
            found[t] = {
                name: tuple((at + rng.normal(scale=6.0, size=2) + drift * (t - frames[0])).tolist())
                for name, at in swap.items()
                if rng.random() < 0.95
            }
    return truth, found, frames[0]


@pytest.mark.filterwarnings("ignore:Mean of empty slice")  # the tool's, of a side that no frame shows
@pytest.mark.filterwarnings("ignore:invalid value encountered")
def test_every_number_is_the_scoring_tool_s(rng):
    tool, told = validator("score_tracks.py"), []
    for _ in range(150):
        truth, found, start = random_case(rng)
        start += int(rng.integers(0, 2)) * (sorted(truth)[-2] - start)  # sometimes from a later frame
        ours = score(truth, found, start).summary()
        theirs = tool.score(
            {t: {name: (m.x, m.y, int(m.visible)) for name, m in of.items()} for t, of in truth.items()},
            found,
            start,
        )
        followed = ours.pop("frames_followed")
        assert ours == {name: theirs[name] for name in ours}
        failure = theirs["first_failure_frame"]
        assert followed == sum(start < t and (failure is None or t < failure) for t in truth)
        told.append(ours)
    # The cases do reach what there is to tell apart.
    assert {case["first_failure_frame"] is None for case in told} == {True, False}
    assert {case["angle_median_deg"] is None for case in told} >= {False}
    assert max(case["swaps"] for case in told) > 1


LOST = {
    "never bad": ("....", None),
    "one bad frame": (".X..", None),
    "two bad, recovered in the third": (".XX.", None),
    "three bad": (".XXX", 2),
    "three bad, then recovered": ("XXX.", 1),
    "the last two bad, no third to recover in": ("..XX", 3),
    "the last bad alone": ("...X", None),
    "two bad twice": ("XX.XX", 4),
    "every other": ("X.X.X", None),
}


@pytest.mark.parametrize("name", LOST)
def test_lost_is_two_bad_frames_in_a_row_not_recovered_in_a_third(name):
    pattern, failure = LOST[name]
    found = {t + 1: off_by(0.26 if mark == "X" else 0.24) for t, mark in enumerate(pattern)}
    result = score(marks(range(len(pattern) + 1)), found, 0)
    assert result.first_failure_frame == failure
    assert result.truth_frames == len(pattern)
    assert result.frames_followed == (len(pattern) if failure is None else failure - 1)


def test_errors_are_shares_of_the_leg_and_the_start_frame_is_not_scored():
    result = score(marks([3, 9, 5]), {3: off_by(0.9), 5: off_by(0.1), 9: off_by(0.15)}, 3)
    assert list(result.frame_errors) == [5, 9]  # they run in time
    assert result.frame_errors == pytest.approx({5: 0.1, 9: 0.15})
    assert result.mean_error_leg == pytest.approx(0.125)
    assert result.pck_02_leg == 1.0


def test_an_error_counts_one_leg_at_most_and_so_does_a_joint_that_was_not_tracked():
    found = {1: {name: at for name, at in STANDING.items() if name != "head_top"}, 2: off_by(40.0)}
    result = score(marks(range(4)), found, 0)
    assert result.frame_errors == pytest.approx({1: 1 / len(WALKER.scored), 2: 1.0, 3: 1.0})


def test_medians_and_shares_are_over_joints_not_over_frames():
    near = STANDING | {name: off_by(0.19)[name] for name in ("hip", "neck")}
    far = STANDING | {name: off_by(0.21)[name] for name in WALKER.scored if name != "hip"}
    result = score(marks(range(3)), {1: near, 2: far}, 0)
    # Of 14 joints: six at 0 (five in the first frame, one in the second), two at 0.19, six at 0.21.
    assert result.median_error_leg == pytest.approx(0.19)
    assert result.pck_02_leg == pytest.approx(8 / 14)


def test_toes_do_not_count():
    truth = marks(range(2), STANDING | {"near_toe": (30.0, 105.0)})
    assert score(truth, {1: STANDING | {"near_toe": (500.0, 500.0)}}, 0).mean_error_leg == 0.0


def test_the_leg_is_the_mean_of_both_in_the_first_frame_that_shows_one_whole():
    pose = STANDING | {"far_knee": (0.0, 60.0), "far_ankle": (0.0, 140.0)}
    truth = marks([1, 2], pose)
    truth[0] = {"hip": Mark(0.0, 0.0), "near_knee": Mark(0.0, 400.0)}
    found = {t: {name: (x + 10.0, y) for name, (x, y) in pose.items()} for t in (1, 2)}
    assert score(truth, found, 0).frame_errors[2] == pytest.approx(10.0 / (0.5 * (LEG + 140.0)))


def test_a_swap_is_a_frame_whose_legs_fit_better_exchanged():
    apart = STANDING | {"near_knee": (40.0, 40.0), "far_knee": (-40.0, 40.0)}
    found = {1: exchanged(apart), 2: apart, 3: exchanged(apart)}
    assert score(marks(range(4), apart), found, 0).swaps == 2


def test_legs_that_lie_together_are_never_swapped():
    # Exchanged they fit better by 20 px a joint, 0.2 leg; a third as far apart by less than 0.1.
    close = {name: (x / 3.0, y) for name, (x, y) in STANDING.items()}
    found = {1: exchanged(close)}
    assert score(marks(range(2), close), found, 0).swaps == 0
    assert score(marks(range(2)), {1: exchanged()}, 0).swaps == 1


def test_link_directions_are_judged_where_the_link_was_seen_either_way():
    turned = STANDING | {"near_ankle": (59.0, 50.0)}  # the near shank a quarter turn off
    assert score(marks(range(2)), {1: turned}, 0).angle_median_deg == pytest.approx(0.0)
    hidden = ("near_knee", "far_knee", "far_ankle")
    assert score(marks(range(2), hidden=hidden), {1: turned}, 0).angle_median_deg is None
    other_way = STANDING | {"near_ankle": (-39.0, 50.0)}
    for covered, found in (((), turned), (("hip",), turned), ((), other_way)):  # cloth covers any hip
        seen = score(marks(range(2), hidden=("far_knee", "far_ankle", *covered)), {1: found}, 0)
        assert seen.angle_median_deg == pytest.approx(45.0)  # of thigh 0 and shank 90


def test_every_frame_after_a_start_that_the_truth_has_not_counts():
    turned = STANDING | {"near_ankle": (59.0, 50.0)}
    found = {1: turned, 2: STANDING}
    assert score(marks(range(1, 3)), found, 0).truth_frames == 2
    assert score(marks(range(3)), {0: STANDING} | found, 0).truth_frames == 2


def test_a_truth_without_later_frames_or_whole_legs_is_refused():
    with pytest.raises(ValueError, match="no frame after frame 4"):
        score(marks([1, 4]), {}, 4)
    with pytest.raises(ValueError, match="no whole leg"):
        score(marks([1, 4], {"hip": (0.0, 0.0), "near_knee": (0.0, 50.0)}), {}, 1)
    toes = {"near_toe": (0.0, 0.0), "far_toe": (5.0, 0.0)}
    with pytest.raises(ValueError, match=r"the truth marks none of head_top, .* after frame 1; mark some"):
        score(marks([1]) | marks([4], toes), {}, 1)


def dog(at):
    """A figure whose legs hang on its trunk at this share of it."""

    def link(name, joint, length, **more):
        return Link(name, joint, length, width=0.1, rest=0.0, limits=(-1.0, 1.0), **more)

    legs = [
        link(f"{part}_{side}", f"{side}_{joint}", 0.5, parent=parent, at=start)
        for side in ("near", "far")
        for part, joint, parent, start in (
            ("thigh", "knee", "trunk", at),
            ("shank", "ankle", f"thigh_{side}", 1.0),
        )
    ]
    joints = tuple(leg.joint for leg in legs)
    marks = ("rump", "withers", *joints)
    trunk = link("trunk", "withers", 2.0)
    return Figure("dog", "rump", (trunk, *legs), leg=("thigh", "shank"), marks=marks, scored=marks)


@pytest.mark.parametrize("at", [0.0, 0.25, 1.0])
def test_a_leg_begins_where_it_hangs_on_its_parent(at):
    hip, sides = 200.0 * at, ("near", "far")
    pose = {"rump": (0.0, 0.0), "withers": (200.0, 0.0)}
    pose |= {f"{side}_{joint}": (hip, y) for side in sides for joint, y in (("knee", 50.0), ("ankle", 100.0))}
    truth = marks([0, 1], pose)
    assert leg_length(truth, [0], dog(at)) == pytest.approx(100.0)
    lower = score(truth, {1: {name: (x, y + 20.0) for name, (x, y) in pose.items()}}, 0, dog(at))
    assert lower.mean_error_leg == pytest.approx(0.2)
    assert lower.link_errors == pytest.approx([0.0] * 4)
    bent = score(truth, {1: pose | {f"{side}_ankle": (hip + 50.0, 50.0) for side in sides}}, 0, dog(at))
    assert sorted(bent.link_errors) == pytest.approx([0.0, 0.0, 90.0, 90.0])


def test_places_are_the_joints_of_each_frame_from_the_first(rng):
    track = random_track(rng, T=3, first=7, facing=-1)
    found = places(track)
    assert list(found) == [7, 8, 9]
    for t, of_frame in found.items():
        body = Puppet(WALKER, track.q[t - 7]).joints()
        right, down, zoom = track.moved[t - 7]
        for name, (x, y) in of_frame.items():
            assert x == pytest.approx(150.0 + right - zoom * 70.0 * body[name][0], abs=1e-9)
            assert y == pytest.approx(110.0 + down - zoom * 70.0 * body[name][1], abs=1e-9)
