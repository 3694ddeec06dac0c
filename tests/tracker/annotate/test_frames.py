"""Frames by their number: the very pixels, in any order, and the end said."""

import cv2
import numpy as np
import pytest

from tracker.annotate import frames as module
from tracker.annotate.frames import Frames
from videos.container import VideoError
from videos.frames import Video


def pixels(png):
    return cv2.cvtColor(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)


@pytest.mark.parametrize("kept", [0, 10**9], ids=["one frame kept", "all kept"])
def test_every_frame_in_any_order_is_what_tracking_sees(clip, monkeypatch, kept):
    monkeypatch.setattr(module, "KEPT_BYTES", kept)
    wanted = [frame.image for frame in Video(clip.video)]
    frames = Frames(clip.video)
    for index in (3, 3, 9, 0, 4, 8, 2, 9):
        assert np.array_equal(pixels(frames.png(index)), wanted[index]), index


def test_stepping_back_a_little_decodes_nothing_again(clip):
    frames = Frames(clip.video)
    frames.png(9)
    frames._coming = iter(())
    frames.png(2)


def test_small_pictures_that_were_seen_are_not_made_again_and_take_bounded_memory(clip, monkeypatch):
    frames = Frames(clip.video)
    seen = {index: frames.jpeg(index) for index in (9, 2, 4)}
    one = len(seen[9])
    assert cv2.imdecode(np.frombuffer(seen[9], np.uint8), cv2.IMREAD_COLOR).shape == (270, 480, 3)
    monkeypatch.setattr(frames, "_image", lambda _: pytest.fail("it was made again"))
    assert {index: frames.jpeg(index) for index in (4, 9, 2)} == seen
    monkeypatch.undo()
    monkeypatch.setattr(module, "SMALL_BYTES", 3 * one)
    for index in range(10):
        frames.jpeg(index)
        assert sum(map(len, frames._small.values())) <= 3 * one


def test_a_frame_beyond_the_end_is_refused_and_the_others_still_come(clip):
    frames = Frames(clip.video)
    with pytest.raises(VideoError, match=r"frame 10 is not in walk\.mp4, which ends with frame 9"):
        frames.png(10)
    assert frames.count_hint == 10
    assert frames.png(0)
    with pytest.raises(VideoError, match=r"frame 100000000 is not in walk\.mp4"):
        frames.png(10**8)


def test_a_film_that_was_away_for_a_while_comes_again(clip, monkeypatch):
    frames = Frames(clip.video)
    wanted = frames.png(3)
    frames = Frames(clip.video)

    def away(_):
        raise VideoError("the disk is away")
        yield

    frames._coming = away(frames)
    with pytest.raises(VideoError, match="away"):
        frames.png(3)
    assert frames.png(3) == wanted
    assert frames.count_hint == 10
