"""Frames of a video: every frame in order, entry in the middle, upright pictures, notes on the pictures."""

import gc
import wave
from itertools import islice
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.videos.clips import (
    CODEC,
    HEIGHT,
    WIDTH,
    corner_colors,
    joined,
    make_clip,
    noise,
    picture,
    set_display_matrix,
)
from videos import recall
from videos.container import VideoError, decode
from videos.frames import Video


def test_every_frame_comes_back_in_order_with_its_content_and_time(tmp_path):
    video = Video(make_clip(tmp_path / "walk.mp4", [picture(t) for t in range(40)]))
    frames = list(video)

    assert (video.width, video.height, video.fps) == (WIDTH, HEIGHT, 30.0)
    assert video.count_hint == 40
    assert [frame.index for frame in frames] == list(range(40))
    assert_allclose([frame.time for frame in frames], np.arange(40) / 30, atol=1e-4)
    for frame in frames:
        assert_allclose(corner_colors(frame.image), corner_colors(picture(frame.index)), atol=CODEC)
    assert video.cut_short is None


@pytest.mark.parametrize("format", ["matroska", "mp4", "mpegts"])
def test_a_film_that_begins_late_has_no_more_frames_for_that(format, tmp_path):
    ticks = [100_000 + round(1000 * t / 30) for t in range(40)]
    video = Video(make_clip(tmp_path / "walk", [picture(t) for t in range(40)], format=format, ticks=ticks))
    assert video.count_hint == pytest.approx(40, abs=1)
    assert len(list(video)) == 40
    assert video.cut_short is None


STRETCHES = [
    (0, 39, 1), (9, 8, 1), (16, 15, 1), (5, 20, 1), (12, 12, 1),
    (23, 38, 3), (30, 99, 1), (39, 39, 2), (100, 150, 1), (90, 99, 1),
]  # fmt: skip


@pytest.fixture
def decoded(monkeypatch):
    """How many pictures each pass over a film has decoded; none is held in memory."""
    monkeypatch.setattr(recall, "HELD", 0)
    counts = []

    def counted(container, stream):
        counts.append(0)
        for each in decode(container, stream):
            counts[-1] += 1
            yield each

    monkeypatch.setattr("videos.frames.decode", counted)
    return counts


@pytest.mark.parametrize(("format", "name"), [("mp4", "a.mp4"), ("matroska", "a.mkv"), ("mpegts", "a.ts")])
@pytest.mark.parametrize("passed", [True, False], ids=["after a pass", "at first"])
def test_entered_in_its_middle_a_film_gives_the_very_frames(tmp_path, rng, format, name, passed, decoded):
    path = make_clip(tmp_path / name, noise(100, rng), format=format, key_every=12)
    images, video = [frame.image for frame in Video(path)], Video(path)
    if passed:
        list(video.pictures(0, 99, 5))
    for first, last, every in STRETCHES[:: 1 if passed else -1]:
        assert_array_equal(list(video.pictures(first, last, every)), images[first : last + 1 : every])
    if passed:
        assert decoded[-1] < 100  # of the last stretch, which from the beginning takes a hundred


def test_recordings_that_were_joined_are_read_from_the_beginning(tmp_path, decoded):
    path = joined(tmp_path / "all.ts", [[picture(t) for t in range(40)]] * 2)
    images, video = [frame.image for frame in Video(path)], Video(path)
    assert len(list(video.pictures(0, 59))) == 60
    for first, last in ((0, 99), (38, 60), (50, 99), (70, 75)):
        assert_array_equal(list(video.pictures(first, last)), images[first : last + 1])


@pytest.mark.parametrize("wrong", ["another picture", "no picture", "an error"])
def test_where_it_cannot_be_entered_a_film_is_read_from_its_beginning(tmp_path, rng, wrong, monkeypatch):
    monkeypatch.setattr(recall, "HELD", 0)
    video = Video(make_clip(tmp_path / "a.mp4", noise(40, rng)))
    images, whole = [frame.image for frame in video], Video._pictures

    def entered(video, tick=None, _=0):
        if tick is not None and wrong == "an error":
            raise av.error.PermissionError(1, "Operation not permitted")
        found = whole(video)
        yield from found if tick is None else islice(found, 20, 21 if wrong == "another picture" else 20)

    monkeypatch.setattr(Video, "_pictures", entered)
    assert_array_equal(list(video.pictures(35, 38)), images[35:39])


def test_frames_are_read_only(tmp_path):
    frame = next(iter(Video(make_clip(tmp_path / "walk.mp4", [picture(0)]))))
    with pytest.raises(ValueError, match="read-only"):
        frame.image[0, 0] = 0


@pytest.mark.parametrize(("ratio", "said"), [("4/3", 1), ("1/1", 0), ("1001/1000", 0)])
def test_pixels_that_are_not_square_are_told(tmp_path, ratio, said):
    path = make_clip(tmp_path / "tape.mp4", [picture(t) for t in range(4)], x264=f"sar={ratio}")
    assert [
        note.startswith("the pixels of tape.mp4 are not square") for note in Video(path).notes
    ] == said * [True]


@pytest.mark.parametrize(("interlaced", "said"), [(1, 1), (0, 0)])
def test_an_interlaced_video_is_told(tmp_path, interlaced, said):
    images = [picture(t) for t in range(6)]
    video = Video(make_clip(tmp_path / "tape.mp4", images, x264=f"interlaced={interlaced}"))
    assert video.notes == []  # of no pass yet
    list(video)
    told = "tape.mp4 is interlaced, each frame of two moments; deinterlace it for sharper limbs"
    assert video.notes == [told] * said


def test_pictures_of_a_long_film_do_not_pile_up_in_memory(tmp_path, monkeypatch):
    monkeypatch.setattr(recall, "HELD", 0)
    path = make_clip(tmp_path / "a.mp4", [picture(t) for t in range(20)])
    gc.collect()
    gc.disable()
    try:
        for _ in Video(path):
            pass
        assert len([held for held in gc.get_objects() if isinstance(held, av.VideoFrame)]) <= 1
    finally:
        gc.enable()


@pytest.mark.parametrize(
    ("stored", "matrix"),
    [
        (np.rot90(picture(0)), (0, 1, -1, 0)),  # a quarter turn clockwise brings it upright: x' = -y, y' = x
        (np.rot90(picture(0), 2), (-1, 0, 0, -1)),
        (np.rot90(picture(0), 3), (0, -1, 1, 0)),
        (picture(0)[:, ::-1], (-1, 0, 0, 1)),
    ],
    ids=["a quarter", "a half", "three quarters", "mirrored"],
)
def test_a_phones_rotated_or_mirrored_video_comes_upright(tmp_path, stored, matrix):
    path = make_clip(tmp_path / "phone.mp4", [np.ascontiguousarray(stored)] * 3)
    set_display_matrix(path, matrix)
    video = Video(path)
    frame = next(iter(video))
    assert (video.width, video.height) == (WIDTH, HEIGHT)
    assert_allclose(corner_colors(frame.image), corner_colors(picture(0)), atol=CODEC)


def test_sound_alone_is_an_error(tmp_path):
    with wave.open(str(tmp_path / "steps.wav"), "wb") as sound:
        sound.setnchannels(1)
        sound.setsampwidth(2)
        sound.setframerate(8000)
        sound.writeframes(bytes(16_000))
    with pytest.raises(VideoError, match="no video in it, only audio"):
        Video(tmp_path / "steps.wav")


def test_a_colon_in_the_name_is_no_protocol(tmp_path, monkeypatch):
    make_clip(tmp_path / "walk.mp4", [picture(0)]).rename(tmp_path / "take:2.mp4")
    monkeypatch.chdir(tmp_path)
    assert len(list(Video(Path("take:2.mp4")))) == 1
