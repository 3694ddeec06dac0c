"""The figure as the page draws it: every number is the overlay's own, for every frame."""

import tracemalloc
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.kinematics.figures import ARMS, HORSE, WALKER
from tests.tracker.strolls import stroll
from tests.tracker.tracks import random_track
from tracker.report.document import as_json
from tracker.report.drawing import figure_numbers as in_tenths
from tracker.report.drawing import segments
from videos.overlay import FARTHEST

TENTH = 0.05 + 1e-9


def figure_numbers(track):
    """The same in pixels and degrees."""
    told = in_tenths(track)
    return told | {name: np.array(told[name]) / 10.0 for name in ("points", "ellipses", "centre")}


@pytest.fixture(params=[WALKER, HORSE, ARMS], ids=lambda figure: figure.name)
def track(request, rng):
    made = random_track(rng, 5, figure=request.param)
    return replace(made, cov=30.0 * made.cov)


def test_links_lie_as_the_overlay_draws_them_in_its_order_and_colours(track):
    told = figure_numbers(track)
    links = [(limb["color"], *link) for limb in told["limbs"] for link in limb["links"]]
    colours = [limb["color"] for limb in told["limbs"]]
    assert all(a != b for a, b in pairwise(colours))
    for t in range(len(track)):
        points = np.reshape(told["points"][t], (-1, 2))
        drawn = segments(track.figure, track.q[t], track.view_at(t))
        for (colour, start, link), segment in zip(links, drawn, strict=True):
            assert_allclose(points[start], segment.start, atol=TENTH)
            assert_allclose(points[1 + link], segment.end, atol=TENTH)
            assert tuple(bytes.fromhex(colour[1:])) == segment.color
            assert told["width"] == pytest.approx(segment.width / track.moved[t, 2], abs=0.006)


def test_ellipses_hold_what_is_two_sigma_from_each_joint(track):
    told = figure_numbers(track)
    circle = np.stack([np.cos(turns := np.linspace(0.0, 6.0, 7)), np.sin(turns)])
    for t in range(len(track)):
        for cov, (long, short, degrees) in zip(
            track.joint_covs()[t, 1:], np.reshape(told["ellipses"][t], (-1, 3)), strict=True
        ):
            assert long >= short
            c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
            around = np.array([[c, -s], [s, c]]) @ (np.array([[long], [short]]) * circle)
            distance = np.sqrt(np.einsum("in,in->n", around, np.linalg.solve(cov, around)))
            assert_allclose(distance, 2.0, rtol=0.12 / short + 0.01)


def test_the_view_follows_the_base_and_holds_the_joints():
    track = stroll(4.0)
    told = figure_numbers(track)
    centre, points = np.array(told["centre"]), np.reshape(told["points"], (len(track), -1, 2))
    assert_allclose(centre, points[:, 0], atol=2.0)
    away = np.abs(points - centre[:, None]).max(axis=1)
    assert (away <= told["reach"]).mean(axis=0) == pytest.approx(0.9, abs=0.06)


def test_where_the_figure_was_lost_the_view_goes_straight_on():
    track = stroll(4.0)
    q = track.q.copy()
    q[50:60, 0] += 30.0
    outcome = tuple("lost" if 50 <= t < 60 else "ok" for t in range(len(track)))
    told = [figure_numbers(each) for each in (track, replace(track, q=q, outcome=outcome))]
    assert_allclose(told[1]["centre"], told[0]["centre"], atol=1.0)
    assert_allclose(told[1]["reach"], told[0]["reach"], rtol=0.1)


def test_the_view_of_a_track_that_saw_nothing_goes_where_it_says():
    track = stroll(1.0)
    told = figure_numbers(replace(track, outcome=("lost",) * len(track)))
    assert_allclose(np.array(told["centre"])[0], track.joints()[0, 0], atol=0.1)


def test_numbers_of_twenty_minutes_stay_small(rng):
    frames, some = 36_000, 300
    track = random_track(rng, some, figure=WALKER)
    track = replace(track, view=replace(track.view, origin=(1234.5, 2345.6)))
    assert len(as_json(in_tenths(track))) * frames / some < 9e6


def test_making_numbers_takes_little_more_memory_than_they_do(rng):
    few, many = 1000, 3000

    def peak(frames):
        track = random_track(rng, frames)
        tracemalloc.start()
        try:
            in_tenths(track)
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    assert peak(many) - peak(few) < 300 * (many - few)


def test_what_is_far_away_is_a_number_all_the_same(track):
    q = track.q.copy()
    q[2, :2] = 1e9
    far = replace(track, q=q)
    as_json(in_tenths(far))
    assert np.abs(figure_numbers(far)["points"][2]).max() <= FARTHEST
