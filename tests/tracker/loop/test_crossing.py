"""Legs that pass each other: names that the motion speaks against are exchanged."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.motion.tasks import synthesise
from kinematics.recover import start_pose
from kinematics.spm import joints
from tests.kinematics.figures import WALKER
from tests.tracker.painted import FULL, VIEW
from tracker.loop.begin import begin
from tracker.loop.crossing import (
    AFTER,
    BEFORE,
    BELIEVED,
    LONGEST,
    SHORT,
    TOGETHER,
    Crossing,
    _exchanged,
    _named,
    _without_legs,
)
from tracker.loop.detections import Likelihood
from tracker.loop.tracker import make_tracker
from tracker.models.find import find_model, switching_model
from tracker.motion.tasks import of_motion

SPREAD = 0.03  # of what a frame tells: radians or leg lengths
D = len(WALKER.freedoms)
PAIRS = [(link, twin) for link, twin in WALKER.twins.items() if link < twin and WALKER.links[link].breathes]
BLANK = np.full((190, 190, 3), 90, np.uint8)


def gap(q):
    """How far knees or ankles, whichever are further, are from each other."""
    places = joints(WALKER, q)
    return max(np.hypot(*(places[link + 1] - places[twin + 1])) for link, twin in PAIRS)


@pytest.fixture(scope="module")
def walk():
    """(T, D) poses of a walk whose legs first meet some frames on."""
    made = synthesise(of_motion(switching_model("gait", 30.0), "walk"), 90, np.random.default_rng(2))[1]
    apart = np.array([gap(np.pad(row, (0, D - len(row)))) for row in made])
    # From where they are furthest apart.
    made = made[20 + int(apart[20:40].argmax()) :]
    made[:, :2] -= made[0, :2]
    return np.hstack([made, np.zeros((len(made), D - made.shape[1]))])


@pytest.fixture(scope="module")
def meeting(walk):
    return next(t for t, q in enumerate(walk) if gap(q) < TOGETHER)


@pytest.fixture(scope="module")
def tracker(walk):
    return tracker_from(walk[0])


def tracker_from(q):
    """A tracker, and the start that a pose (D,) makes when it is marked."""
    pixels = VIEW.to_pixels(joints(WALKER, q))
    start = start_pose(WALKER, dict(zip(WALKER.joints, map(tuple, pixels), strict=True)), VIEW.facing)
    return make_tracker(start, find_model("walk-run", 30.0, FULL), FULL), start


def told(q):
    return Likelihood(q[None], np.eye(D)[None] / SPREAD**2, q[None] / SPREAD**2, np.zeros(1))


def exchanged(q):
    """The pose with the legs' names exchanged, from the names of its freedoms."""
    other = {"near": "far", "far": "near"}
    names = [
        name.replace(side, other[side]) if (side := name.rsplit("_", 1)[-1]) in other else name
        for name in WALKER.freedoms
    ]
    return q[[WALKER.freedoms.index(name) for name in names]]


def watched(tracker, start, seen, marked=False):
    """Estimates of a run in which each frame tells one of the poses `seen`, through a `Crossing`.

    It begins as at the marks of the start frame, if that is so, else with nothing known of the legs.
    """
    state, first = begin(tracker, start, BLANK)
    crossing = Crossing.at_marks(WALKER, state, first) if marked else Crossing()
    found = [first]
    for q in seen:
        before, proposed = state, tracker.proposed(state.belief)
        belief = tracker.conditioned(proposed, tracker.pose(proposed.states), told(q))
        belief = replace(belief, cost=belief.cost - belief.cost.min())
        state = replace(state, belief=belief)
        estimate = replace(
            first, pose=tracker.pose(belief.merged()), belief=belief, told=told(q), began=False
        )
        crossing, state, estimate = crossing.followed(tracker, before, state, estimate)
        if estimate.instead:
            found[-len(estimate.instead) :] = estimate.instead
        found.append(estimate)
        assert state.belief is estimate.belief
    return found


def leg_errors(found, walk):
    """(T,) how far the legs' angles are off at most, radians."""
    legs = WALKER.exchanged != np.arange(D)
    legs[WALKER.index("scale") :] = False
    return np.array([np.abs(e.pose.mean - q)[legs].max() for e, q in zip(found, walk, strict=True)])


def test_every_freedom_has_its_twin():
    names = np.array(WALKER.freedoms)
    assert_array_equal(names[WALKER.exchanged], exchanged(names))


def test_legs_that_pass_as_people_walk_keep_their_names(tracker, walk, meeting):
    found = watched(*tracker, walk[1 : meeting + AFTER + 12])
    assert not any(e.instead for e in found)
    assert leg_errors(found, walk[: len(found)]).max() < 0.15


@pytest.mark.parametrize("late", [0, 1])
def test_legs_that_came_out_of_a_crossing_with_exchanged_names_get_their_own(tracker, walk, meeting, late):
    wrong = walk[: meeting + AFTER + 8].copy()
    for t in range(meeting + late, len(wrong)):
        wrong[t] = exchanged(wrong[t])
    found = watched(*tracker, wrong[1:])
    ((when, mended),) = [(t, e) for t, e in enumerate(found) if e.instead]
    assert when - len(mended.instead) == meeting
    errors = leg_errors(found[: when + 1], walk[: when + 1])
    # While they are together the motion alone speaks of them.
    assert errors.max() < 0.35
    assert errors[-1] < 0.1


def test_nobody_knows_how_legs_moved_that_met_at_once(tracker, walk, meeting):
    first = meeting - BEFORE + 1
    wrong = walk[first : meeting + AFTER + 8].copy()
    wrong[meeting - first :] = [exchanged(q) for q in wrong[meeting - first :]]
    assert not any(e.instead for e in watched(*tracker, wrong))


@pytest.mark.parametrize(
    ("together", "worse", "kept"),
    [(3, BELIEVED + 1.0, True), (3, BELIEVED - 1.0, False), (SHORT, 1.0, True), (SHORT, -1.0, False)],
)
def test_names_as_tracked_must_be_well_the_more_likely_after_a_short_crossing(
    monkeypatch, tracker, walk, together, worse, kept
):
    state, first = begin(*tracker, BLANK)
    frames = [replace(first, told=told(walk[0]))] * (together + AFTER)
    costs = iter([0.0, 0.0, worse])  # of the bridge, as tracked, exchanged
    monkeypatch.setattr(
        "tracker.loop.crossing._path", lambda _, belief, seen: ([belief] * len(seen), next(costs))
    )
    _, last = _named(tracker[0], state, frames, together, state)
    assert (last is frames[-1]) == kept
    assert bool(last.instead) != kept


def here(walk):
    """The poses with the first one's root in the middle of the picture."""
    return walk - np.r_[walk[0, :2], np.zeros(D - 2)]


@pytest.mark.parametrize("early", [1, 2])
def test_marks_tell_how_legs_move_that_meet_at_once(walk, meeting, early):
    right = here(walk[meeting - early : meeting + AFTER + 8])
    wrong = np.array([*right[:early], *(exchanged(q) for q in right[early:])])
    found = watched(*tracker_from(right[0]), wrong[1:], marked=True)
    ((when, mended),) = [(t, e) for t, e in enumerate(found) if e.instead]
    assert when - len(mended.instead) == early
    assert leg_errors(found, right)[when] < 0.1


def test_marks_tell_which_leg_is_which_where_they_are_together(walk, meeting):
    right = here(walk[meeting : meeting + AFTER + 12])
    wrong = np.array([right[0], *(exchanged(q) for q in right[1:])])
    begun = tracker_from(right[0])
    found = watched(*begun, wrong[1:], marked=True)
    ((when, mended),) = [(t, e) for t, e in enumerate(found) if e.instead]
    assert when - len(mended.instead) == 1
    assert leg_errors(found, right)[when] < 0.1
    assert not any(e.instead for e in watched(*begun, right[1:], marked=True))


def test_of_lower_legs_that_are_not_marked_the_marks_tell_nothing(walk, meeting):
    tracker, start = tracker_from(here(walk[meeting:])[0])
    state, first = begin(tracker, start, BLANK)
    assert Crossing.at_marks(WALKER, state, first) == Crossing(before=state)
    shanks = [i for i, link in enumerate(WALKER.links) if link.name.startswith("shank")]
    unknown = replace(state.templates, known=state.templates.known & ~np.isin(state.templates.link, shanks))
    assert Crossing.at_marks(WALKER, replace(state, templates=unknown), first) == Crossing()


def test_a_frame_that_tells_nothing_ends_a_crossing_and_so_does_a_very_long_one(tracker, walk):
    state, estimate = begin(*tracker, BLANK)
    begun = Crossing(state, (estimate,), 1)
    for crossing in (begun, replace(begun, frames=(estimate,) * LONGEST)):
        given = replace(estimate, told=None if len(crossing.frames) == 1 else told(walk[0]))
        after, kept, same = crossing.followed(tracker[0], state, state, given)
        assert after == Crossing()
        assert kept is state
        assert same is given


def test_what_is_left_without_the_legs_is_what_their_every_pose_allows(rng):
    root = rng.normal(size=(D, D))
    cov, mean = root @ root.T + 0.1 * np.eye(D), rng.normal(size=D)
    L = np.linalg.inv(cov)
    given = Likelihood(mean[None], L[None], (L @ mean)[None], np.zeros(1))
    left = _without_legs(WALKER, given)
    rest = np.flatnonzero(WALKER.exchanged == np.arange(D))
    legs = np.flatnonzero(WALKER.exchanged != np.arange(D))
    # A Gaussian's marginal has the covariance's own block.
    assert_allclose(
        np.linalg.inv(left.information[0][np.ix_(rest, rest)]), cov[np.ix_(rest, rest)], rtol=1e-6
    )
    assert_allclose(left.information[0][np.ix_(rest, rest)] @ mean[rest], left.vector[0, rest], rtol=1e-6)
    assert not left.information[0][legs].any()
    assert not left.information[0][:, legs].any()
    assert not left.vector[0, legs].any()


def test_what_is_told_of_a_hidden_leg_is_nothing_and_costs_nothing(rng):
    root = rng.normal(size=(D, 3))
    root[WALKER.exchanged != np.arange(D)] = 0.0
    L = root @ root.T
    given = Likelihood(np.zeros((1, D)), L[None], (L @ np.ones(D))[None], np.zeros(1))
    left = _without_legs(WALKER, given)
    assert_allclose(left.information, given.information, atol=1e-12)
    assert_allclose(left.vector, given.vector, atol=1e-12)


def test_exchanged_twice_is_as_it_was_and_once_is_the_other_leg(walk):
    given = told(walk[3])
    assert_allclose(_exchanged(WALKER, given).q[0], exchanged(walk[3]))
    twice = _exchanged(WALKER, _exchanged(WALKER, given))
    for one, other in zip(vars(twice).values(), vars(given).values(), strict=True):
        assert_array_equal(one, other)
