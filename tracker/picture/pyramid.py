"""A frame prepared for registration: colour planes, blurred coarse to fine, and interpolated values."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compiled import compiled

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Flags = NDArray[np.bool_]
Image = NDArray[np.uint8]
Planes = NDArray[np.float32]
Box = tuple[float, float, float, float]
FAR = 3.0  # standard deviations at which a blur is cut off
SOME = 16  # of how many rows one is compared first
LEVELS = 256  # number of grey levels
AS_FILMED: Image = np.arange(LEVELS, dtype=np.uint8)  # the tone curve that changes nothing


@dataclass(frozen=True)
class Level:
    """One blurred copy of a part of a frame.

    planes : (h, w, 3) grey levels; places beyond are those at the edge
    corner : (2,) pixel of the part's top-left corner
    sigma  : blur, pixels
    """

    planes: Planes
    corner: tuple[int, int]
    sigma: float


def pyramid(
    image: Image, box: Box, sigmas: Sequence[float], colour: bool, curve: Image = AS_FILMED
) -> list[Level]:
    """Levels of the part of an RGB frame within `box` (x0, y0, x1, y1), in the order of `sigmas`.

    Channels are CIE Lab, or three times the lightness where colour is off, through a tone curve (256,).
    """
    H, W = image.shape[:2]
    margin = int(np.ceil(FAR * max(sigmas))) + 2
    low = np.clip(box[:2], 0, (W - 2, H - 2)).astype(int)
    high = np.clip(box[2:], low + 2, (W, H)).astype(int)
    x0, y0 = np.maximum(low - margin, 0).tolist()
    x1, y1 = np.minimum(high + margin, (W, H)).tolist()
    part = cv2.LUT(np.ascontiguousarray(image[y0:y1, x0:x1]), curve)
    lab = cv2.cvtColor(part, cv2.COLOR_RGB2Lab).astype(np.float32)
    if not colour:
        lab = np.repeat(lab[..., :1], 3, axis=-1)
    return [Level(_blurred(lab, sigma), (x0, y0), sigma) for sigma in sigmas]


def sample(level: Level, pixels: Array) -> tuple[Array, Flags]:
    """Bilinear values (P, 3) at (P, 2) pixels, and whether each lies in the frame's part (P,)."""
    place = pixels - np.asarray(level.corner)
    values = np.empty((len(place), 3))
    _between(level.planes, place, values)
    return values, within(place, level.planes.shape)


@compiled()
def _between(planes: Planes, place: Array, values: Array) -> None:
    """Write bilinear values (P, 3) at (P, 2) pixels of the planes; outside, the values at the edge."""
    h, w = planes.shape[:2]
    for p in range(len(place)):
        x, y = min(max(place[p, 0], 0.0), w - 1.001), min(max(place[p, 1], 0.0), h - 1.001)
        i, j = int(y), int(x)
        fy, fx = y - i, x - j
        for c in range(3):
            upper = (1.0 - fx) * planes[i, j, c] + fx * planes[i, j + 1, c]
            lower = (1.0 - fx) * planes[i + 1, j, c] + fx * planes[i + 1, j + 1, c]
            values[p, c] = (1.0 - fy) * upper + fy * lower


def same(one: Image, other: Image) -> bool:
    """Whether two pictures of a film are the same to the last bit; a few rows tell most apart."""
    return np.array_equal(one[::SOME], other[::SOME]) and np.array_equal(one, other)


def within(pixels: Array | Planes, shape: Sequence[int]) -> Flags:
    """Whether pixels (..., 2) lie in a picture of `shape` (height, width, ...)."""
    x, y = pixels[..., 0], pixels[..., 1]
    return np.asarray((x >= 0) & (y >= 0) & (x <= shape[1] - 1) & (y <= shape[0] - 1))


def _blurred(lab: Planes, sigma: float) -> Planes:
    size = 2 * int(np.ceil(FAR * sigma)) + 1
    return np.asarray(cv2.GaussianBlur(lab, (size, size), sigma), dtype=np.float32) if sigma > 0 else lab
