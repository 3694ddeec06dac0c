"""A clip's pictures ahead and back, a bounded part of them in memory."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

from tracker.picture.tone import Curve, toned
from videos.frames import Image, Video

HELD = 32 * 2**20  # bytes of pictures that are kept, and as many again while going back


class Reel:
    """The pictures of a video up to frame `stop`.

    Videos are read ahead only. To go back, the last pictures read are at hand; those before them are read
    again, a block at a time from the back, each block from the video's beginning.

    times : (T,) seconds of every frame read so far
    held  : how many pictures are kept
    """

    def __init__(self, video: Video, stop: int | None = None, held: int | None = None) -> None:
        self.times: list[float] = []
        self.held = held or max(1, HELD // (video.width * video.height * 3))
        self._video, self._stop = video, stop
        self._kept: deque[Image] = deque(maxlen=self.held)

    def ahead(self) -> Iterator[Image]:
        """All pictures, in order; to be gone through once."""
        for frame in self._video if self._stop is None else islice(self._video, self._stop + 1):
            self.times.append(frame.time)
            self._kept.append(frame.image)
            yield frame.image

    def span(self, first: int, last: int) -> Iterator[Image]:
        """The pictures of frames first .. last; back in time where last is less, if all have been read."""
        return self._back(first, last) if last <= first else self._again(first, last)

    def _back(self, first: int, last: int) -> Iterator[Image]:
        oldest = len(self.times) - len(self._kept)
        for frame in range(first, max(oldest, last) - 1, -1):
            yield self._kept[frame - oldest]
        newest = min(first, oldest - 1)
        while newest >= last:
            begin = max(last, newest + 1 - self.held)
            yield from reversed(list(self._again(begin, newest)))
            newest = begin - 1

    def _again(self, first: int, last: int) -> Iterator[Image]:
        return (frame.image for frame in islice(self._video, first, last + 1))


@dataclass(frozen=True)
class Toned:
    """The pictures of a reel through one tone curve."""

    reel: Reel
    curve: Curve

    def shown(self, image: Image) -> Image:
        """A picture of the reel."""
        return toned(image, self.curve)

    def span(self, first: int, last: int) -> Iterator[Image]:
        """As `Reel.span`."""
        return map(self.shown, self.reel.span(first, last))
