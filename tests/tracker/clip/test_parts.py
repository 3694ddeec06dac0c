"""Films of several parts, and of several scenes, whose outline is fitted."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.tracker.clip.filmed import QUIET, as_seen, away, mean_away, written
from tests.tracker.outline.films import WALKER, film
from tracker.clip import outlines, part
from tracker.clip.follow import follow
from tracker.clip.outlines import MOST, look
from tracker.clip.plan import prepare


@pytest.fixture
def in_parts(monkeypatch):
    """Survey at most 41 frames together; how often a part was surveyed is counted."""
    monkeypatch.setattr(outlines, "REACH", 20)
    monkeypatch.setattr(outlines, "SHARED", 20)
    monkeypatch.setattr(part, "EDGE", 6)
    surveyed, survey = [], part.surveyed

    def counted(*words):
        surveyed.append(words[1:3])
        return survey(*words)

    monkeypatch.setattr(part, "surveyed", counted)
    return surveyed


@pytest.fixture(scope="module")
def long_walk():
    return film(np.random.default_rng(20), frames=90, camera=(1.2, -0.2, 0.0, 0.0))


def test_the_outline_is_known_beyond_the_first_part_of_a_film_both_ways(tmp_path, in_parts, long_walk):
    shares = np.linspace(0.7, 1.0, 90)
    images = np.rint(long_walk.images * shares[:, None, None, None]).astype(np.uint8)
    seen = as_seen(prepare(written(tmp_path, images, long_walk.joints, 45))).seen
    assert in_parts[0] == (25, 65)
    assert {first < 25 for first, _ in in_parts[1:]} == {False, True}
    assert sorted(seen.places) == list(range(90))
    assert set(range(5, 85)) <= set(seen.points)  # nearer the ends the walker is partly out of sight
    assert mean_away(seen.points, long_walk) < 0.07
    truth = np.linalg.inv(long_walk.places[45]) @ long_walk.places
    assert_allclose([seen.places[t] for t in sorted(seen.places)], truth, atol=1.0)
    assert_allclose([seen.lights[t] for t in range(90)], shares / shares[45], atol=0.03)


def test_no_part_is_surveyed_beyond_the_frames_that_are_followed(tmp_path, in_parts, long_walk):
    job = written(tmp_path, long_walk.images, long_walk.joints, 45)
    look(prepare(replace(job, from_=30, stop=60)), QUIET)
    assert in_parts == [(30, 60)]


def test_legs_keep_their_names_in_the_parts_beyond(tmp_path, in_parts, long_walk, monkeypatch):
    fit, fits = part.fitted, []

    def exchanged(*words):
        fits.append(fit(*words))
        other = replace(fits[-1].exchanged(WALKER), named=fits[-1].named)
        return fits[-1] if len(fits) == 1 else other

    monkeypatch.setattr(part, "fitted", exchanged)
    seen = as_seen(prepare(written(tmp_path, long_walk.images, long_walk.joints, 45)))
    assert max(each.mean() for each in away(seen.seen.points, long_walk).values()) < 0.2
    assert len(fits) >= 5  # two or more in a row on each side
    assert seen.tracker.settings.exchange == MOST


@pytest.fixture
def among_others(tmp_path, long_walk):
    """The job of a walk with other scenes before and after it."""
    other = 255 - long_walk.images[:30]
    images = np.concatenate([other[:12], long_walk.images, other])
    return written(tmp_path, images, np.concatenate([long_walk.joints[:12], long_walk.joints]), 57)


def test_nothing_is_known_of_other_scenes_in_the_parts_beyond(in_parts, among_others):
    seen = look(prepare(among_others), QUIET)
    assert seen.shot == (12, 101)
    assert sorted(seen.places) == list(range(12, 102))
    assert set(seen.points) <= set(range(12, 102))


def test_a_run_begins_and_ends_with_the_scene_that_its_start_is_in(among_others):
    run = follow(among_others, QUIET)
    assert (run.track.first, len(run.track)) == (12, 90)
    assert [text.split(" another")[0] for text in run.warnings] == ["up to frame 11", "from frame 102 on"]
