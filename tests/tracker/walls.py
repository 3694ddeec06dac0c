"""Walls that hide a walker wholly: grey, rough, and like nobody's clothes."""

import cv2
import numpy as np

ROUGH = 2.5  # pixels: size of its grains
CONTRAST = 25.0  # grey levels, standard deviation


def wall(shape):
    """(H, W, 3) uint8, grey."""
    rough = cv2.GaussianBlur(np.random.default_rng(0).normal(size=shape[:2]), (0, 0), ROUGH)
    grey = 125.0 + CONTRAST / rough.std() * rough
    return np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=-1)


def behind_wall(image, first, last):
    """The picture with a wall from its top to its foot before the columns first .. last."""
    covered = image.copy()
    covered[:, first : last + 1] = wall(image.shape)[:, first : last + 1]
    return covered
