"""Clips are made here, small, and then cut, turned or spoiled."""

import gc
import io
import wave
from fractions import Fraction
from itertools import islice
from pathlib import Path
from types import SimpleNamespace

import av
import cv2
import numpy as np
import PIL.Image
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from videos import recall
from videos.container import VideoError, announced, decode
from videos.frames import Frame, Video, files_of, films_in
from videos.times import FASTEST, Growing, rate_of
from videos.writer import Writer

WIDTH, HEIGHT = 96, 64
# Flat patches at crf 10: quantisation and the way to yuv420p and back move a mean by a few grey levels.
CODEC = 8


def picture(t):
    """Grey that brightens with t; the top left quarter red, so that turning and mirroring show."""
    image = np.full((HEIGHT, WIDTH, 3), 40 + 4 * t, np.uint8)
    image[: HEIGHT // 2, : WIDTH // 2] = (220, 30, 30)
    return image


def corner_colors(image):
    """(4, 3) mean RGB of the quarters: top left, top right, bottom left, bottom right."""
    h, w = image.shape[0] // 2, image.shape[1] // 2
    inner = [(slice(0, h), slice(0, w)), (slice(0, h), slice(w, None)), (slice(h, None), slice(0, w))]
    return np.array([image[k].mean((0, 1)) for k in [*inner, (slice(h, None), slice(w, None))]])


def make_clip(path, images, *, ticks=None, format="mp4", key_every=250, x264=""):
    """h264 at 30 frames a second, the index in front; `ticks` are times in milliseconds."""
    options = {"movflags": "+faststart"} if format == "mp4" else {}
    with av.open(str(path), "w", format=format, options=options) as container:
        coding = {"crf": "10", "g": str(key_every), "x264-params": x264}
        stream = container.add_stream("libx264", rate=30, options=coding)
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        if ticks is not None:
            stream.codec_context.time_base = Fraction(1, 1000)
        for t, image in enumerate(images):
            frame = av.VideoFrame.from_ndarray(image, format="rgb24")
            if ticks is not None:
                frame.pts, frame.time_base = ticks[t], Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def set_display_matrix(path, matrix):
    """Patch a, b, c, d of the track header: a stored pixel goes to x' = a x + c y, y' = b x + d y."""

    def fixed(a, b, c, d):
        return b"".join((65536 * n).to_bytes(4, "big", signed=True) for n in (a, b, 0, c, d))

    stored = path.read_bytes()
    at = stored.index(fixed(1, 0, 0, 1), stored.index(b"tkhd"))
    path.write_bytes(stored[:at] + fixed(*matrix) + stored[at + 20 :])


def noise(count, rng):
    """Images that compress badly, so that bytes are spread evenly over the frames."""
    return [rng.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8) for _ in range(count)]


def write_images(folder, names):
    for t, name in enumerate(names):
        cv2.imwrite(str(folder / name), np.full((6, 8, 3), 10 * t, np.uint8))


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


STRETCHES = [
    (0, 39, 1),
    (9, 8, 1),
    (16, 15, 1),
    (5, 20, 1),
    (12, 12, 1),
    (23, 38, 3),
    (30, 99, 1),
    (39, 39, 2),
    (100, 150, 1),
    (90, 99, 1),
]


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
        found = list(video.pictures(first, last, every))
        assert len(found) == len(images[first : last + 1 : every])
        assert all(map(np.array_equal, found, images[first : last + 1 : every]))
    if passed:
        assert decoded[-1] < 100  # of the last stretch, which from the beginning takes a hundred


def test_recordings_that_were_joined_are_read_from_the_beginning(tmp_path, decoded):
    parts = [make_clip(tmp_path / f"{n}.ts", [picture(t) for t in range(40)], format="mpegts") for n in "ab"]
    joined = tmp_path / "all.ts"
    joined.write_bytes(b"".join(part.read_bytes() for part in parts))
    images, video = [frame.image for frame in Video(joined)], Video(joined)
    assert len(list(video.pictures(0, 59))) == 60
    for first, last in ((0, 99), (38, 60), (50, 99), (70, 75)):
        found = list(video.pictures(first, last))
        assert len(found) == len(images[first : last + 1])
        assert all(map(np.array_equal, found, images[first : last + 1]))


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
    found = list(video.pictures(35, 38))
    assert len(found) == 4
    assert all(map(np.array_equal, found, images[35:39]))


def test_a_folder_is_entered_at_any_picture(tmp_path):
    write_images(tmp_path, [f"{t}.png" for t in range(5)])
    video = Video(tmp_path)
    assert [int(image[0, 0, 0]) for image in video.pictures(1, 9, 2)] == [10, 30]


def test_a_second_pass_gives_the_same_frames(tmp_path):
    video = Video(make_clip(tmp_path / "walk.mp4", [picture(t) for t in range(5)]))
    next(iter(video))
    first, second = list(video), list(video)
    assert len(first) == len(second) == 5
    assert all(
        np.array_equal(a.image, b.image) and a.time == b.time for a, b in zip(first, second, strict=True)
    )


def test_frames_are_read_only(tmp_path):
    frame = next(iter(Video(make_clip(tmp_path / "walk.mp4", [picture(0)]))))
    with pytest.raises(ValueError, match="read-only"):
        frame.image[0, 0] = 0


def test_a_frame_refuses_anything_but_rgb_bytes():
    with pytest.raises(ValueError, match=r"must be \(height, width, 3\) uint8"):
        Frame(0, 0.0, np.zeros((4, 4), np.uint8))


def test_a_variable_frame_rate_keeps_every_frames_own_time(tmp_path):
    ticks = [0, 33, 67, 167, 180, 400]
    video = Video(make_clip(tmp_path / "phone.mp4", [picture(t) for t in range(6)], ticks=ticks))
    # The container rounds to its own clock, no coarser than a millisecond.
    assert_allclose([frame.time for frame in video], np.array(ticks) / 1000, atol=1e-3)
    assert video.cut_short is None
    assert video.uneven == (
        f"4 of 6 frames of phone.mp4 come early or late for {video.fps:.4g} a second; motion is taken as if "
        "they were even"
    )


def test_a_film_of_which_every_third_frame_was_dropped_is_told(tmp_path):
    ticks = [100 * t // 3 for t in range(60) if t % 3]
    video = Video(make_clip(tmp_path / "phone.mp4", [picture(t % 20) for t in range(40)], ticks=ticks))
    list(video)
    assert video.uneven.startswith("39 of 40 frames of phone.mp4 come early or late")


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


@pytest.mark.parametrize(("ratio", "said"), [("4/3", 1), ("1/1", 0), ("1001/1000", 0)])
def test_pixels_that_are_not_square_are_told(tmp_path, ratio, said):
    path = make_clip(tmp_path / "tape.mp4", [picture(t) for t in range(4)], x264=f"sar={ratio}")
    assert [
        note.startswith("the pixels of tape.mp4 are not square") for note in Video(path).notes
    ] == said * [True]


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


@pytest.mark.parametrize(("interlaced", "said"), [(1, 1), (0, 0)])
def test_an_interlaced_video_is_told(tmp_path, interlaced, said):
    images = [picture(t) for t in range(6)]
    video = Video(make_clip(tmp_path / "tape.mp4", images, x264=f"interlaced={interlaced}"))
    assert video.notes == []  # of no pass yet
    list(video)
    told = "tape.mp4 is interlaced, each frame of two moments; deinterlace it for sharper limbs"
    assert video.notes == [told] * said


def joined(path, parts):
    """Recordings put one after another, as `cat` does: the times of each begin anew."""
    each = [make_clip(path.with_name(f"{n}.ts"), images, format="mpegts") for n, images in enumerate(parts)]
    path.write_bytes(b"".join(part.read_bytes() for part in each))
    return path


def test_joined_recordings_go_on_where_the_one_before_ended(tmp_path):
    images = [picture(t) for t in range(12)]
    video = Video(joined(tmp_path / "all.ts", [images, images]))
    times = np.array([frame.time for frame in video])
    assert len(times) == 24
    assert_allclose(np.diff(times), 1 / 30, atol=1e-4)  # MPEG counts in 90000ths of a second
    assert video.retimed == (
        "one time of frames in all.ts did not grow and were put right; figures by time may be off there"
    )


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
    assert video.retimed.startswith("2 times of frames in screen.mkv did not grow")


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


def uneven(folder):
    """A clip whose container knows no rate but its clock's; most of its frames are 33 ms apart."""
    ticks = [0, 33, 66, 133, 140, 147, 180, 187, 220]
    return make_clip(folder / "cut.ts", [picture(t) for t in range(9)], ticks=ticks, format="mpegts")


def test_a_clocks_rate_is_not_taken_for_the_frames(tmp_path):
    path = uneven(tmp_path)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.average_rate is None
        assert stream.guessed_rate > FASTEST
    assert Video(path).fps == pytest.approx(1000.0 / 33.0, rel=1e-6)


def test_a_clocks_rate_is_seen_through_where_the_file_is_damaged(tmp_path):
    path = uneven(tmp_path)

    def damaged_at_last(stream):
        yield from islice(container.demux(stream), 8)
        raise av.InvalidDataError(1, "damage")

    with av.open(str(path)) as container:
        damaged = SimpleNamespace(demux=damaged_at_last, duration=None)
        fps, _ = announced(damaged, container.streams.video[0])
    assert fps == pytest.approx(1000.0 / 33.0, rel=1e-6)


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


def test_a_file_cut_in_the_middle_gives_its_whole_frames_and_says_so(tmp_path, rng):
    path = make_clip(tmp_path / "walk.mp4", noise(40, rng))
    whole = [frame.image for frame in Video(path)]
    stored = path.read_bytes()
    path.write_bytes(stored[: len(stored) // 2])

    video = Video(path)
    frames = list(video)
    assert 10 < len(frames) < 30
    assert all(np.array_equal(frame.image, whole[frame.index]) for frame in frames)
    assert_allclose([frame.time for frame in frames], np.arange(len(frames)) / 30, atol=1e-4)
    assert video.cut_short == (
        f"walk.mp4 ends after {len(frames)} of about 40 frames; what was read was used"
    )


def test_a_cut_that_no_decoder_notices_shows_in_the_count(tmp_path, rng):
    path = make_clip(tmp_path / "walk.mkv", noise(40, rng), format="matroska")
    stored = path.read_bytes()
    path.write_bytes(stored[: len(stored) // 2])
    video = Video(path)
    count = sum(1 for _ in video)
    said = f"walk.mkv ends after {count} of about 40 frames; what was read was used"
    assert video.cut_short == said
    next(iter(video))  # a pass over a part knows no better
    assert video.cut_short == said


def test_damage_near_the_end_is_told_though_hardly_a_frame_is_missing(tmp_path, rng):
    path = make_clip(tmp_path / "walk.mp4", noise(40, rng))
    path.write_bytes(path.read_bytes()[:-2000])
    video = Video(path)
    count = sum(1 for _ in video)
    assert 38 <= count < 40
    assert video.cut_short == f"walk.mp4 cannot be decoded past frame {count - 1}; what was read was used"


def test_pictures_that_the_decoder_mends_are_counted(tmp_path, rng):
    path = make_clip(tmp_path / "walk.mp4", noise(12, rng))
    assert len(list(video := Video(path))) == 12
    assert video.mended == 0
    with av.open(str(path)) as container:
        pos, size = [(packet.pos, packet.size) for packet in container.demux(video=0) if packet.size][6]
    data = bytearray(path.read_bytes())
    data[pos + size // 2 : pos + size // 2 + 30] = bytes(30)
    path.write_bytes(data)
    video = Video(path)
    for _ in range(2):  # the second time they are not decoded anew
        assert len(list(video)) == 12
        assert video.mended == 1


def test_damage_in_the_middle_is_left_out_and_what_follows_is_read(tmp_path, rng):
    path = make_clip(tmp_path / "walk.mp4", noise(40, rng), key_every=10)
    with av.open(str(path)) as container:
        packets = [(packet.pos, packet.size) for packet in container.demux(video=0) if packet.size]
    whole = {round(30 * frame.time): frame.image for frame in Video(path)}
    data = bytearray(path.read_bytes())
    for pos, size in packets[20:23]:
        data[pos : pos + size] = b"\xff" * size
    path.write_bytes(data)
    video = Video(path)
    frames = list(video)
    assert 30 <= len(frames) < 40
    assert [round(30 * frame.time) for frame in frames[-8:]] == sorted(whole)[-8:]
    assert all(np.array_equal(frame.image, whole[round(30 * frame.time)]) for frame in frames[-8:])
    assert video.cut_short.startswith("walk.mp4 is damaged, first after frame ")
    assert video.cut_short.endswith("; what cannot be decoded was left out")


def test_a_lack_of_memory_is_not_taken_for_damage():
    def fail(packet):
        raise av.error.MemoryError(12, "Cannot allocate memory")

    container = SimpleNamespace(demux=lambda stream: iter([SimpleNamespace(size=9)]))
    stream = SimpleNamespace(codec_context=SimpleNamespace(decode=fail))
    with pytest.raises(MemoryError):
        list(decode(container, stream))


def test_a_clip_trimmed_on_the_phone_is_not_called_cut_short(tmp_path):
    path = make_clip(tmp_path / "trimmed.mp4", [picture(t) for t in range(40)])
    stored = bytearray(path.read_bytes())
    # The edit list shows the first half only; all samples stay in the file. Its entry: duration, start.
    at = stored.index(b"elst") + 12
    duration = int.from_bytes(stored[at : at + 4], "big")
    stored[at : at + 4] = (duration // 2).to_bytes(4, "big")
    path.write_bytes(stored)

    video = Video(path)
    assert sum(1 for _ in video) == pytest.approx(20, abs=1)
    assert video.cut_short is None


def test_a_folder_is_read_in_the_order_of_its_numbers(tmp_path):
    write_images(tmp_path, ["img1.png", "img2.png", "img10.jpg", "img011.PNG", "img300.jpeg"])
    write_images(tmp_path, [".img0.png", "cover.png"])
    (tmp_path / "img5.txt").write_text("no image")
    video = Video(tmp_path)
    frames = list(video)
    assert_allclose([frame.image.mean() for frame in frames], [0, 10, 20, 30, 40], atol=1)
    assert_allclose([frame.time for frame in frames], np.arange(5) / 30)
    assert (video.width, video.height, video.fps, video.count_hint) == (8, 6, 30.0, 5)
    assert video.cut_short is None


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("1.png", "2.png", "3.png", "10.png"), "first from 3.png to 10.png"),
        (("a1.png", "a2.jpg", "a2.png", "a3.png"), "first from a2.jpg to a2.png"),
        (("1.jpg", "1.png", "2.jpg", "2.png", "3.jpg", "3.png"), "first from 1.jpg to 1.png"),
        (("5.png", "10.png", "15.png"), None),
        (("shot2_01.png", "shot2_02.png", "shot2_03.png"), None),
    ],
)
def test_numbers_that_are_left_out_or_given_twice_are_said(names, said, tmp_path):
    for name in names:
        cv2.imwrite(str(tmp_path / name), picture(0))
    gaps = Video(tmp_path).gaps
    assert gaps is None if said is None else said in gaps


def test_images_of_another_size_are_an_error_that_names_the_file(tmp_path):
    write_images(tmp_path, ["1.png", "2.png"])
    cv2.imwrite(str(tmp_path / "3.png"), np.zeros((7, 8, 3), np.uint8))
    with pytest.raises(VideoError, match=r"3\.png .* is 8x7, .* are 8x6; bring all to one size"):
        list(Video(tmp_path))


def test_a_damaged_beginning_is_passed_over_to_the_next_key_frame(tmp_path, rng):
    path = make_clip(tmp_path / "walk.mp4", noise(12, rng), key_every=4)
    whole = [frame.image for frame in Video(path)]
    stored = bytearray(path.read_bytes())
    at = stored.index(b"mdat") + 4
    stored[at : at + 1000] = b"\xff" * 1000
    path.write_bytes(stored)
    # The frame just before the key frame leans on it too, and may be pieced together by the decoder.
    *pieced, first = list(Video(path))[:-7]
    assert len(pieced) <= 1
    assert first.time == pytest.approx(4 / 30, abs=1e-4)
    assert np.array_equal(first.image, whole[4])


def test_a_video_whose_coding_is_not_said_is_an_error_and_no_crash(tmp_path):
    make_clip(tmp_path / "clip.mp4", [picture(t) for t in range(3)])
    stored = (tmp_path / "clip.mp4").read_bytes()
    (tmp_path / "clip.mp4").write_bytes(stored.replace(b"stbl", b"wtbl"))
    with pytest.raises(VideoError, match="does not say how its pictures are coded"):
        Video(tmp_path / "clip.mp4")


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_a_png_is_rgb_whatever_its_channels_and_its_name(tmp_path, rng, channels):
    stored = rng.integers(0, 256, (9, 12, channels), dtype=np.uint8)
    png = cv2.imencode(".png", stored)[1].tobytes()
    (tmp_path / "1.png").write_bytes(png)
    (tmp_path / "2.jpg").write_bytes(png)
    wanted = stored[..., [2, 1, 0]] if channels > 1 else stored.repeat(3, axis=2)
    for frame in Video(tmp_path):
        assert_array_equal(frame.image, wanted)


def jpeg(stored, orientation=1, sampling="4:4:4"):
    """A JPEG picture with the orientation that a camera notes."""
    notes, file = PIL.Image.Exif(), io.BytesIO()
    notes[0x0112] = orientation
    image = PIL.Image.fromarray(stored)
    image.save(file, "jpeg", quality=95, subsampling=sampling, exif=notes)
    return file.getvalue()


@pytest.mark.parametrize(("orientation", "turns"), [(1, 0), (3, 2), (6, 3), (8, 1)])
def test_a_jpeg_is_as_it_was_stored_and_upright(tmp_path, orientation, turns):
    stored = picture(3)
    (tmp_path / "1.jpg").write_bytes(jpeg(stored, orientation))
    (frame,) = Video(tmp_path)
    wanted = np.rot90(stored, turns)
    assert frame.image.shape == wanted.shape
    assert np.abs(frame.image.astype(int) - wanted).mean() < 3.0


def test_a_damaged_jpeg_is_shown_as_far_as_it_goes_or_refused_and_nobody_prints_of_it(tmp_path, rng, capfd):
    whole = jpeg(rng.integers(0, 256, (64, 96, 3), dtype=np.uint8))
    middle = len(whole) // 2
    (tmp_path / "1.jpg").write_bytes(whole[:middle] + bytes(40) + whole[middle + 40 :])
    assert [frame.image.shape for frame in Video(tmp_path)] == [(64, 96, 3)]
    (tmp_path / "1.jpg").write_bytes(whole[:middle])
    with pytest.raises(VideoError, match=r"cannot read .*1\.jpg as an image; replace it or remove it"):
        list(Video(tmp_path))
    assert capfd.readouterr() == ("", "")


def test_motion_jpeg_with_a_cameras_notes_is_read(tmp_path):
    stored = picture(3)
    with av.open(str(tmp_path / "clip.avi"), "w") as container:
        stream = container.add_stream("mjpeg", rate=30)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuvj444p"
        for t in range(3):
            packet = av.Packet(jpeg(stored))
            packet.stream, packet.pts, packet.dts, packet.time_base = stream, t, t, Fraction(1, 30)
            container.mux(packet)
    frames = list(Video(tmp_path / "clip.avi"))
    assert len(frames) == 3
    assert np.abs(frames[0].image.astype(int) - stored).mean() < 3.0


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


def test_hidden_files_are_no_films_and_no_pictures_of_a_folder(tmp_path):
    for name in ("b.mp4", "a.MOV", "._b.mp4", "notes.txt"):
        (tmp_path / name).write_bytes(b"")
    assert [path.name for path in films_in(tmp_path)] == ["a.MOV", "b.mp4"]
    (tmp_path / "pictures").mkdir()
    write_images(tmp_path / "pictures", ["2.png", "1.png"])
    for name in ("._1.png", "1.json"):
        (tmp_path / "pictures" / name).write_bytes(b"")
    assert [path.name for path in files_of(tmp_path / "pictures")] == ["1.png", "2.png"]
    assert files_of(tmp_path / "b.mp4") == [tmp_path / "b.mp4"]
