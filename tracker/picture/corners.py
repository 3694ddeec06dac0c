"""Corners of a picture that can be found again in another (Shi and Tomasi 1994)."""

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.picture.pyramid import Image

Corners = NDArray[np.float32]


def sharpness(image: Image, block: int) -> NDArray[np.float32]:
    """(h, w) squared gradient along each pixel's weaker direction, grey levels a pixel.

    Args:
        image: (h, w) grey levels.
        block: side of the square around a pixel over which it is averaged.
    """
    # OpenCV's derivative is twice the gradient.
    return np.asarray(cv2.cornerMinEigenVal(image.astype(np.float32), block) / 4.0, dtype=np.float32)


def sharpest(sharp: NDArray[np.float32], cell: int, contrast: float) -> Corners:
    """(P, 2) pixels of the sharpest corner in every cell of a grid that has one.

    Args:
        sharp: as `sharpness`.
        cell: side of a cell.
        contrast: least gradient of a corner, root mean square.
    """
    rows, columns = (n // cell for n in sharp.shape)
    grid = sharp[: rows * cell, : columns * cell].reshape(rows, cell, columns, cell)
    cells = grid.swapaxes(1, 2).reshape(rows * columns, cell * cell)
    best = cells.argmax(1)
    row, column = np.divmod(np.arange(len(cells)), columns)
    corners = np.stack([column * cell + best % cell, row * cell + best // cell], axis=1)
    return np.asarray(corners[cells.max(1) > contrast**2], dtype=np.float32)
