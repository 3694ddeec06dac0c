"""Pictures ahead and back: all of them in order, few of them held."""

from types import SimpleNamespace

import numpy as np
import pytest

from tracker.clip import pictures
from tracker.clip.pictures import Reel


class Counted:
    """A video of `count` pictures, each one grey level; notes every frame that is read."""

    width, height, held = 4, 2, False

    def __init__(self, count):
        self.count, self.read = count, []

    def __iter__(self):
        for t, image in enumerate(self.pictures(0, self.count)):
            yield SimpleNamespace(index=t, time=10.0 + t / 30.0, image=image)

    def pictures(self, first, last):
        for t in range(first, min(last + 1, self.count)):
            self.read.append(t)
            yield np.full((2, 4, 3), t, np.uint8)


def levels(images):
    return [int(image[0, 0, 0]) for image in images]


@pytest.mark.parametrize("stop", [None, 6, 99])
def test_ahead_are_all_frames_up_to_the_stop_with_their_times(stop):
    reel = Reel(Counted(12), stop)
    last = 11 if stop is None else min(stop, 11)
    assert levels(reel.ahead()) == list(range(last + 1))
    assert reel.times == [10.0 + t / 30.0 for t in range(last + 1)]


@pytest.mark.parametrize("block", [1, 3, 5, 100])
@pytest.mark.parametrize(("first", "last"), [(9, 0), (7, 2), (4, 4), (2, 0), (9, 8)])
def test_back_are_the_same_frames_the_other_way_in_any_blocks(block, first, last, monkeypatch):
    monkeypatch.setattr(pictures, "BLOCK", 24 * block)
    monkeypatch.setattr(pictures, "LEAST", 1)
    video = Counted(12)
    reel = Reel(video)
    ahead = reel.ahead()
    for _ in range(10):
        next(ahead)
    assert levels(reel.span(first, last)) == list(range(first, last - 1, -1))
    assert levels(ahead) == [10, 11]


def test_all_pictures_are_in_the_light_of_one_frame():
    reel = Reel(Counted(6), lights={3: 0.5, 4: 2.0})
    assert levels(reel.ahead()) == [0, 1, 2, 6, 2, 5]
    assert levels(reel.span(5, 0)) == [5, 2, 6, 2, 1, 0]
    assert levels(reel.span(2, 4)) == [2, 6, 2]


@pytest.fixture
def video():
    return Counted(10)


@pytest.fixture
def reel(video):
    """All of it read."""
    reel = Reel(video)
    list(reel.ahead())
    video.read.clear()
    return reel


@pytest.fixture
def small_blocks(monkeypatch):
    monkeypatch.setattr(pictures, "BLOCK", 96)
    monkeypatch.setattr(pictures, "LEAST", 1)


@pytest.mark.usefixtures("small_blocks")
def test_going_back_holds_a_block_at_a_time(reel, video):
    back = reel.span(9, 0)
    assert levels(next(back) for _ in range(5)) == [9, 8, 7, 6, 5]
    assert video.read == [6, 7, 8, 9, 2, 3, 4, 5]
    assert levels(back) == [4, 3, 2, 1, 0]
    assert video.read[8:] == [0, 1]


@pytest.mark.usefixtures("small_blocks")
def test_a_picture_going_back_stays_as_it_is_when_earlier_ones_are_read(reel):
    last = next(back := reel.span(5, 0))
    assert levels(back) == [4, 3, 2, 1, 0]
    assert levels([last]) == [5]


def test_a_span_ahead_is_read_again_one_picture_at_a_time(reel, video):
    span = reel.span(3, 6)
    assert levels([next(span)]) == [3]
    assert video.read == [3]
    assert levels(span) == [4, 5, 6]
