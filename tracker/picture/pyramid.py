"""One frame made ready for registration: colour planes, blurred coarse to fine, and values between pixels."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Planes = NDArray[np.float32]
Box = tuple[float, float, float, float]
LEAST = 4  # pixels that a gradient between pixels takes


@dataclass(frozen=True)
class Level:
    """One blurred copy of a part of a frame.

    planes : (h, w, 3) grey levels; at least LEAST pixels either way
    corner : (2,) pixel of the part's top-left corner
    sigma  : blur, pixels
    """

    planes: Planes
    corner: tuple[int, int]
    sigma: float


def pyramid(
    image: Image, box: tuple[int, int, int, int], sigmas: Sequence[float], colour: bool
) -> list[Level]:
    """Levels of the part of an RGB frame within `box` (x0, y0, x1, y1), in the order of `sigmas`.

    Channels are CIE Lab, or three times the lightness where colour is off.
    """
    H, W = image.shape[:2]
    margin = int(np.ceil(3.0 * max(sigmas))) + 2
    x0, y0 = max(box[0] - margin, 0), max(box[1] - margin, 0)
    x1, y1 = min(max(box[2] + margin, x0 + LEAST), W), min(max(box[3] + margin, y0 + LEAST), H)
    x0, y0 = min(x0, x1 - LEAST), min(y0, y1 - LEAST)
    lab = cv2.cvtColor(np.ascontiguousarray(image[y0:y1, x0:x1]), cv2.COLOR_RGB2Lab).astype(np.float32)
    if not colour:
        lab = np.repeat(lab[..., :1], 3, axis=-1)
    return [Level(_blurred(lab, sigma), (x0, y0), sigma) for sigma in sigmas]


def sample(level: Level, pixels: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Bilinear values (P, 3) at (P, 2) pixels, and whether each lies in the frame's part (P,)."""
    h, w = level.planes.shape[:2]
    place = pixels - np.asarray(level.corner)
    inside = within(place, (h, w))
    x = np.clip(place[:, 0], 0, w - 1.001)
    y = np.clip(place[:, 1], 0, h - 1.001)
    i, j = y.astype(np.intp), x.astype(np.intp)
    fy, fx = y - i, x - j
    corners = (i * w + j) + np.array([[0], [1], [w], [w + 1]])
    shares = np.stack([(1 - fy) * (1 - fx), (1 - fy) * fx, fy * (1 - fx), fy * fx])
    around = level.planes.reshape(h * w, 3).take(corners, axis=0)
    return np.einsum("kp,kpc->pc", shares, around), inside


def within(pixels: Array | Planes, shape: Sequence[int]) -> NDArray[np.bool_]:
    """Whether pixels (..., 2) lie in a picture of `shape` (height, width, ...)."""
    x, y = pixels[..., 0], pixels[..., 1]
    return np.asarray((x >= 0) & (y >= 0) & (x <= shape[1] - 1) & (y <= shape[0] - 1))


def _blurred(lab: Planes, sigma: float) -> Planes:
    return cv2.GaussianBlur(lab, (0, 0), sigma).astype(np.float32, copy=False) if sigma > 0 else lab
