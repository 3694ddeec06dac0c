"""Files that are cut or damaged: what can be decoded is read, and the user is told what is missing."""

from types import SimpleNamespace

import av
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.videos.clips import make_clip, noise, picture
from videos.container import VideoError, decode
from videos.frames import Video


# No decoder notices the cut of the latter, whose clock counts milliseconds: it shows in the count.
@pytest.mark.parametrize(("format", "clock"), [("mp4", 1e-4), ("matroska", 1e-3)])
def test_a_file_cut_in_the_middle_gives_its_whole_frames_and_says_so(tmp_path, rng, format, clock):
    path = make_clip(tmp_path / "walk", noise(40, rng), format=format)
    whole = [frame.image for frame in Video(path)]
    stored = path.read_bytes()
    path.write_bytes(stored[: len(stored) // 2])

    video = Video(path)
    frames = list(video)
    assert 10 < len(frames) < 30
    assert all(np.array_equal(frame.image, whole[frame.index]) for frame in frames)
    assert_allclose([frame.time for frame in frames], np.arange(len(frames)) / 30, atol=clock)
    said = f"walk ends after {len(frames)} of about 40 frames; what was read was used"
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


def test_matroska_with_a_pause_or_a_longer_sound_is_not_called_cut_short(tmp_path):
    ticks = [33 * t + 9000 * (t > 20) for t in range(40)]
    paused = make_clip(
        tmp_path / "paused.mkv", [picture(t) for t in range(40)], ticks=ticks, format="matroska"
    )
    sounding = tmp_path / "sounding.mkv"
    with av.open(str(paused)) as source, av.open(str(sounding), "w") as container:
        shown = container.add_stream_from_template(source.streams.video[0])
        heard = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        for packet in source.demux():
            if packet.size:
                packet.stream = shown
                container.mux(packet)
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 20 * 8000), np.int16), layout="mono")
        sound.sample_rate, sound.pts = 8000, 0
        container.mux([*heard.encode(sound), *heard.encode()])
    with av.open(str(sounding)) as container:
        assert container.duration > 19e6
    untold = tmp_path / "untold.mkv"
    untold.write_bytes(sounding.read_bytes().replace(b"DURATION", b"ANYTHING"))
    for path in (paused, sounding, untold):
        video = Video(path)
        assert sum(1 for _ in video) == 40
        assert video.cut_short is None


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
