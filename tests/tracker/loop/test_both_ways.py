"""Two ways between anchors made one: averaged where they agree, joined where one was lost."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.gaussian import Gaussian
from kinematics.figure import SCALE
from kinematics.spm import UNMOVED, View
from tests.kinematics.figures import WALKER, upright
from tests.oracles import assert_gaussian, mixture
from tests.tracker.painted import STRIDE
from tracker.loop import both_ways as passage_module
from tracker.loop.both_ways import Passage, between_anchors, prolong
from tracker.loop.estimate import NOTHING, Estimate
from tracker.loop.outcome import Outcome
from tracker.loop.trail import Trail
from tracker.registration.modes import mode_of
from tracker.settings import Settings

TRACKER = SimpleNamespace(figure=WALKER, view=View((150.0, 110.0), 80.0, 1))
D = len(WALKER.freedoms)


def estimate(x=0.0, cost=1.0, outcome=Outcome.OK, spread=1.0, began=False, moved=UNMOVED):
    pose = Gaussian(STRIDE + upright(WALKER, root_x=x), spread * np.eye(D))
    return Estimate(pose, 0, outcome, NOTHING, moved=np.array(moved), misfit=cost, began=began)


def places(estimates):
    return [e.pose.mean[0] for e in estimates]


def test_the_way_whose_pictures_cost_less_counts_more():
    (found,) = between_anchors(TRACKER, [estimate(0.0, cost=3.0)], [estimate(0.1, cost=1.0)])
    assert places([found])[0] == pytest.approx(0.075)


def test_an_average_speaks_as_the_nearer():
    found = between_anchors(TRACKER, [estimate(outcome=Outcome.HIDDEN)] * 3, [estimate()] * 3)
    assert [e.outcome for e in found][::2] == [Outcome.HIDDEN, Outcome.OK]


def test_an_average_has_the_moments_of_the_mixture_of_the_two():
    ways = [[estimate(0.0, spread=0.001)] * 3, [estimate(0.2, spread=0.004)] * 3]
    means, covs = zip(*((way[0].pose.mean, way[0].pose.cov) for way in ways), strict=True)
    for k, found in enumerate(between_anchors(TRACKER, *ways), start=1):
        assert_gaussian(found.pose, mixture((1.0 - k / 4, k / 4), means, covs), atol=1e-12)


def test_ways_that_see_the_figure_in_the_same_pixels_agree_wherever_they_have_the_scene():
    there = estimate(0.1, moved=(10.0, 10.0, 1.25))
    back = estimate((0.1 * 1.25 * 80.0 - 1.6) / 80.0, moved=(11.6, 8.4, 1.0))
    back.pose.mean[1] = 1.25 * there.pose.mean[1] - 1.6 / 80.0
    back.pose.mean[WALKER.index(SCALE)] += np.log(1.25)
    for found in between_anchors(TRACKER, [there] * 9, [back] * 9):
        pixels = found.moved[:2] + found.moved[2] * TRACKER.view.axes * found.pose.mean[:2]
        assert_allclose(pixels, (10.0, 10.0) + 1.25 * TRACKER.view.axes * there.pose.mean[:2])
        assert_allclose(found.pose.mean[2:], there.pose.mean[2:], atol=1e-12)
        assert_allclose(found.pose.cov, there.pose.cov)


def test_where_one_way_was_lost_they_are_joined_where_that_costs_least():
    there = [estimate(0.0, 1.0), estimate(0.0, 1.0), estimate(2.0, 9.0), estimate(2.0, 9.0)]
    back = [estimate(0.1, 5.0), estimate(0.1, 1.5), estimate(0.1, 1.0), estimate(0.1, 1.0)]
    assert places(between_anchors(TRACKER, there, back)) == [0.0, 0.0, 0.1, 0.1]


def test_a_way_that_left_the_picture_fits_nothing_perfectly():
    there = [estimate(0.0, 0.4), *[estimate(2.0, 0.0, outcome=Outcome.OUTSIDE)] * 3]
    back = [estimate(0.1, 0.4)] * 4
    assert places(between_anchors(TRACKER, there, back))[1:] == [0.1, 0.1, 0.1]
    near = [estimate(0.05, 0.0, outcome=Outcome.OUTSIDE)] * 4
    assert places(between_anchors(TRACKER, near, back)) == pytest.approx([0.06, 0.07, 0.08, 0.09])


def lost_after(good, off, misfit):
    """Twenty frames of a pass that is lost after some, and drifts from there on."""
    drift = off * np.maximum(np.arange(1, 21) - good, 0)
    return [
        estimate(x, misfit if x else 0.5 * misfit, outcome=Outcome.LOST if x else Outcome.OK)
        for x in drift.tolist()
    ]


def test_where_both_ways_are_lost_each_is_taken_half_of_the_way():
    there, back = lost_after(4, 0.06, 3.0), lost_after(4, -0.06, 3.0)[::-1]
    assert np.abs(places(between_anchors(TRACKER, there, back))).max() == pytest.approx(6 * 0.06)


def test_of_two_ways_without_pictures_the_one_that_was_lost_is_not_taken():
    found, lost = lost_after(20, 0.0, 0.0), [estimate(0.5, 0.0, outcome=Outcome.LOST)] * 20
    assert places(between_anchors(TRACKER, found, lost)) == [0.0] * 20
    assert places(between_anchors(TRACKER, lost, found)) == [0.0] * 20


def test_between_two_frames_in_a_row_there_is_nothing_to_join():
    assert not between_anchors(TRACKER, [], [])


def picture(number):
    return np.full((1, 1), number)


def followed(step, numbers):
    """Estimates of pictures without anchors."""
    passage = Passage(SimpleNamespace(step=step), other=None, anchors={}, way=1, span=None, smooth=None)
    first, *images = map(picture, numbers)
    return list(passage.run(0, 0, estimate(0), first, images))


def test_where_a_picture_repeats_nothing_has_moved_unless_it_stays_for_long():
    raw = followed(lambda state, *_: (state + 1, estimate(state + 1)), [0, 1, 1, 2, 3, 3, 3, 3, 3, 3, 3])
    assert places(raw) == [0, 1, 1, 2, 3, 3, 3, 3, 3, 4, 5]
    assert [each.repeats for each in raw] == [False] * 2 + [True] + [False] * 2 + [True] * 4 + [False] * 2


def test_who_is_found_again_is_so_once_though_the_picture_repeats():
    again = estimate(outcome=Outcome.FOUND)
    raw = followed(lambda state, *_: (state, again), [0, 1, 1, 1])
    assert [each.outcome for each in raw[1:]] == [Outcome.FOUND, Outcome.OK, Outcome.OK]


@pytest.mark.parametrize("way", [1, -1])
def test_every_stretch_between_anchors_is_followed_back_too(way, monkeypatch):
    """Anchors at 0, 3 and 7 from the start; a frame's place is its number, 100 more on the way back."""
    seen = []

    def following(offset):
        return SimpleNamespace(
            **vars(TRACKER),
            settings=Settings(),
            mode=mode_of(Settings()),
            step=lambda state, image, _, place: (state, estimate(place[0, 2] + offset, cost=1.0)),
        )

    def anchored(tracker, state, anchor, image, place):
        assert place[0, 2] == image.item()
        seen.append(anchor)
        return state, estimate(image.item())

    monkeypatch.setattr(passage_module, "passed", anchored)
    monkeypatch.setattr(
        passage_module, "anew", lambda tracker, state, anchor, image: (state, estimate(image.item()))
    )
    monkeypatch.setattr(passage_module, "FAR", 1000.0)
    start = 10
    frames = [start + way * t for t in range(10)]
    passage = Passage(
        tracker=following(0.0),
        other=lambda: following(100.0),
        anchors={frames[t]: f"anchor {t}" for t in (0, 3, 7)},
        way=way,
        span=lambda first, last: map(picture, range(first, last - way, -way)),
        smooth=lambda _, estimates: list(estimates),
        places={frame: np.array([[1.0, 0.0, frame]]) for frame in frames},
    )
    first, *images = map(picture, frames)
    raw = list(passage.run(start, SimpleNamespace(), estimate(start), first, images))
    assert places(raw) == frames
    trail = Trail(D)
    for each in raw:
        prolong(passage.tracker, trail, each)
    extra = trail.column("mean")[:, 0] - frames
    # Shares of the way back: a third and two thirds of 100, then quarters; nothing after the last anchor.
    assert_allclose(extra, [0, 100 / 3, 200 / 3, 0, 25, 50, 75, 0, 0, 0], atol=1e-9)
    assert seen == ["anchor 3", "anchor 0", "anchor 7", "anchor 3"]
