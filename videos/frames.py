"""A video file or a folder of numbered images, read one frame at a time.

Every frame carries its own time, so a phone's variable frame rate survives, and times grow whatever the file
says (`videos.times`). Frames come upright: the rotation that phones write beside the picture is applied. A
container's own frame count is only a hint; what counts is what decodes. Pixels are taken as stored; a note
tells where they are not square.
"""

import os
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import av
import numpy as np
from av.container import InputContainer
from av.video.frame import VideoFrame
from av.video.reformatter import VideoReformatter
from av.video.stream import VideoStream

from videos.recall import held, recalled
from videos.times import FASTEST, Growing, rate_between_pauses, rate_of
from videos.upright import Image, decoded, upright

FOLDER_FPS = 30.0
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg")
FILM_SUFFIXES = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".mts", ".webm", ".wmv")
# An announced count is an estimate in many containers: a few frames less is no sign of a cut.
MISSING_FRAMES, MISSING_SHARE = 2, 0.05
UNEVEN_FRAMES, UNEVEN_SHARE = 2, 0.02  # number, share of early or late frames without a warning
SQUARE = 0.02  # ratios of a pixel's sides nearer to 1 count as 1
TIMED = 3000  # packets whose times tell of pauses, and the frame rate where the container gives none
FEWEST_FIELDS = 3  # interlaced frames from which on a film is called interlaced


class VideoError(Exception):
    """A video file or folder that cannot be read, or written, as asked."""


@dataclass(frozen=True)
class Frame:
    """One picture of a video.

    index : position in decode (presentation) order, from 0
    time  : seconds as the file gives them; the first frame's need not be 0
    image : (height, width, 3) uint8, RGB, upright, read-only
    tick  : its time in the file's own unit, None if it has none
    """

    index: int
    time: float
    image: Image
    tick: int | None = None

    def __post_init__(self) -> None:
        if self.image.dtype != np.uint8 or self.image.ndim != 3 or self.image.shape[2] != 3:
            raise ValueError(
                f"image must be (height, width, 3) uint8, not {self.image.shape} {self.image.dtype}"
            )
        image = self.image.view()
        image.setflags(write=False)
        object.__setattr__(self, "image", image)


class Video:
    """The frames of a video file, or of a folder of numbered images (png, jpg) ordered by number.

    Iterate over it as often as needed. A short film is decoded once and held (`videos.recall`), another anew
    in each pass, one frame in memory.

    path          : the file or folder, as given
    fps           : nominal frames per second, the average but for pauses; 30 for a folder
    width, height : pixels, upright
    count_hint    : about how many frames there are; None where the container does not say
    cut_short     : after a whole pass, one line if frames are missing in the video or at its end, else None
    gaps          : one line if a folder's numbers have gaps or occur twice, else None
    retimed       : after a pass, one line if times that repeat or go back were put right, else None
    uneven        : after a pass, one line if many frames follow early or late, else None
    interlaced    : after a pass, one line if most frames are of two fields, else None
    stretched     : one line if pixels are not square, else None
    mended        : after a pass, how many damaged pictures the decoder repaired; others may refuse them

    Raises:
        VideoError: there is no such file, it is no video, or no frame of it decodes; a folder without
            numbered images. While iterating: an image that cannot be read, or a change of frame size.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.cut_short: str | None = None
        self.gaps: str | None = None
        self.stretched: str | None = None
        self._images: list[Path] = []
        if not self.path.exists():
            raise VideoError(f"no video at {path}; give a video file or a folder of numbered images")
        if self.path.is_dir():
            self.fps = FOLDER_FPS
            self._images = _numbered_images(self.path)
            self.gaps = _gaps(self.path, self._images)
            self.count_hint: int | None = len(self._images)
        else:
            with opened(self.path) as container:
                stream = video_stream(container, self.path)
                self.fps, self.count_hint = _announced(container, stream)
                self.stretched = _stretched(self.path, stream)

        self._times, self._fields = Growing(1.0 / self.fps), 0  # of the pass that gave a frame last
        self.mended = 0
        first = next(iter(self), None)
        if first is None:
            raise VideoError(f"no frame of {path} could be decoded; record or convert it again")
        self.height, self.width = first.image.shape[:2]

    def __iter__(self) -> Iterator[Frame]:
        """Frames in presentation order, from index 0."""
        size = None
        for frame in self._folder_frames() if self._images else self._file_frames():
            height, width = frame.image.shape[:2]
            size = size or (width, height)
            if (width, height) != size:
                where = self._images[frame.index].name if self._images else f"frame {frame.index}"
                raise VideoError(
                    f"{where} of {self.path} is {width}x{height}, the frames before it are "
                    f"{size[0]}x{size[1]}; bring all to one size"
                )
            yield frame

    @property
    def retimed(self) -> str | None:
        if not (wrong := self._times.wrong):
            return None
        times = "one time" if wrong == 1 else f"{wrong} times"
        return (
            f"{times} of frames in {self.path.name} did not grow and were put right; figures by time may be "
            "off there"
        )

    @property
    def uneven(self) -> str | None:
        times = self._times
        if times.wrong or times.uneven <= max(UNEVEN_FRAMES, UNEVEN_SHARE * times.count):
            return None
        return (
            f"{times.uneven} of {times.count} frames of {self.path.name} come early or late for "
            f"{self.fps:.4g} a second; motion is taken as if they were even"
        )

    @property
    def interlaced(self) -> str | None:
        if 2 * self._fields <= max(self._times.count, FEWEST_FIELDS):
            return None
        return f"{self.path.name} is interlaced, each frame of two moments; deinterlace it for sharper limbs"

    @property
    def notes(self) -> list[str]:
        """What a pass over the video repaired or left out, a line each."""
        said = (self.cut_short, self.retimed, self.uneven, self.interlaced, self.stretched, self.gaps)
        return [line for line in said if line]

    def since(self, index: int, tick: int | None) -> Iterator[Image]:
        """Pictures from a frame on, decoded from the key frame before it; `tick` is that frame's.

        Not every file can be read from its middle: there may be no pictures or others; the caller compares.
        """
        if self._images or tick is None:
            yield from (_read_image(path) for path in self._images[index:])
            return
        with suppress(av.FFmpegError), opened(self.path) as container:
            stream = video_stream(container, self.path)
            container.seek(tick, stream=stream)
            rgb = VideoReformatter()
            for picture in _decoded(container, stream):
                if picture is None:
                    return
                if picture.pts is not None and picture.pts >= tick:
                    yield upright(picture, rgb)

    @property
    def held(self) -> bool:
        """Whether all pictures are held in memory, so that they can be read in any order."""
        return bool(held(self.path))

    def picked(self, frames: Iterable[int]) -> Iterator[Image]:
        """Pictures of some frames, if the video is held in memory; else none."""
        pictures, rgb = held(self.path), VideoReformatter()
        return (upright(pictures[frame], rgb) for frame in frames if frame < len(pictures))

    def _folder_frames(self) -> Iterator[Frame]:
        for index, path in enumerate(self._images):
            yield Frame(index, index / self.fps, _read_image(path))

    def _file_frames(self) -> Iterator[Frame]:
        index, fields, mended, damaged, times = 0, 0, 0, [], Growing(1.0 / self.fps)
        rgb = VideoReformatter()
        for picture in recalled(self.path, self._pictures, self.count_hint):
            if picture is None:
                damaged.append(index)
                continue
            time = times.next(picture.time)
            fields += picture.interlaced_frame
            mended += picture.is_corrupt
            self._times, self._fields, self.mended = times, fields, max(mended, self.mended)
            yield Frame(index, time, upright(picture, rgb), picture.pts)
            index += 1
        self.cut_short = self._shortfall(index, damaged)

    def _pictures(self) -> Iterator[VideoFrame | None]:
        with opened(self.path) as container:
            stream = video_stream(container, self.path)
            for picture in _decoded(container, stream):
                if picture is not None and stream.time_base is not None:
                    picture.time_base = stream.time_base  # the last pictures of a film lack it
                yield picture

    def _shortfall(self, count: int, damaged: list[int]) -> str | None:
        """One line on missing frames; `damaged` lists the frames that follow damage."""
        hint, name = self.count_hint or 0, self.path.name
        within = [index for index in damaged if index < count]
        if within:
            return (
                f"{name} is damaged, first after frame {within[0] - 1}; what cannot be decoded was left out"
            )
        if hint - count > max(MISSING_FRAMES, MISSING_SHARE * hint):
            return f"{name} ends after {count} of about {hint} frames; what was read was used"
        if damaged:
            return f"{name} cannot be decoded past frame {count - 1}; what was read was used"
        return None


def images_of(video: Iterable[Frame], wanted: Collection[int]) -> dict[int, Image]:
    """The images of some frames by number, in one pass that ends with the last of them."""
    return {frame.index: frame.image for frame in islice(video, max(wanted) + 1) if frame.index in wanted}


def films_in(folder: Path) -> list[Path]:
    """The video files of a folder, by their suffix, sorted by name."""
    return sorted(path for path in _shown(folder.absolute()) if path.suffix.lower() in FILM_SUFFIXES)


def files_of(path: Path) -> list[Path]:
    """The files that a video is read from."""
    return _numbered_images(path) if path.is_dir() else [path]


def _shown(folder: Path) -> Iterator[Path]:
    """The files of a folder, without hidden ones."""
    return (path for path in folder.iterdir() if not path.name.startswith("."))


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


def _announced(container: InputContainer, stream: VideoStream) -> tuple[float, int | None]:
    """Frames per second, and about how many frames the container announces."""
    rate = stream.average_rate or stream.guessed_rate or stream.base_rate
    known = float(rate) if rate and rate < FASTEST else None  # others are those of clocks: Matroska's is 1000
    times = list(_packet_times(container, stream))
    average = known or rate_of(times) or FOLDER_FPS
    fps = rate_between_pauses(times) or average
    seconds = 0.0
    if stream.duration and stream.time_base:
        seconds = float(stream.duration * stream.time_base)
    elif container.duration:
        seconds = container.duration / av.time_base
    # A clip trimmed on a phone has a shorter duration but its old frame count, hence the lesser.
    counts = stream.frames, round(seconds * average)
    return fps, min((count for count in counts if count), default=None)


def _stretched(path: Path, stream: VideoStream) -> str | None:
    """One line on pixels that are not square."""
    wide = float(stream.sample_aspect_ratio or stream.codec_context.sample_aspect_ratio or 1)
    if abs(wide - 1.0) < SQUARE:
        return None
    return (
        f"the pixels of {path.name} are not square (width to height {wide:.3g}), so lengths and angles are "
        "wrong; convert it to square ones"
    )


def _packet_times(container: InputContainer, stream: VideoStream) -> Iterator[float]:
    """Times of the first packets, seconds, up to the first damage."""
    with suppress(av.FFmpegError):
        packets = islice(container.demux(stream), TIMED)
        yield from (float(each.pts * each.time_base) for each in packets if each.pts is not None)


def _decoded(container: InputContainer, stream: VideoStream) -> Iterator[VideoFrame | None]:
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


def _read_image(path: Path) -> Image:
    try:
        return decoded(path.read_bytes())
    except (OSError, ValueError, av.FFmpegError) as error:
        raise VideoError(f"cannot read {path} as an image; replace it or remove it") from error


def _numbered_images(folder: Path) -> list[Path]:
    """Images whose name holds a number, img2 before img10."""
    found = [path for path in _shown(folder) if path.suffix.lower() in IMAGE_SUFFIXES]
    numbered = [path for path in found if re.search(r"\d", path.stem)]
    if not numbered:
        raise VideoError(
            f"{folder} holds no numbered images (img1.png, img2.png, or jpg), "
            f"only {len(found)} without a number; give a video file or number the images"
        )
    return sorted(numbered, key=_natural)


def _gaps(folder: Path, images: list[Path]) -> str | None:
    """What numbers are missing or double, by the last number of each name and the commonest step."""
    numbers = np.array([int(re.findall(r"\d+", path.stem)[-1]) for path in images], dtype=object)
    if len(numbers) < 3:
        return None
    steps = np.diff(numbers)
    usual = Counter(steps[steps != 0] if steps.any() else steps).most_common(1)[0][0]
    odd = np.flatnonzero(steps != usual)
    if usual < 0 or not len(odd):
        return None
    before, after = images[odd[0]].name, images[odd[0] + 1].name
    return (
        f"the pictures of {folder} are not numbered evenly, first from {before} to {after}; "
        "they are taken as if they were"
    )


def _natural(path: Path) -> tuple[list[tuple[str, int]], str]:
    parts = re.findall(r"(\D*)(\d+)", path.stem)
    return [(text.lower(), int(number)) for text, number in parts], path.name
