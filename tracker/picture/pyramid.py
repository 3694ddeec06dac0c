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
FINE = 3.0  # least standard deviation of a blur in pixels of a reduced picture
SOME = 16  # of how many rows one is compared first
LEVELS = 256  # number of grey levels
AS_FILMED: Image = np.arange(LEVELS, dtype=np.uint8)  # the tone curve that changes nothing


@dataclass(frozen=True)
class Level:
    """One blurred copy of a part of a frame, reduced as far as its blur allows.

    planes : (h, w, 3) grey levels; places beyond are those at the edge
    corner : (2,) place of the middle of the top-left one, pixels of the frame
    step   : from one to the next, pixels of the frame
    sigma  : blur, pixels of the frame
    """

    planes: Planes
    corner: Array
    step: int
    sigma: float

    def at(self, pixels: Array) -> Array:
        """Places (..., 2) in the planes of pixels (..., 2) of the frame."""
        return np.asarray((pixels - self.corner) / self.step)


def pyramid(
    image: Image, box: Box, sigmas: Sequence[float], colour: bool, curve: Image = AS_FILMED
) -> list[Level]:
    """Levels of the part of an RGB frame within `box` (x0, y0, x1, y1), in the order of `sigmas`.

    Channels are CIE Lab, or three times the lightness where colour is off, through a tone curve (256,).
    """
    margin = int(np.ceil(FAR * max(sigmas))) + 2
    steps = [max(int(sigma / FINE), 1) for sigma in sigmas]
    parts = {step: _part(image, box, margin, step, colour, curve) for step in set(steps)}
    levels = []
    for sigma, step in zip(sigmas, steps, strict=True):
        planes, corner = parts[step]
        levels.append(Level(_blurred(planes, sigma, step), corner, step, sigma))
    return levels


def lab(image: Image, step: int, curve: Image = AS_FILMED) -> Planes:
    """The Lab grey levels (h, w, 3) of a picture, through a tone curve, averaged over the squares of `step`
    pixels that lie in it."""
    h, w = (max(side // step, 1) for side in image.shape[:2])
    less: Image = np.ascontiguousarray(image[: h * step, : w * step])
    if step > 1:
        less = np.asarray(cv2.resize(less, (w, h), interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return np.asarray(cv2.cvtColor(cv2.LUT(less, curve), cv2.COLOR_RGB2Lab), dtype=np.float32)


def sample(level: Level, pixels: Array) -> tuple[Array, Flags]:
    """Bilinear values (P, 3) at (P, 2) pixels, and whether each lies in the frame's part (P,)."""
    place = level.at(pixels)
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


def _part(image: Image, box: Box, margin: int, step: int, colour: bool, curve: Image) -> tuple[Planes, Array]:
    """Planes and corner of a level before it is blurred: the frame within a margin around a box."""
    H, W = image.shape[:2]
    low = np.clip(box[:2], 0, (W - 2, H - 2)).astype(int)
    high = np.clip(box[2:], low + 2, (W, H)).astype(int)
    # Whole squares, so that a pixel is in the same one whatever part is read.
    x0, y0 = (np.maximum(low - margin, 0) // step * step).tolist()
    x1, y1 = np.minimum((high + margin + step - 1) // step * step, (W, H)).tolist()
    planes = lab(image[y0:y1, x0:x1], step, curve)
    if not colour:
        planes = np.repeat(planes[..., :1], 3, axis=-1)
    return planes, np.array([x0, y0]) + 0.5 * (step - 1)


def _blurred(planes: Planes, sigma: float, step: int) -> Planes:
    """Planes blurred by sigma pixels of the frame, of which averaging over squares of `step` is a part."""
    sigma = np.sqrt(sigma**2 - (step**2 - 1) / 12.0) / step
    size = 2 * int(np.ceil(FAR * sigma)) + 1
    return np.asarray(cv2.GaussianBlur(planes, (size, size), sigma), np.float32) if sigma > 0 else planes
