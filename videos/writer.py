"""Frames to an h264 video that plays in a browser.

The video is written beside its final place under another name and renamed when it is complete.
"""

from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from types import TracebackType

import av
import cv2
import numpy as np
from av.video.reformatter import Colorspace, VideoReformatter

from videos.container import VideoError
from videos.times import CLOCK
from videos.upright import Image

CRF = 20
# More threads save no CPU time, and each holds frames in memory; fast decoding settings also encode fast.
QUICK = {"preset": "superfast", "tune": "fastdecode", "threads": "1"}


class Writer:
    """A context manager that takes images and leaves one mp4 file.

    Args:
        path: final name; a file already there is replaced when the new one is complete.
        fps: nominal frames per second, at most CLOCK.
        size: (width, height) of every image, pixels; odd sizes are padded by repeating the last
            column and row, because h264 in browsers takes even sizes only.
        crf: quality, 0 (lossless) to 51 (worst).
        quick: whether encoding is to cost about a quarter of the time, for a file up to a half larger.

    Raises:
        ValueError: an image of another size; a time that does not grow.
        VideoError: the folder does not exist or cannot be written; no image was written.
    """

    def __init__(
        self, path: str | Path, fps: float, size: tuple[int, int], *, crf: int = CRF, quick: bool = False
    ) -> None:
        self.path = Path(path)
        self.fps, self.size, self.crf, self.quick = fps, size, crf, quick
        self._part = self.path.with_name(f".{self.path.name}.part")
        self._last: int | None = None
        self._coded = VideoReformatter()

    def __enter__(self) -> "Writer":
        if not self.path.parent.is_dir():
            raise VideoError(
                f"cannot write {self.path}: there is no folder {self.path.parent}; make it first"
            )
        width, height = self.size
        try:
            self._container = av.open(
                str(self._part.absolute()), "w", format="mp4", options={"movflags": "+faststart"}
            )
        except (av.FFmpegError, OSError) as error:
            raise VideoError(f"cannot write {self.path}: {error.strerror}; choose another folder") from error
        rate = Fraction(self.fps).limit_denominator(1001)
        options = {"crf": str(self.crf)} | (QUICK if self.quick else {})
        self._stream = self._container.add_stream("libx264", rate=rate, options=options)
        self._stream.width, self._stream.height = width + width % 2, height + height % 2
        self._stream.pix_fmt = "yuv420p"
        codec = self._stream.codec_context
        codec.time_base = Fraction(1, CLOCK)
        # Without these in the file, players guess the colour space from the size. 1 is BT.709 and TV range.
        codec.colorspace = codec.color_primaries = codec.color_trc = codec.color_range = 1
        return self

    def write(self, image: Image, time: float) -> None:
        """Append one (height, width, 3) uint8 RGB image, shown at `time` seconds."""
        width, height = self.size
        if image.dtype != np.uint8 or image.shape != (height, width, 3):
            raise ValueError(
                f"image must be ({height}, {width}, 3) uint8 like the video, not {image.shape} {image.dtype}"
            )
        ticks = round(time * CLOCK)
        if self._last is not None and ticks <= self._last:
            raise ValueError(
                f"times must grow from frame to frame; {time} s comes after {self._last / CLOCK:.4f} s"
            )

        padded = cv2.copyMakeBorder(image, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
        frame = av.VideoFrame.from_ndarray(padded.astype(np.uint8, copy=False), format="rgb24")
        frame = self._coded.reformat(frame, format="yuv420p", dst_colorspace=Colorspace.ITU709)
        frame.pts, frame.time_base, frame.duration = ticks, Fraction(1, CLOCK), round(CLOCK / self.fps)
        self._container.mux(self._stream.encode(frame))
        self._last = ticks

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None and self._last is None:
                raise VideoError(f"no image was written to {self.path}; a video needs at least one")
            if kind is None:
                self._container.mux(self._stream.encode())
                self._container.close()
                self._part.replace(self.path)
        finally:
            # An error while closing must not hide the one that ended the writing.
            with suppress(av.FFmpegError):
                self._container.close()
            self._part.unlink(missing_ok=True)
