"""Films for browsers: the very frames at their times, whatever the container, edit list or rate."""

import av
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.videos.clips import (
    CODEC,
    begin_later,
    corner_colors,
    make_clip,
    noise,
    picture,
    set_display_matrix,
)
from videos.frames import Video
from videos.playable import copied, encoded

COUNT, KEYS = 40, 12
UNEVEN = np.cumsum(np.tile([20, 50, 33], COUNT))[:COUNT].tolist()  # milliseconds
QUARTER = (0, 1, -1, 0)


@pytest.fixture
def images(rng):
    return noise(COUNT, rng)


def times_of(frames):
    return np.array([frame.time - frames[0].time for frame in frames])


def checked_copy(source, path, first=0, stop=None):
    """The copy of frames first .. stop - 1, which is seen to have them, from its `start` on."""
    frames = list(Video(source))[:stop]
    times, size = times_of(frames), frames[0].image.shape[1::-1]
    film = copied(source, path, first, times[first:], size)
    assert film is not None
    assert (film.path, film.size) == (path, size)
    shown = list(Video(path))
    assert shown[0].time == 0.0
    at = int(np.argmin(np.abs(times_of(shown) - film.start)))
    shown = shown[at : at + len(frames) - first]
    for ours, theirs in zip(shown, frames[first:], strict=True):
        assert_array_equal(ours.image, theirs.image)
    assert_allclose(times_of(shown), times[first:] - times[first], atol=2e-5)
    assert shown[0].time == pytest.approx(film.start, abs=2e-5)
    return film


@pytest.mark.parametrize("format", ["mp4", "matroska"])
@pytest.mark.parametrize("ticks", [None, UNEVEN], ids=["even", "uneven"])
@pytest.mark.parametrize(("first", "stop"), [(0, None), (17, 33), (39, 40)])
def test_a_copy_has_the_very_frames_at_their_times(tmp_path, images, format, ticks, first, stop):
    source = make_clip(tmp_path / "walk", images, format=format, ticks=ticks, key_every=KEYS)
    film = checked_copy(source, tmp_path / "film.mp4", first, stop)
    if ticks is None:
        assert 0.0 <= film.start < min(KEYS, first + 1) / 30.0


@pytest.mark.parametrize("first", [0, 3, 20])
def test_a_film_that_its_edit_list_begins_within_a_gop_is_copied_too(tmp_path, images, first):
    source = make_clip(tmp_path / "walk.mp4", images, key_every=KEYS)
    begin_later(source, cut := 5)
    assert len(list(Video(source))) == COUNT - cut
    film = checked_copy(source, tmp_path / "film.mp4", first)
    assert 0.0 < film.start < min(KEYS, first + cut + 1) / 30.0


def test_a_film_that_is_held_turned_stays_upright(tmp_path):
    source = make_clip(tmp_path / "walk.mp4", [picture(t) for t in range(10)])
    set_display_matrix(source, QUARTER)
    film = checked_copy(source, tmp_path / "film.mp4")
    image = next(iter(Video(film.path))).image
    assert_allclose(
        corner_colors(image),
        np.rot90(corner_colors(picture(0)).reshape(2, 2, 3), -1).reshape(4, 3),
        atol=CODEC,
    )


def test_no_sound_no_names_and_the_index_in_front(tmp_path, images):
    with av.open(str(tmp_path / "walk.mp4"), "w") as container:
        container.metadata["title"] = "at home"
        stream = container.add_stream("libx264", rate=30)
        sound = container.add_stream("aac", rate=8000)
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        for image in images[:5]:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        container.mux(stream.encode())
        silence = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), format="fltp", layout="mono")
        silence.sample_rate = 8000
        container.mux([*sound.encode(silence), *sound.encode()])
    film = checked_copy(tmp_path / "walk.mp4", tmp_path / "film.mp4")
    with av.open(str(film.path)) as container:
        assert [stream.type for stream in container.streams] == ["video"]
        assert not {"title", "encoder"} & container.metadata.keys()
    stored = film.path.read_bytes()
    assert stored.index(b"moov") < stored.index(b"mdat")


@pytest.mark.parametrize(
    "how",
    [
        {"codec": "mpeg4"},
        {"codec": "libx265"},
        {"pixels": "yuv444p"},
        {"pixels": "yuv420p10le"},
        {"x264": "sar=2/1"},
        {"format": "mpegts"},
        {"format": "avi"},
    ],
    ids=str,
)
def test_what_browsers_may_not_play_is_not_copied(tmp_path, images, how):
    source = make_clip(tmp_path / "walk", images[:6], **how)
    frames = list(Video(source))
    assert copied(source, tmp_path / "film.mp4", 0, times_of(frames), (96, 64)) is None


def test_a_mirrored_film_and_a_folder_are_not_copied(tmp_path, images):
    source = make_clip(tmp_path / "walk.mp4", images[:6])
    times = times_of(list(Video(source)))
    assert copied(source, tmp_path / "film.mp4", 0, times, (96, 64)) is not None
    set_display_matrix(source, (-1, 0, 0, 1))
    assert copied(source, tmp_path / "film.mp4", 0, times, (96, 64)) is None
    assert copied(tmp_path, tmp_path / "film.mp4", 0, times, (96, 64)) is None


def test_frames_at_other_times_than_the_packets_are_not_copied(tmp_path, images):
    source = make_clip(tmp_path / "walk.mp4", images, key_every=KEYS)
    times = times_of(list(Video(source)))
    for wrong in (times + 1e-3 * (times > 0.5), np.append(times, times[-1] + 1 / 30), times[5:]):
        assert copied(source, tmp_path / "film.mp4", 0, wrong, (96, 64)) is None


def test_a_film_whose_first_packets_do_not_decode_is_not_copied(tmp_path, images):
    source = make_clip(tmp_path / "walk.mp4", images, key_every=KEYS)
    with av.open(str(source)) as container, av.open(str(tmp_path / "late.mkv"), "w") as late:
        stream = container.streams.video[0]
        copy = late.add_stream_from_template(stream)
        for packet in list(container.demux(stream))[1:-1]:
            packet.stream = copy
            late.mux(packet)
    frames = list(Video(tmp_path / "late.mkv"))
    assert 0 < len(frames) < COUNT
    assert copied(tmp_path / "late.mkv", tmp_path / "film.mp4", 0, times_of(frames), (96, 64)) is None


def test_encoded_pictures_begin_at_zero_and_odd_sizes_grow(tmp_path):
    times = [0.0, 0.02, 0.09]
    shown = [picture(t)[:63, :95] for t in range(3)]
    film = encoded(tmp_path / "film.mp4", zip(shown, times, strict=True), 30.0, (95, 63))
    assert (film.start, film.size) == (0.0, (96, 64))
    frames = list(Video(film.path))
    assert_allclose([frame.time for frame in frames], times, atol=1e-4)
    assert_allclose(corner_colors(frames[2].image), corner_colors(picture(2)), atol=CODEC)
