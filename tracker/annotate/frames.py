"""The frames of a video by number, with exactly the pixels that tracking uses."""

from collections import deque
from collections.abc import Iterator
from pathlib import Path
from threading import Lock

import cv2
import numpy as np
from numpy.typing import NDArray

from videos.container import VideoError
from videos.frames import Frame, Video

QUICK = 960  # longer side of pictures for quick browsing, pixels
KEPT_BYTES = 128 * 2**20  # latest frames in memory, so that small steps back need no decoding, bytes
SMALL_BYTES = 64 * 2**20  # the same for small pictures and the slider, bytes


class Frames:
    """A video with access to any frame, by one thread at a time.

    Decoding always begins at frame 0, which is slower than a seek but counts frames exactly as `track` does.

    width, height : pixels
    fps           : frames a second
    count_hint    : approximate number of frames; exact once the end was read; None if unknown
    """

    def __init__(self, path: Path) -> None:
        """Raises VideoError if the video cannot be read."""
        self._video = Video(path)
        self.width, self.height = self._video.width, self._video.height
        self.fps, self.count_hint = self._video.fps, self._video.count_hint
        self._coming: Iterator[Frame] = iter(self._video)
        kept = KEPT_BYTES // (3 * self.width * self.height)
        self._passed: deque[Frame] = deque(maxlen=max(kept, 1))
        self._small: dict[int, bytes] = {}
        self._lock = Lock()

    def png(self, index: int) -> bytes:
        """A frame as a lossless PNG; VideoError: the video ends before it, or it cannot be decoded."""
        quick = [cv2.IMWRITE_PNG_COMPRESSION, 1]
        return cv2.imencode(".png", self._image(index), quick)[1].tobytes()

    def jpeg(self, index: int) -> bytes:
        """A frame as a small JPEG, which is faster; raises as `png`."""
        if index in (seen := self._small):
            return seen[index]
        image, by = self._image(index), min(1.0, QUICK / max(self.width, self.height))
        small = cv2.resize(image, None, fx=by, fy=by, interpolation=cv2.INTER_AREA) if by < 1.0 else image
        data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()
        room = sum(map(len, seen.values())) + len(data) <= SMALL_BYTES
        self._small = {**(seen if room else {}), index: data}
        return data

    def _image(self, index: int) -> NDArray[np.uint8]:
        with self._lock:
            image = self._frame(index).image
        return cv2.cvtColor(image, cv2.COLOR_RGB2BGR).astype(np.uint8, copy=False)

    def _frame(self, index: int) -> Frame:
        if self._passed and index < self._passed[0].index:
            self._begin()
        for frame in self._passed:
            if frame.index == index:
                return frame
        try:
            for frame in self._coming:
                self._passed.append(frame)
                if frame.index == index:
                    return frame
        except VideoError:
            self._begin()  # a file may be away for a while only
            raise
        self.count_hint = self._passed[-1].index + 1
        raise VideoError(
            f"frame {index} is not in {self._video.path.name}, which ends with frame {self.count_hint - 1}"
        )

    def _begin(self) -> None:
        self._coming = iter(self._video)
        self._passed.clear()
