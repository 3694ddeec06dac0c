"""Films that are not one walk through a scene at rest: what is followed, found and said of each."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.clip.filmed import written
from tests.tracker.clips import QUIET
from tests.tracker.outline.films import UNIT, film
from tracker.clip.follow import follow
from tracker.clip.found import people
from videos.frames import Video

LENGTH = 40

pytestmark = pytest.mark.whole


@pytest.fixture(scope="module")
def walk():
    return film(np.random.default_rng(20), frames=LENGTH)


@pytest.fixture
def filmed(tmp_path):
    """A film of pictures, and one that is followed from the joints of a frame."""

    def as_film(images, joints, frame):
        images = np.clip(np.rint(images), 0, 255).astype(np.uint8)
        job = replace(written(tmp_path, images, joints, frame), model="walk-run")
        return people(Video(job.video), QUIET), follow(job, QUIET).track

    return as_film


def errors(track, joints):
    """(T,) mean distance of the joints from the truth, leg lengths."""
    return np.hypot(*np.moveaxis(track.joints()[: len(joints)] - joints, -1, 0)).mean(1) / UNIT


def test_who_stands_at_first_is_followed_and_found_walking(walk, filmed, rng):
    stands = LENGTH  # frames, half of the film
    images = np.concatenate([np.repeat(walk.images[:1], stands, axis=0), walk.images])
    joints = np.concatenate([np.repeat(walk.joints[:1], stands, axis=0), walk.joints])
    images = images + rng.normal(scale=1.5, size=images.shape)
    found, track = filmed(images, joints, stands + 15)
    assert errors(track, joints).max() < 0.05
    assert found[0].facing == 1
    assert found[0].last == len(images) - 1


def test_at_a_cut_the_run_ends_and_whoever_walks_then_is_not_among_those_found(walk, filmed):
    after = film(np.random.default_rng(77), frames=LENGTH)
    images = np.concatenate([walk.images, after.images])
    found, track = filmed(images, walk.joints, 10)
    assert len(track) == LENGTH
    assert errors(track, walk.joints).max() < 0.05
    assert [(one.first, one.last) for one in found] == [(0, LENGTH - 1)]


def test_leaves_that_move_in_the_wind_are_nobody_and_hinder_nobody(walk, filmed, rng):
    images = walk.images.astype(float)
    for t, image in enumerate(images):
        image[:50] = np.roll(image[:50], round(3.0 * np.sin(0.9 * t)), axis=1)
        image[:50] += rng.normal(scale=12.0, size=image[:50].shape)
    found, track = filmed(images, walk.joints, 10)
    assert errors(track, walk.joints).max() < 0.05
    (one,) = found
    assert np.hypot(*(one.joints - walk.joints[one.frame]).T).mean() < 0.06 * UNIT


def test_ten_frames_are_followed_from_marks_though_nobody_is_found_in_them(walk, filmed):
    found, track = filmed(walk.images[:10], walk.joints, 4)
    assert found == []
    assert errors(track, walk.joints[:10]).max() < 0.05
