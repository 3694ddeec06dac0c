"""A clip's pictures forwards and backwards, with a bounded part of them in memory."""

import math
from collections.abc import Iterator, Mapping
from itertools import islice
from types import MappingProxyType

import numpy as np

from tracker.picture.light import relit
from videos.frames import Video
from videos.upright import Image

BLOCK = 128 * 2**20  # bytes of pictures decoded together while going back, each time from a key frame on,
LEAST = 12  # and so many pictures at least


class Reel:
    """The pictures of a video up to frame `stop`.

    Going back they are read again, in blocks from the last one to the first. All are shown in the light of
    one frame.

    times : (T,) seconds of every frame read so far
    """

    def __init__(
        self, video: Video, stop: int | None = None, lights: Mapping[int, float] = MappingProxyType({})
    ) -> None:
        self.times: list[float] = []
        self._video, self._stop, self._lights = video, stop, lights

    def ahead(self) -> Iterator[Image]:
        """All pictures, in order; can be iterated once."""
        for frame in self._video if self._stop is None else islice(self._video, self._stop + 1):
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
        shape = self._video.height, self._video.width, 3
        count = min(max(BLOCK // math.prod(shape), LEAST), first - last + 1)
        block: Image = np.empty((count, *shape), np.uint8)  # separate arrays would fragment the memory
        for newest in range(first, last - 1, -count):
            begin = max(last, newest + 1 - count)
            for place, image in zip(block, self._video.pictures(begin, newest), strict=False):
                place[:] = image
            for place in block[newest - begin :: -1]:
                yield place.copy()
