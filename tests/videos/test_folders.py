"""Folders of numbered pictures read as films: order, sizes, PNG and JPEG; a film of JPEG frames."""

import io
from fractions import Fraction

import av
import cv2
import numpy as np
import PIL.Image
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.videos.clips import HEIGHT, WIDTH, picture
from videos.container import VideoError
from videos.frames import Video, files_of, films_in


def write_images(folder, names):
    for t, name in enumerate(names):
        cv2.imwrite(str(folder / name), np.full((6, 8, 3), 10 * t, np.uint8))


def test_a_folder_is_entered_at_any_picture(tmp_path):
    write_images(tmp_path, [f"{t}.png" for t in range(5)])
    video = Video(tmp_path)
    assert [int(image[0, 0, 0]) for image in video.pictures(1, 9, 2)] == [10, 30]


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
    write_images(tmp_path, names)
    notes = Video(tmp_path).notes
    assert notes == [] if said is None else said in notes[0]


def test_images_of_another_size_are_an_error_that_names_the_file(tmp_path):
    write_images(tmp_path, ["1.png", "2.png"])
    cv2.imwrite(str(tmp_path / "3.png"), np.zeros((7, 8, 3), np.uint8))
    with pytest.raises(VideoError, match=r"3\.png .* is 8x7, .* are 8x6; bring all to one size"):
        list(Video(tmp_path))


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_a_png_is_rgb_whatever_its_channels_and_its_name(tmp_path, rng, channels):
    stored = rng.integers(0, 256, (9, 12, channels), dtype=np.uint8)
    png = cv2.imencode(".png", stored)[1].tobytes()
    (tmp_path / "1.png").write_bytes(png)
    (tmp_path / "2.jpg").write_bytes(png)
    wanted = stored[..., [2, 1, 0]] if channels > 1 else stored.repeat(3, axis=2)
    for frame in Video(tmp_path):
        assert_array_equal(frame.image, wanted)


def jpeg(stored, orientation=1):
    """A JPEG picture with the orientation that a camera notes."""
    notes, file = PIL.Image.Exif(), io.BytesIO()
    notes[0x0112] = orientation
    image = PIL.Image.fromarray(stored)
    image.save(file, "jpeg", quality=95, subsampling="4:4:4", exif=notes)
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
