"""Frames reduced for the survey of a whole film, and the map from their pixels to the film's."""

import cv2
import numpy as np

from tracker.picture.pyramid import Array, Image

SIDE = 480  # largest length of the longer side, pixels


def small_size(width: int, height: int, by: float) -> tuple[int, int]:
    """Width and height of a picture whose pixels each span about `by` of the film's in both directions."""
    return max(round(width / by), 1), max(round(height / by), 1)


def reduced(image: Image, size: tuple[int, int]) -> Image:
    """An RGB frame (H, W, 3) averaged to a picture of this width and height."""
    H, W = image.shape[:2]
    # Halving first is fast; the final bilinear step then uses all pixels.
    while min(W / size[0], H / size[1]) >= 2.0:
        W, H = W // 2, H // 2
        image = np.asarray(cv2.resize(image, (W, H), interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_LINEAR), dtype=np.uint8)


def to_film(size: tuple[int, int], film: tuple[int, int]) -> Array:
    """(3, 3) map from the pixels of a small picture to the film's, by the width and height of both."""
    x, y = film[0] / size[0], film[1] / size[1]
    return np.array([[x, 0.0, 0.5 * x - 0.5], [0.0, y, 0.5 * y - 0.5], [0.0, 0.0, 1.0]])
