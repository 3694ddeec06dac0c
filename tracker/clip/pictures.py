"""A clip's pictures forwards and backwards, with a bounded part of them in memory."""

from collections.abc import Iterator, Mapping
from itertools import islice
from types import MappingProxyType

import numpy as np

from tracker.picture.light import relit
from videos.frames import Video
from videos.upright import Image

HELD = 32 * 2**20  # bytes of pictures that are kept in memory
BLOCK = 4  # factor on HELD while going back, since each block is decoded from a key frame on,
LEAST = 12  # and so many pictures at least


class Reel:
    """The pictures of a video up to frame `stop`.

    For going back, the last pictures read are in memory; earlier ones are read again, in blocks from the last
    one to the first. All are shown in the light of one frame.

    times : (T,) seconds of every frame read so far
    held  : how many pictures are kept
    """

    def __init__(
        self,
        video: Video,
        stop: int | None = None,
        held: int | None = None,
        lights: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        self.times: list[float] = []
        self.held = held or max(1, HELD // (video.width * video.height * 3))
        self._video, self._stop, self._lights = video, stop, lights
        # Frame t is at t % held. Here and in a block, separate arrays would fragment the memory.
        self._kept: Image = np.empty((0 if video.held else self.held, video.height, video.width, 3), np.uint8)

    def ahead(self) -> Iterator[Image]:
        """All pictures, in order; can be iterated once."""
        for frame in self._video if self._stop is None else islice(self._video, self._stop + 1):
            if len(self._kept):
                self._kept[len(self.times) % self.held] = frame.image
            self.times.append(frame.time)
            yield self._relit(frame.index, frame.image)

    def span(self, first: int, last: int) -> Iterator[Image]:
        """The pictures of frames first .. last; back in time where last is less, if all have been read."""
        if last > first:
            frames, images = range(first, last + 1), self._video.pictures(first, last)
        else:
            frames = range(first, last - 1, -1)
            images = self._video.picked(frames) if self._video.held else self._back(first, last)
        return map(self._relit, frames, images)

    def _relit(self, frame: int, image: Image) -> Image:
        return relit(image, self._lights.get(frame, 1.0))

    def _back(self, first: int, last: int) -> Iterator[Image]:
        oldest = max(len(self.times) - len(self._kept), 0)
        for frame in range(first, max(oldest, last) - 1, -1):
            yield self._kept[frame % self.held]
        newest = min(first, oldest - 1)
        if newest < last:
            return
        count = min(max(BLOCK * self.held, LEAST), newest - last + 1)
        block: Image = np.empty((count, self._video.height, self._video.width, 3), np.uint8)
        while newest >= last:
            begin = max(last, newest + 1 - count)
            for place, image in zip(block, self._video.pictures(begin, newest), strict=False):
                place[:] = image
            for place in block[newest - begin :: -1]:
                yield place.copy()
            newest = begin - 1
