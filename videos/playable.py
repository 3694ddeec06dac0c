"""A part of a film as an mp4 that a browser plays, frame for frame.

The packets of an H.264 film are copied, which takes milliseconds. They begin at the IDR picture at or before
the first frame that is asked for, which is then shown later than at 0. Any other film is encoded again.
"""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from itertools import dropwhile
from pathlib import Path

import av
import numpy as np
from av.container import InputContainer
from av.packet import Packet
from av.video.stream import VideoStream
from numpy.typing import NDArray

from videos.container import opened, video_stream
from videos.upright import Image, display_matrix
from videos.writer import Writer

Array = NDArray[np.float64]
Ticks = list[tuple[int, int]]  # of packets

PIXELS = ("yuv420p", "yuvj420p")  # 8 bits, 4:2:0: what browsers decode
AVCC = b"\x01"  # how parameter sets of mp4 and mkv begin
IDR = 5  # type of an H.264 unit where a decoder may begin: no later picture refers to an earlier one
SAME = 1e-6  # seconds within which two times are those of one frame


@dataclass(frozen=True)
class Playable:
    """A video file that browsers can play.

    path  : of the mp4
    start : seconds in it at which the first frame that was asked for is shown
    size  : (width, height) as it is shown, pixels
    """

    path: Path
    start: float
    size: tuple[int, int]


def copied(source: Path, path: Path, first: int, times: Array, size: tuple[int, int]) -> Playable | None:
    """Packets of the frames first .. first + T - 1 of a film, copied into an mp4 without sound and names.

    `times` (T,) are their seconds since frame 0, as decoded by `videos.frames`; `size` is (width, height) of
    a frame, upright, pixels. None where a browser may not show exactly these frames at these times: a folder
    of images, another codec, pixels that are not square, mirrored pictures, packets that do not come to one
    frame each at its time.
    """
    if not source.is_file():
        return None
    with suppress(av.FFmpegError):
        base = _first_tick(source)
        with opened(source) as container:
            stream = video_stream(container, source)
            found = None if base is None else _found(container, stream, base, first, times)
            if found is not None:
                begin, ticks, start = found
                return Playable(path, start, size) if _copy(container, stream, begin, ticks, path) else None
    return None


def encoded(
    path: Path, pictures: Iterable[tuple[Image, float]], fps: float, size: tuple[int, int]
) -> Playable:
    """Pictures, each with its time in seconds from 0, encoded; odd sizes are padded as in `videos.writer`."""
    with Writer(path, fps, size, quick=True) as writer:
        for image, time in pictures:
            writer.write(image, time)
    width, height = size
    return Playable(path, 0.0, (width + width % 2, height + height % 2))


def _first_tick(source: Path) -> int | None:
    """The pts of the first picture that decodes; None if a browser would show it differently."""
    with opened(source) as container:
        stream = video_stream(container, source)
        picture = next(container.decode(stream), None) if _plays(stream) else None
    return None if picture is None or not _turned(*display_matrix(picture)) else picture.pts


def _plays(stream: VideoStream) -> bool:
    """Whether browsers decode the stream, from an mp4."""
    codec = stream.codec_context
    square = {stream.sample_aspect_ratio or 1, codec.sample_aspect_ratio or 1} == {1}
    avcc = (codec.extradata or b"")[:1] == AVCC
    return codec.name == "h264" and codec.pix_fmt in PIXELS and avcc and square


def _turned(a: int, b: int, c: int, d: int) -> bool:
    """Whether a display matrix is a rotation by right angles."""
    return (a, b) == (d, -c) and (a == 0) != (b == 0)


def _found(
    container: InputContainer, stream: VideoStream, base: int, first: int, times: Array
) -> tuple[int, Ticks, float] | None:
    """The packets of the frames at `times`, seconds after tick `base`, and those they are decoded from: pts
    of the first, pts and dts of each after it, and seconds after it at which the first frame is shown."""
    tick = float(stream.time_base or 1)  # seconds
    listed = _listed(container, stream, base + round(times[-1] / tick))
    if listed is None:
        return None
    pts, begins, shown = listed.T
    order = np.flatnonzero(shown)[np.argsort(pts[shown > 0], kind="stable")]
    wanted = order[first : first + len(times)]
    if len(wanted) < len(times) or np.abs((pts[wanted] - base) * tick - times).max() > SAME:
        return None
    before = np.flatnonzero(begins[: wanted.min() + 1])
    if not len(before):
        return None
    k, end = before[-1], wanted.max() + 1
    shows = pts[k:end] - pts[k]
    decodes = np.sort(shows)  # one after the other,
    decodes -= (decodes - shows).max()  # and each before it is shown
    ticks = list(zip(shows.tolist(), decodes.tolist(), strict=True))
    return int(pts[k]), ticks, float(shows[wanted[0] - k] * tick)


def _listed(container: InputContainer, stream: VideoStream, last: int) -> NDArray[np.int64] | None:
    """(N, 3) for each packet up to a tick: pts, whether a decoder may begin with it, whether it is shown."""
    rows = []
    size = 1 + ((stream.codec_context.extradata or bytes(5))[4] & 3)
    for packet in container.demux(stream):
        if not packet.size:
            break
        if packet.pts is None or packet.is_corrupt or packet.has_sidedata("new_extradata"):
            return None
        if packet.dts is not None and packet.dts > last:
            break  # what comes from here on is shown after it
        rows.append((packet.pts, _has_idr(packet, size), not packet.is_discard))
    return np.array(rows, np.int64).reshape(-1, 3)


def _has_idr(packet: "Packet[VideoStream]", size: int) -> bool:
    """Whether one of the units in a packet, each after its length of `size` bytes, is of an IDR picture."""
    data, at = bytes(packet) if packet.is_keyframe else b"", 0
    while at + size < len(data):
        if data[at + size] & 31 == IDR:
            return True
        at += size + int.from_bytes(data[at : at + size], "big")
    return False


def _copy(container: InputContainer, stream: VideoStream, begin: int, ticks: Ticks, path: Path) -> bool:
    """Write the packets; whether all of them came."""
    container.seek(begin, stream=stream)
    packets = (packet for packet in container.demux(stream) if packet.size)
    stretch = dropwhile(lambda packet: packet.pts != begin, packets)
    copies = 0
    options = {"movflags": "+faststart", "fflags": "+bitexact"}  # bitexact omits the encoder's name
    with av.open(str(path.absolute()), "w", format="mp4", options=options) as film:
        copy = film.add_stream_from_template(stream)
        for packet, own in zip(stretch, ticks, strict=False):
            (packet.pts, packet.dts), packet.stream = own, copy
            film.mux(packet)
            copies += 1
    return copies == len(ticks)
