"""A video file's container: its stream of pictures, what it announces, and all that can be decoded."""

import math
import os
import re
from collections.abc import Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path

import av
from av.container import InputContainer
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from videos.times import FASTEST, rate_between_pauses, rate_of

USUAL_FPS = 30.0  # where nothing tells the rate, as of a folder of pictures
SQUARE = 0.02  # ratios of a pixel's sides nearer to 1 count as 1
TIMED = 600  # packets whose times tell of pauses, and the frame rate where the container gives none
LASTS = re.compile(r"(\d+):(\d+):(\d+\.?\d*)")  # the duration that Matroska's tags tell of a stream
JOINED = 1.0  # seconds by which a packet's time goes back where another recording begins


class VideoError(Exception):
    """A video file or folder that cannot be read, or written, as asked."""


def opened(path: Path) -> InputContainer:
    """The container of a video file; raises VideoError where there is none."""
    if not path.is_file():  # a pipe or a device may have no end
        raise VideoError(f"{path} is no ordinary file; save the video as one")
    if path.stat().st_size == 0:
        raise VideoError(f"{path} is empty (0 bytes); copy or record it again")
    try:
        # An absolute path, or a colon in the name would read as a protocol.
        return av.open(os.path.abspath(path), metadata_errors="replace")
    except (av.FFmpegError, OSError) as error:
        raise VideoError(
            f"{path} is not a video that can be read ({error.strerror}); "
            "if its recording was cut off, convert it again from the original"
        ) from error


def video_stream(container: InputContainer, path: Path) -> VideoStream:
    """The first stream of pictures that is no cover; raises VideoError where there is none."""
    streams = [s for s in container.streams.video if not s.disposition & s.disposition.attached_pic]
    if streams and streams[0].codec_context is None:  # PyAV would crash on it
        raise VideoError(f"{path} does not say how its pictures are coded; copy or convert it again")
    # FFmpeg takes any text file for a terminal's screen and renders it.
    text = container.format.name == "tty"
    if text or not streams:
        kinds = ["text"] if text else sorted({stream.type for stream in container.streams})
        raise VideoError(f"{path} has no video in it, only {' and '.join(kinds)}; give a video file")
    return streams[0]


def announced(container: InputContainer, stream: VideoStream) -> tuple[float, int | None, float | None]:
    """Frames per second, about how many frames the container announces, and when the last of them ends.

    The end, in seconds, is told of Matroska alone, which counts no frames and whose rate is only nominal; 0
    where it is unknown.
    """
    rate = stream.average_rate or stream.guessed_rate or stream.base_rate
    known = float(rate) if rate and rate < FASTEST else None  # others are those of clocks: Matroska's is 1000
    times = list(_packet_times(container, stream))
    average = known or rate_of(times) or USUAL_FPS
    if "matroska" in container.format.name:
        fps = rate_between_pauses(times, average) or average
        late = max(container.start_time or 0, 0)  # the duration counts from time zero
        seconds = ((container.duration or late) - late) / av.time_base
        return fps, round(seconds * fps) or None, _matroska_end(container, stream)
    fps = rate_between_pauses(times) or average
    seconds = 0.0
    if stream.duration and stream.time_base:
        seconds = float(stream.duration * stream.time_base)
    elif container.duration:
        seconds = container.duration / av.time_base
    # A clip trimmed on a phone has a shorter duration but its old frame count, hence the lesser.
    counts = stream.frames, round(seconds * average)
    return fps, min((count for count in counts if count), default=None), None


def _matroska_end(container: InputContainer, stream: VideoStream) -> float:
    """When the last picture ends, seconds; 0 if unknown, as a sound may last longer than the pictures."""
    if told := LASTS.fullmatch(stream.metadata.get("DURATION", "")):
        hours, minutes, seconds = map(float, told.groups())
        return 3600.0 * hours + 60.0 * minutes + seconds
    return 0.0 if container.streams.audio else (container.duration or 0) / av.time_base


def stretched(path: Path, stream: VideoStream) -> str | None:
    """One line on pixels that are not square."""
    wide = float(stream.sample_aspect_ratio or stream.codec_context.sample_aspect_ratio or 1)
    if abs(wide - 1.0) < SQUARE:
        return None
    return (
        f"the pixels of {path.name} are not square ({wide:.3g} to 1), so lengths and angles are wrong; "
        "convert it to square ones"
    )


def _packet_times(container: InputContainer, stream: VideoStream) -> Iterator[float]:
    """Times of the first packets, seconds, up to the first damage, or another recording joined to it."""
    latest = -math.inf
    with suppress(av.FFmpegError):
        for packet in islice(container.demux(stream), TIMED):
            if packet.pts is not None:
                time = float(packet.pts * packet.time_base)
                if time < latest - JOINED:
                    return
                latest = max(latest, time)
                yield time


def decode(container: InputContainer, stream: VideoStream) -> Iterator[VideoFrame | None]:
    """All pictures that can be decoded; None stands for damage after the first picture.

    Failures before the first picture are ignored: a recording may begin between key frames.
    """
    started = failed = ended = False
    packets = container.demux(stream)
    while not ended:
        pictures: list[VideoFrame] = []
        try:
            packet = next(packets, None)
            ended = packet is None or not packet.size  # then the decoder gives the pictures it still holds
            pictures = stream.codec_context.decode(None if ended else packet)
        except MemoryError:  # also a subclass of FFmpeg's errors
            raise
        except av.FFmpegError:
            failed = started
        if pictures and failed and not ended:
            yield None
            failed = False
        started = started or bool(pictures)
        yield from pictures
    if failed:
        yield None
