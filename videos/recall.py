"""The decoded pictures of the film that was read last, so that a short film is decoded once.

They keep their coded pixel format, which mostly takes half the bytes of RGB.
"""

from collections.abc import Callable, Iterator
from pathlib import Path

from av.video.frame import VideoFrame

HELD = 80 * 2**20  # bytes of pictures that are held; a film of more is decoded anew each time

Identity = tuple[int, ...]

_last: dict[Identity, list[VideoFrame]] = {}  # one film at most


def held(path: Path) -> list[VideoFrame]:
    """All pictures of a film, if it was read last and is held in memory; else none."""
    return _last.get(_identity(path), [])


def recalled(
    path: Path, decode: Callable[[], Iterator[VideoFrame | None]], count: int | None = None
) -> Iterator[VideoFrame | None]:
    """The pictures of a film, from memory or else decoded, None for a damaged one, and then held in memory
    unless the film is damaged or changed; `count` is their number by the file, None if it does not say."""
    if pictures := held(path):
        yield from pictures
        return
    film = _identity(path)
    _last.clear()  # before the memory of another film is asked for
    holds, room = True, HELD
    for picture in decode():
        if holds:
            size = 0 if picture is None else sum(plane.buffer_size for plane in picture.planes)
            room -= size
            expected = 0 if count is None else (count - len(pictures) - 1) * size
            holds = picture is not None and room >= max(expected, 0)
        if holds and picture is not None:
            pictures.append(picture)
        else:
            pictures.clear()
        yield picture
    if pictures and film and film == _identity(path):
        _last.clear()
        _last[film] = pictures


def _identity(path: Path) -> Identity:
    """What changes when a file is replaced by another; None if there is no file."""
    try:
        told = path.stat()
    except OSError:
        return ()
    return told.st_dev, told.st_ino, told.st_size, told.st_mtime_ns
