"""Times of frames and the frame rate, where times are even or uneven, repeat or are missing."""

from fractions import Fraction
from itertools import islice
from types import SimpleNamespace

import av
import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.videos.clips import HEIGHT, WIDTH, joined, make_clip, picture
from videos.container import announced
from videos.frames import Video
from videos.times import FASTEST, Growing, rate_of
from videos.writer import Writer


def test_a_variable_frame_rate_keeps_every_frames_own_time(tmp_path):
    ticks = [0, 33, 67, 167, 180, 400]
    video = Video(make_clip(tmp_path / "phone.mp4", [picture(t) for t in range(6)], ticks=ticks))
    # The container rounds to its own clock, no coarser than a millisecond.
    assert_allclose([frame.time for frame in video], np.array(ticks) / 1000, atol=1e-3)
    assert video.cut_short is None
    assert video.notes == [
        f"4 of 6 frames of phone.mp4 come early or late for {video.fps:.4g} a second; motion is taken as if "
        "they were even"
    ]


@pytest.mark.parametrize(
    "ticks",
    [
        [33 * t + 4000 * (t >= 45) for t in range(90)],  # a recording that was paused
        [33 * t + 367 * (t >= 1) for t in range(40)],  # a first picture that is held
    ],
)
def test_a_pause_is_not_part_of_the_rate(tmp_path, ticks):
    path = make_clip(tmp_path / "phone.mp4", [picture(t % 20) for t in range(len(ticks))], ticks=ticks)
    video = Video(path)
    assert len(list(video)) == len(ticks)
    assert video.fps == pytest.approx(1000.0 / 33.0, rel=1e-3)
    assert video.notes == []


def test_the_clock_of_matroska_is_not_taken_for_the_frames(tmp_path):
    path = make_clip(
        tmp_path / "browser.webm",
        [picture(t) for t in range(30)],
        ticks=[33 * t + 7 * (t % 3) for t in range(30)],
        format="matroska",
    )
    # As browsers record: without the usual duration of a frame, whose element becomes a void one.
    stored = path.read_bytes()
    assert stored.count(b"\x23\xe3\x83\x84") == 1
    path.write_bytes(stored.replace(b"\x23\xe3\x83\x84", b"\xec\x40\x05\x84"))
    with av.open(str(path)) as container:
        assert container.streams.video[0].average_rate is None
        assert container.streams.video[0].guessed_rate == FASTEST
    video = Video(path)
    assert len(list(video)) == 30
    assert 24.0 < video.fps < 31.0
    assert video.cut_short is None


@pytest.mark.parametrize("step", [[67], [33, 33, 33, 33, 67, 67, 67, 67]])
def test_the_rate_that_matroska_declares_gives_way_to_its_frames_times(tmp_path, step):
    ticks = np.cumsum(np.resize(step, 80)) - step[0]
    path = make_clip(
        tmp_path / "dim.mkv", [picture(t % 50) for t in range(80)], ticks=ticks, format="matroska"
    )
    with av.open(str(path)) as container:
        assert container.streams.video[0].average_rate == 30
    video = Video(path)
    assert len(list(video)) == 80
    assert video.fps == pytest.approx(1000.0 / np.mean(step), rel=0.01)
    assert video.count_hint == pytest.approx(80, abs=1)
    assert video.cut_short is None


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (
            (1, 1, 1, 2),
            "25 of 125 frames of film.mp4 repeat the one before, as if it was filmed at 24 a second",
        ),
        ((2,), "100 of 200 frames of film.mp4 repeat the one before, as if it was filmed at 15 a second"),
        ((2, 3), "150 of 250 frames of film.mp4 repeat the one before, as if it was filmed at 12 a second"),
        ((1,) * 39 + (2,), ""),
    ],
)
def test_frames_that_repeat_the_one_before_are_told(tmp_path, times, said):
    order = [t for t in range(100) for _ in range(times[t % len(times)])]
    video = Video(make_clip(tmp_path / "film.mp4", [picture(t % 20) for t in order], x264="keyint=10"))
    list(video)
    assert [note.partition(";")[0] for note in video.notes] == [said] * bool(said)


def test_who_stands_still_repeats_no_frame(tmp_path):
    for t in range(40):
        cv2.imwrite(str(tmp_path / f"{t}.png"), np.full((6, 8, 3), min(max(t - 10, 0), 10), np.uint8))
    video = Video(tmp_path)
    list(video)
    assert video.notes == []


def test_a_few_frames_that_come_late_are_not_spoken_of(tmp_path):
    ticks = [33 * t + 40 * (t > 20) + 40 * (t > 40) for t in range(60)]
    video = Video(make_clip(tmp_path / "phone.mp4", [picture(t % 20) for t in range(60)], ticks=ticks))
    list(video)
    assert video.notes == []


def test_a_second_pass_before_the_first_has_ended_changes_no_time(tmp_path):
    video = Video(make_clip(tmp_path / "a.mp4", [picture(t) for t in range(8)]))
    alone = [frame.time for frame in video]
    first = iter(video)
    begun = [next(first).time for _ in range(3)]
    assert [frame.time for frame in video] == alone
    assert begun + [frame.time for frame in first] == alone
    assert video.notes == []


def test_joined_recordings_go_on_where_the_one_before_ended(tmp_path):
    images = [picture(t) for t in range(12)]
    video = Video(joined(tmp_path / "all.ts", [images, images]))
    times = np.array([frame.time for frame in video])
    assert len(times) == 24
    assert_allclose(np.diff(times), 1 / 30, atol=1e-4)  # MPEG counts in 90000ths of a second
    assert video.notes == [
        "one time of frames in all.ts did not grow and were put right; figures by time may be off there"
    ]


def test_times_that_repeat_are_put_between_those_that_stand(tmp_path):
    path = tmp_path / "screen.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30, options={"bf": "0"})
        stream.height, stream.width = HEIGHT, WIDTH
        ticks = iter([0, 33, 33, 67, 100, 100, 133])
        for image in [picture(t) for t in range(7)] + [None]:
            frame = None if image is None else av.VideoFrame.from_ndarray(image, format="rgb24")
            for packet in stream.encode(frame):
                packet.time_base = Fraction(1, 1000)
                packet.pts = packet.dts = next(ticks)
                container.mux(packet)
    video = Video(path)
    times = [frame.time for frame in video]
    half = 0.5 / video.fps
    assert_allclose(times, [0, 0.033, 0.033 + half, 0.067, 0.1, 0.1 + half, 0.133], atol=1e-9)
    assert video.notes[0].startswith("2 times of frames in screen.mkv did not grow")


def test_times_that_hardly_grow_count_as_repeated_and_can_be_written(tmp_path):
    times = Growing(0.04)
    found = [times.next(told) for told in (0.0, 0.04, 0.040004, 0.08)]
    assert_allclose(found, [0.0, 0.04, 0.06, 0.08], atol=1e-12)
    assert times.wrong == 1
    with Writer(tmp_path / "copy.mp4", 25, (WIDTH, HEIGHT)) as writer:
        for time in found:
            writer.write(picture(0), time)


def test_of_a_file_whose_times_all_are_one_the_times_grow():
    growing = Growing(0.04)
    assert np.diff([growing.next(3.0) for _ in range(50)]).min() > 0.019


def test_a_clocks_rate_is_not_taken_for_the_frames_nor_where_the_file_is_damaged(tmp_path):
    ticks = [0, 33, 66, 133, 140, 147, 180, 187, 220]  # most frames are 33 ms apart
    path = make_clip(tmp_path / "cut.ts", [picture(t) for t in range(9)], ticks=ticks, format="mpegts")

    def damaged_at_last(stream):
        yield from islice(container.demux(stream), 8)
        raise av.InvalidDataError(1, "damage")

    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.average_rate is None
        assert stream.guessed_rate > FASTEST
        damaged = SimpleNamespace(demux=damaged_at_last, duration=None, format=container.format)
        fps, *_ = announced(damaged, stream)
    assert [Video(path).fps, fps] == pytest.approx([1000.0 / 33.0] * 2, rel=1e-6)


@pytest.mark.parametrize("times", [[], [0.5], [0.5, 0.5], [0.0, 1e-5, 2e-5, 3e-5]])
def test_times_in_any_order_tell_the_rate_of_their_median_step_and_none_that_no_camera_keeps(times):
    assert rate_of([0.3, 0.0, 0.2, 0.1, 0.9]) == pytest.approx(10.0)
    assert rate_of(times) is None


def test_frames_without_times_follow_each_other_at_the_nominal_rate(tmp_path):
    path = make_clip(tmp_path / "raw.h264", [picture(t) for t in range(6)], format="h264")
    video = Video(path)
    steps = np.diff([frame.time for frame in video])
    assert_allclose(steps, 1 / video.fps, rtol=1e-6)
    assert video.count_hint is None
