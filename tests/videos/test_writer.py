import av
import numpy as np
import pytest
from numpy.testing import assert_allclose

from videos.container import VideoError
from videos.frames import Video
from videos.writer import Writer

RED, BLUE = (200, 40, 30), (20, 60, 220)


def two_halves(height, width):
    image = np.full((height, width, 3), RED, np.uint8)
    image[:, width // 2 :] = BLUE
    return image


def write_clip(path, count=6, size=(64, 48), fps=25.0, quick=False):
    with Writer(path, fps, size, quick=quick) as writer:
        for t in range(count):
            writer.write(two_halves(size[1], size[0]), t / fps)


@pytest.mark.parametrize("quick", [False, True])
def test_what_is_written_is_read_back_and_plays_in_a_browser(tmp_path, quick):
    path = tmp_path / "overlay.mp4"
    write_clip(path, count=12, quick=quick)
    video = Video(path)
    frames = list(video)
    assert (video.fps, video.width, video.height, len(frames)) == (25.0, 64, 48, 12)
    assert_allclose([frame.time for frame in frames], np.arange(12) / 25, atol=1e-4)
    # Flat colours at the default crf, away from the edge, through yuv420p and back.
    assert_allclose(frames[5].image[10:40, 5:25].mean((0, 1)), RED, atol=6)
    assert_allclose(frames[5].image[10:40, 40:60].mean((0, 1)), BLUE, atol=6)
    with av.open(str(path)) as container:
        codec = container.streams.video[0].codec_context
        assert (codec.name, codec.pix_fmt) == ("h264", "yuv420p")
    stored = path.read_bytes()
    assert stored.index(b"moov") < stored.index(b"mdat")


@pytest.mark.parametrize("quick", [False, True])
def test_quick_encoding_looks_ahead_at_no_frames_codes_simply_and_takes_one_thread(tmp_path, quick):
    write_clip(tmp_path / "a.mp4", size=(64, 240), quick=quick)
    stored = (tmp_path / "a.mp4").read_bytes()  # x264 leaves its settings in the stream
    assert (b" rc_lookahead=" not in stored) is quick
    assert (b" cabac=0 " in stored) is quick
    assert (b" threads=1 " in stored) is quick


def test_odd_sizes_grow_by_their_last_column_and_row(tmp_path):
    write_clip(tmp_path / "overlay.mp4", size=(33, 21))
    video = Video(tmp_path / "overlay.mp4")
    assert (video.width, video.height) == (34, 22)
    image = next(iter(video)).image
    assert_allclose(image[21, 24:].mean(0), BLUE, atol=10)
    assert_allclose(image[:, 33].mean(0), BLUE, atol=10)


def test_frames_keep_the_times_they_are_given(tmp_path):
    with Writer(tmp_path / "overlay.mp4", 10.0, (32, 32)) as writer:
        for time in (0.5, 0.53, 0.6, 0.61, 0.9):
            writer.write(two_halves(32, 32), time)
    found = [frame.time for frame in Video(tmp_path / "overlay.mp4")]
    assert_allclose(found, [0.5, 0.53, 0.6, 0.61, 0.9], atol=1e-4)


@pytest.mark.parametrize("written", [0, 3, 80])
def test_an_interrupted_writer_leaves_nothing(tmp_path, written):
    def interrupted():
        with Writer(tmp_path / "overlay.mp4", 25.0, (64, 48)) as writer:
            for t in range(written):
                writer.write(two_halves(48, 64), t / 25.0)
            assert not (tmp_path / "overlay.mp4").exists()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert list(tmp_path.iterdir()) == []


def test_an_earlier_video_is_replaced_by_a_complete_one_and_by_no_other(tmp_path):
    path = tmp_path / "overlay.mp4"
    write_clip(path)
    before = path.read_bytes()

    def broken():
        with Writer(path, 25.0, (64, 48)) as writer:
            writer.write(two_halves(48, 64), 0.0)
            writer.write(two_halves(50, 64), 0.04)

    with pytest.raises(ValueError, match="like the video"):
        broken()
    assert path.read_bytes() == before
    write_clip(path, count=5)
    assert len(list(Video(path))) == 5
    assert list(tmp_path.iterdir()) == [path]


def test_a_video_without_images_is_an_error_and_no_file(tmp_path):
    with pytest.raises(VideoError, match="no image was written"), Writer(tmp_path / "a.mp4", 25.0, (8, 8)):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_does_not_exist_is_an_error(tmp_path):
    with (
        pytest.raises(VideoError, match=r"there is no folder .*; make it first"),
        Writer(tmp_path / "runs" / "a.mp4", 25.0, (8, 8)),
    ):
        pass


def test_times_that_do_not_grow_are_an_error(tmp_path):
    with Writer(tmp_path / "a.mp4", 25.0, (32, 32)) as writer:
        writer.write(two_halves(32, 32), 0.2)
        with pytest.raises(ValueError, match=r"times must grow .* 0\.2 s comes after 0\.2000 s"):
            writer.write(two_halves(32, 32), 0.2)


def test_a_larger_crf_makes_a_smaller_file(tmp_path, rng):
    images = [rng.integers(0, 256, (48, 64, 3), dtype=np.uint8) for _ in range(5)]
    for crf in (15, 40):
        with Writer(tmp_path / f"{crf}.mp4", 25.0, (64, 48), crf=crf) as writer:
            for t, image in enumerate(images):
                writer.write(image, t / 25.0)
    assert (tmp_path / "40.mp4").stat().st_size < 0.5 * (tmp_path / "15.mp4").stat().st_size
