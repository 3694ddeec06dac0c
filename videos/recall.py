"""The decoded pictures of the film that was gone through last, so that a short one is decoded once.

They stay as they are coded, mostly in half the bytes of RGB.
"""

from collections.abc import Callable, Iterator
from pathlib import Path

from av.video.frame import VideoFrame

HELD = 80 * 2**20  # bytes of pictures that are held; a film of more is decoded anew each time

Identity = tuple[int, ...]

_last: dict[Identity, list[VideoFrame]] = {}  # one film at most


def held(path: Path) -> list[VideoFrame]:
    """All pictures of a film that was gone through last, none where they are not held."""
    return _last.get(_identity(path), [])


def recalled(
    path: Path, decode: Callable[[], Iterator[VideoFrame | None]], count: int | None = None
) -> Iterator[VideoFrame | None]:
    """The pictures of a film as they are held, else as they are decoded; then they are held from now on.

    Args:
        decode: gives every picture, None for what is damaged; such films are not held, nor changed ones.
        count: of the pictures, as the file tells it; None where it does not.
    """
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
    """What tells a file from one written anew in its place; of none that is there, nothing."""
    try:
        told = path.stat()
    except OSError:
        return ()
    return told.st_dev, told.st_ino, told.st_size, told.st_mtime_ns
