"""A short film is decoded once, and never shown as it was before it was changed."""

import os
import shutil

import av
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.videos.clips import make_clip
from tracker.clip.pictures import Reel
from videos import recall
from videos.frames import Video

FRAMES = 12


def written(path, grey=0):
    return make_clip(path, [np.full((16, 32, 3), grey + 8 * t, np.uint8) for t in range(FRAMES)])


@pytest.fixture
def film(tmp_path):
    return written(tmp_path / "a.mp4")


@pytest.fixture
def opened(monkeypatch):
    """Counts the times that a file is opened."""
    calls, really = [], av.open

    def counted(*args, **options):
        calls.append(args)
        return really(*args, **options)

    monkeypatch.setattr(av, "open", counted)
    return calls


def pictures(video):
    return [frame.image for frame in video]


def test_a_film_is_decoded_once_by_whoever_reads_it(film, opened):
    first = Video(film)
    before, times = pictures(first), [frame.time for frame in first]
    number = len(opened)
    again = Video(film)
    again_number = len(opened)  # its rate and count are read anew
    assert_array_equal(pictures(again), before)
    assert [frame.time for frame in again] == times
    assert len(opened) == again_number == number + 1


def test_pictures_of_a_held_film_come_in_any_order(film):
    video = Video(film)
    assert not video.held
    whole = pictures(video)
    assert video.held
    assert_array_equal(list(video.picked([7, 2, 11])), [whole[7], whole[2], whole[11]])


@pytest.mark.parametrize("forgotten", [False, True])
def test_what_goes_back_in_a_film_decodes_nothing_unless_it_was_forgotten(film, opened, tmp_path, forgotten):
    video = Video(film)
    whole = pictures(video)
    reel = Reel(video)
    list(reel.ahead())
    if forgotten:
        pictures(Video(written(tmp_path / "b.mp4")))
    assert video.held is not forgotten
    del opened[:]
    assert_array_equal(list(reel.span(FRAMES - 1, 0)), whole[::-1])
    assert bool(opened) is forgotten


def test_a_changed_film_is_decoded_anew(film, tmp_path):
    pictures(Video(film))
    told = film.stat()
    shutil.copyfile(written(tmp_path / "b.mp4", 40), film)
    os.utime(film, ns=(told.st_atime_ns, told.st_mtime_ns + 1))
    video = Video(film)
    assert not video.held
    assert pictures(video)[0].mean() > 30


def test_nothing_is_held_of_a_film_that_was_not_read_to_its_end(film):
    video = Video(film)
    next(iter(video))
    assert not video.held


def test_nothing_is_held_of_a_film_that_is_too_long(film, monkeypatch):
    monkeypatch.setattr(recall, "HELD", FRAMES * 32 * 16)
    video = Video(film)
    assert len(pictures(video)) == FRAMES
    assert not video.held


@pytest.mark.parametrize("damaged", [True, False])
def test_a_film_of_which_something_cannot_be_decoded_is_not_held(film, damaged):
    frame = av.VideoFrame(32, 16, "yuv420p")
    list(recall.recalled(film, lambda: iter([frame, *[None] * damaged, frame])))
    assert bool(recall.held(film)) is not damaged


def test_a_film_that_tells_to_be_too_long_is_not_held_on_the_way_either(film, monkeypatch):
    frame = av.VideoFrame(32, 16, "yuv420p")
    size = sum(plane.buffer_size for plane in frame.planes)
    monkeypatch.setattr(recall, "HELD", 2 * size)
    for count, held in ((2, True), (3, False)):
        handed = recall.recalled(film, lambda: iter([frame, frame]), count)
        next(handed)
        next(handed)
        inside = handed.gi_frame.f_locals["pictures"]
        assert bool(inside) is held
        list(handed)
        assert bool(recall.held(film)) is held
        recall._last.clear()
