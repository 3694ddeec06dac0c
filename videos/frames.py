"""A video file or a folder of numbered images, read one frame at a time.

Every frame carries its own time, so a phone's variable frame rate survives, and times grow whatever the file
says (`videos.times`). Frames come upright: the rotation that phones write beside the picture is applied. A
container's own frame count is only a hint; what counts is what decodes. Pixels are taken as stored; a note
tells where they are not square.
"""

import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from zlib import adler32

import av
import numpy as np
from av.video.frame import VideoFrame
from av.video.reformatter import VideoReformatter

from videos.container import USUAL_FPS, VideoError, announced, decode, opened, stretched, video_stream
from videos.recall import held, recalled
from videos.times import Growing, Repeats
from videos.upright import Image, decoded, upright

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg")
FILM_SUFFIXES = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".mts", ".webm", ".wmv")
# An announced count is an estimate in many containers: a few frames less is no sign of a cut.
MISSING_FRAMES, MISSING_SHARE = 2, 0.05
EARLY = (0, 64, 512)  # frames before it at which a key frame is sought: some containers give the next one
MARKED = 16  # every such frame is marked, so that it is known where a file is entered
SAMPLE = slice(None, None, 16)  # rows whose sum tells two pictures apart: one in each of a codec's blocks
FEWEST_FIELDS = 3  # interlaced frames from which on a film is called interlaced


@dataclass(frozen=True)
class Frame:
    """One picture of a video.

    index : position in decode (presentation) order, from 0
    time  : seconds as the file gives them; the first frame's need not be 0
    image : (height, width, 3) uint8, RGB, upright, read-only
    """

    index: int
    time: float
    image: Image

    def __post_init__(self) -> None:
        self.image.setflags(write=False)


class Video:
    """The frames of a video file, or of a folder of numbered images (png, jpg) ordered by number.

    Iterate over it as often as needed. A short film is decoded once and held (`videos.recall`), another anew
    in each pass, one frame in memory.

    path          : the file or folder, as given
    played        : nominal frames in a second as it is played, the average but for pauses; 30 for a folder
    rate, fps     : its playback speed, 1 as filmed, as given; frames in a second of what was filmed
    width, height : pixels, upright
    count_hint    : about how many frames there are; None where the container does not say
    cut_short     : after a whole pass, one line if frames are missing in the video or at its end, else None
    untimed       : one line on the frame rate of a folder, else None
    mended        : after a pass, how many damaged pictures the decoder repaired; others may refuse them

    Raises:
        VideoError: there is no such file, it is no video, or no frame of it decodes; a folder without
            numbered images. While iterating: an image that cannot be read, or a change of frame size.
    """

    def __init__(self, path: str | Path, rate: float = 1.0) -> None:
        self.path = Path(path)
        self.cut_short: str | None = None
        self.untimed: str | None = None
        self._images: list[Path] = []
        if not self.path.exists():
            raise VideoError(f"no video at {path}; give a video file or a folder of numbered images")
        if self.path.is_dir():
            self.played = USUAL_FPS
            self.untimed = (
                f"a folder of images has no frame rate, {USUAL_FPS:g} is taken; of one with N images a "
                f"second track with --rate {USUAL_FPS:g}/N"
            )
            self._images = _numbered_images(self.path)
            self._about = _gaps(self.path, self._images)
            self.count_hint: int | None = len(self._images)
        else:
            with opened(self.path) as container:
                stream = video_stream(container, self.path)
                self.played, self.count_hint, self._end = announced(container, stream)
                self._about = stretched(self.path, stream)

        self.rate, self.fps = rate, self.played / rate
        self.width = self.height = 0  # until a frame is read
        self._repeats = Repeats()  # of the pass that gave a frame last
        self._marks: dict[int, tuple[int, int]] = {}  # by frame its tick and checksum
        self._enters = True  # whether the file may be entered at one
        self._times, self._fields = Growing(1.0 / self.played), 0  # of the pass that gave a frame last
        self.mended = 0
        first = next(iter(self), None)
        if first is None:
            raise VideoError(f"no frame of {path} could be decoded; record or convert it again")
        self.height, self.width = first.image.shape[:2]

    def __iter__(self) -> Iterator[Frame]:
        """Frames in presentation order, from index 0."""
        seen = Repeats()
        for frame in self._folder_frames() if self._images else self._file_frames():
            seen.next(_checksum(frame.image))
            self._repeats = seen
            yield frame

    @property
    def notes(self) -> list[str]:
        """What a pass over the video repaired or left out, and what its pictures lack, a line each."""
        name, times, seen, interlaced = self.path.name, self._times, self._repeats, None
        if 2 * self._fields > max(times.count, FEWEST_FIELDS):
            interlaced = f"{name} is interlaced, each frame of two moments; deinterlace it for sharper limbs"
        timed = (times.note(name, self.played), seen.note(name, self.played))
        return [line for line in (self.cut_short, *timed, interlaced, self._about) if line]

    def pictures(self, first: int, last: int, every: int = 1) -> Iterator[Image]:
        """The pictures of every `every`-th of the frames first .. last.

        If an earlier pass has come so far, a file is entered at a key frame before `first`; where it gives
        another picture there than before, as not every file can be entered, it is read from its beginning.
        """
        if last < first:
            return
        if self._images:
            those = range(first, min(last + 1, len(self._images)), every)
            yield from (self._sized(t, _read_image(self._images[t])) for t in those)
            return
        rgb, mark = VideoReformatter(), max((t for t in self._marks if t <= first), default=0)
        entered = self._entered(mark, rgb) if mark and self._enters and not self.held else None
        begin, found = (mark, entered) if entered else (0, self._recalled())
        for t, picture in enumerate((each for each in found if each is not None), begin):
            wanted = t >= first and (t - first) % every == 0
            if wanted or (t % MARKED == 0 and t not in self._marks):
                image = self._marked(t, picture, rgb)
            if wanted:
                yield image
            if t >= last:
                return

    def _entered(self, mark: int, rgb: VideoReformatter) -> Iterator[VideoFrame | None] | None:
        """The pictures from a marked frame on; None if the first is not the one that was marked."""
        tick, told = self._marks[mark]
        for early in EARLY:
            found = self._pictures(tick, self._marks[max(mark - early, 0)][0])
            with suppress(av.FFmpegError):
                begin = next(found, None)
                if begin is not None and begin.pts == tick and _checksum(upright(begin, rgb)) == told:
                    return chain([begin], found)
        self._enters = False
        return None

    def _marked(self, index: int, picture: VideoFrame, rgb: VideoReformatter) -> Image:
        """The picture of a frame, marked as one where the file may be entered if it is its turn."""
        image = self._sized(index, upright(picture, rgb))
        if index % MARKED == 0 and picture.pts is not None and index not in self._marks:
            self._marks[index] = picture.pts, _checksum(image)
        return image

    @property
    def held(self) -> bool:
        """Whether all pictures are held in memory, so that they can be read in any order."""
        return bool(held(self.path))

    def picked(self, frames: Iterable[int]) -> Iterator[Image]:
        """Pictures of some frames, if the video is held in memory; else none."""
        found, rgb = held(self.path), VideoReformatter()
        return (upright(found[frame], rgb) for frame in frames if frame < len(found))

    def _folder_frames(self) -> Iterator[Frame]:
        for index, path in enumerate(self._images):
            yield Frame(index, index / self.played, self._sized(index, _read_image(path)))

    def _file_frames(self) -> Iterator[Frame]:
        index, fields, mended, damaged, times = 0, 0, 0, [], Growing(1.0 / self.played)
        rgb = VideoReformatter()
        for picture in self._recalled():
            if picture is None:
                damaged.append(index)
                continue
            time = times.next(picture.time)
            fields += picture.interlaced_frame
            mended += picture.is_corrupt
            self._times, self._fields, self.mended = times, fields, max(mended, self.mended)
            yield Frame(index, time, self._marked(index, picture, rgb))
            index += 1
        self.cut_short = self._shortfall(index, times.last, damaged)

    def _recalled(self) -> Iterator[VideoFrame | None]:
        """All pictures, None for damage; unless their times grow, later readings start at frame 0."""
        last = -math.inf
        for picture in recalled(self.path, self._pictures, self.count_hint):
            if picture is not None:
                self._enters &= picture.pts is not None and picture.pts > last
                last = last if picture.pts is None else picture.pts
            yield picture

    def _pictures(self, tick: int | None = None, sought: int = 0) -> Iterator[VideoFrame | None]:
        """All pictures, or those from the first one at or after a tick on, decoded from a key frame that is
        sought near another tick; None for damage."""
        begun = tick is None
        with opened(self.path) as container:
            stream = video_stream(container, self.path)
            if tick is not None:
                container.seek(sought, stream=stream)
            for picture in decode(container, stream):
                if picture is not None and stream.time_base is not None:
                    picture.time_base = stream.time_base  # the last pictures of a film lack it
                if tick is not None and picture is not None and picture.pts is not None:
                    begun = begun or picture.pts >= tick
                if begun:
                    yield picture

    def _sized(self, index: int, image: Image) -> Image:
        """The picture of a frame; VideoError if it is not as large as that of the first."""
        height, width = image.shape[:2]
        if self.width and (height, width) != (self.height, self.width):
            where = self._images[index].name if self._images else f"frame {index}"
            raise VideoError(
                f"{where} of {self.path} is {width}x{height}, the frames before it are "
                f"{self.width}x{self.height}; bring all to one size"
            )
        return image

    def _shortfall(self, count: int, last: float, damaged: list[int]) -> str | None:
        """One line on missing frames; `last` is the last one's time, `damaged` lists those that follow
        damage."""
        hint, name = self.count_hint or 0, self.path.name
        if self._end is not None:
            hint = count + round((self._end - last) * self.played) - 1
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


def count_to(video: Video, last: int | None) -> int | None:
    """About how many frames there are up to frame `last`, None for the film's last; None if unknown."""
    counts = (video.count_hint, None if last is None else last + 1)
    return min((count for count in counts if count is not None), default=None)


def files_of(path: Path) -> list[Path]:
    """The files that a video is read from."""
    return _numbered_images(path) if path.is_dir() else [path]


def _shown(folder: Path) -> Iterator[Path]:
    """The files of a folder, without hidden ones."""
    return (path for path in folder.iterdir() if not path.name.startswith("."))


def _checksum(image: Image) -> int:
    return adler32(image[SAMPLE].tobytes())


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
            f"only {len(found)} without a number; give a video file or number the images "
            "('figtrack batch' takes a folder of films)"
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
