"""Poses as stick figures on a ground that the feet touch, and as a clip with moving ground."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from dynamics.gaussian import Array
from kinematics.figure_file import WALKER
from kinematics.mocap import POSE_COLUMNS
from kinematics.spm import skeleton
from tracker.progress import Progress
from videos.overlay import FAR, NEAR, TRUNK, Segment, as_hex, draw, put_text
from videos.upright import Image
from videos.writer import Writer

LAYERS = tuple(link.layer for link in WALKER.links)  # 0: the far leg, 1: the trunk, 2: the near leg
GROUND_SECONDS = 0.6  # a foot touches the ground at least once in twice this time
SHADES = {0: FAR, 1: TRUNK, 2: NEAR}  # colour of each layer
SIDES = {"near": as_hex(NEAR), "far": as_hex(FAR)}
SIZE = (640, 360)  # width and height of the clip, pixels
UNIT = 115.0  # leg length, pixels
HORIZON, GROUND = 262, 318  # pixel rows
SKY, EARTH, MARK, POST = (226, 236, 243), (198, 190, 172), (128, 118, 100), (160, 172, 180)
POSTS = 3  # distance between posts, leg lengths


def sticks(y: Array, fps: float) -> Array:
    """(T, L, 2, 2) start and end of each link of poses (T, 8) in body units, x forward, y over the ground.

    A pose's height is relative and drifts in a model, so the ground is the lowest place of the lower ankle
    within GROUND_SECONDS; without a measured root the figure stays in place.
    """
    q = np.zeros((len(y), len(WALKER.freedoms)))  # freedoms begin with the columns of a pose table
    q[:, : len(POSE_COLUMNS)] = y
    q[:, :2] = np.nan_to_num(y[:, :2])
    bones = skeleton(WALKER, q)
    ends = np.stack([bones.start, bones.tip], axis=2)
    ends[..., 1] -= _ground(ends[..., 1].min(axis=(1, 2)), max(1, round(GROUND_SECONDS * fps)))[:, None, None]
    return ends


def write_clip(y: Array, captions: Sequence[str], fps: float, path: Path, progress: Progress) -> None:
    """Write an mp4 of poses y (T, 8) in body units, with one caption a frame."""
    frames = zip(sticks(y, fps), np.nan_to_num(y[:, 0]), captions, strict=True)
    with Writer(path, fps, SIZE) as writer:
        for t, shown in enumerate(progress.through("drawing the clip", frames, len(y))):
            links, travelled, caption = shown
            writer.write(_frame(links, float(travelled), caption), t / fps)


def _ground(lowest: Array, reach: int) -> Array:
    """(T,) the running minimum of the lowest point, smoothed over the same window."""
    low = np.where(np.isfinite(lowest), lowest, np.inf)
    wide = np.pad(low, 2 * reach, mode="edge")
    least = np.lib.stride_tricks.sliding_window_view(wide, 2 * reach + 1).min(1)
    least = np.where(np.isfinite(least), least, 0.0)
    return np.asarray(np.convolve(least, np.full(2 * reach + 1, 1.0 / (2 * reach + 1)), "valid"))


def _frame(links: Array, travelled: float, caption: str) -> Image:
    canvas = _scenery(travelled)
    middle = np.array([SIZE[0] / 2 - UNIT * travelled, GROUND])
    pixels = middle + links * (UNIT, -UNIT)
    order = sorted(range(len(links)), key=LAYERS.__getitem__)
    segments = [Segment(pixels[i, 0], pixels[i, 1], SHADES[LAYERS[i]], UNIT / 14.0) for i in order]
    return draw(canvas, segments, caption=caption)


def _scenery(travelled: float) -> Image:
    """The ground with a mark every leg length and numbered posts, after `travelled` leg lengths."""
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
