"""A small picture that shows what a film is of."""

from itertools import chain
from pathlib import Path

import cv2

from videos.frames import Video

LATEST = 60  # latest frame taken of a long film, since those before it are read


def thumbnail(film: Path, width: int) -> bytes:
    """The middle frame of a film, or an earlier one of a long film, as a JPEG of at most this width."""
    video = Video(film)
    middle = min((video.count_hint or 0) // 2, LATEST)
    image = next(chain(video.pictures(middle, middle), video.pictures(0, 0)))  # fewer than announced may come
    by = min(width / video.width, 1.0)
    small = cv2.resize(image, None, fx=by, fy=by, interpolation=cv2.INTER_AREA)
    data = cv2.imencode(".jpg", cv2.cvtColor(small, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, 80])[1]
    return data.tobytes()
