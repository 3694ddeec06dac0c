"""A motion as an animated clip: the walker in the middle, the ground and its marks passing below."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array
from tracker.motion.sticks import SHADES, layers, sticks
from tracker.progress import Progress
from videos.overlay import Segment, draw, put_text
from videos.writer import Writer

Image = NDArray[np.uint8]

SIZE = (640, 360)  # pixels
UNIT = 115.0  # pixels in a leg length
HORIZON, GROUND = 262, 318  # pixel rows
SKY, EARTH, MARK, POST = (226, 236, 243), (198, 190, 172), (128, 118, 100), (160, 172, 180)
POSTS = 3  # leg lengths between posts


def write_clip(y: Array, captions: Sequence[str], fps: float, path: Path, progress: Progress) -> None:
    """An mp4 of poses y (T, 8) in body units, one caption a frame."""
    frames = zip(sticks(y, fps), np.nan_to_num(y[:, 0]), captions, strict=True)
    with Writer(path, fps, SIZE) as writer:
        for links, travelled, caption in progress.through("drawing the clip", frames, len(y)):
            writer.write(_frame(links, float(travelled), caption))


def _frame(links: Array, travelled: float, caption: str) -> Image:
    canvas = _scenery(travelled)
    middle = np.array([SIZE[0] / 2 - UNIT * travelled, GROUND])
    pixels = middle + links * (UNIT, -UNIT)
    order = sorted(range(len(links)), key=lambda i: layers()[i])
    segments = [Segment(pixels[i, 0], pixels[i, 1], SHADES[layers()[i]], UNIT / 14.0) for i in order]
    return draw(canvas, segments, caption=caption)


def _scenery(travelled: float) -> Image:
    """Ground with a mark a leg length and numbered posts, as seen after so many leg lengths."""
    width, height = SIZE
    canvas = np.empty((height, width, 3), dtype=np.uint8)
    canvas[:HORIZON], canvas[HORIZON:] = SKY, EARTH
    half = width / 2 / UNIT + 1.0
    for mark in range(int(np.floor(travelled - half)), int(np.ceil(travelled + half)) + 1):
        x = round(width / 2 + UNIT * (mark - travelled))
        cv2.line(canvas, (x, GROUND), (x - 14, height - 12), MARK, 2, cv2.LINE_AA)
        if mark % POSTS == 0:
            cv2.line(canvas, (x, HORIZON), (x, HORIZON - 110), POST, 6, cv2.LINE_AA)
            put_text(canvas, str(mark), x + 8, HORIZON - 98, 11, MARK)
    cv2.line(canvas, (0, GROUND), (width, GROUND), MARK, 2, cv2.LINE_AA)
    return canvas
