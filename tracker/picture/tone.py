"""A tone curve for backlight and haze: it spreads the grey levels that occur around the figure.

Against the light dark clothes differ by few grey levels, in haze everything does, while the noise of a match
is in grey levels. The curve goes part of the way from the filmed levels to equal numbers of pixels at each
level (histogram equalisation). It is computed once, from the marked frame: a curve that changed would change
the figure's appearance.
"""

import cv2
import numpy as np

from tracker.picture.pyramid import LEVELS, Box, Image

SMOOTH = 17  # levels over which the histogram is smoothed, so that a flat background does not take the range


def tone_curve(image: Image, box: Box, share: float) -> Image:
    """(256,) new grey levels: this share of the way to equal numbers of each within a box of an RGB image."""
    H, W = image.shape[:2]
    x0, y0, x1, y1 = np.clip(box, 0, (W - 1, H - 1, W - 1, H - 1)).astype(int)
    grey = cv2.cvtColor(np.ascontiguousarray(image[y0 : y1 + 1, x0 : x1 + 1]), cv2.COLOR_RGB2GRAY)
    number = np.bincount(grey.ravel(), minlength=LEVELS).astype(np.float64)
    number = np.convolve(np.pad(number, SMOOTH // 2, mode="edge"), np.full(SMOOTH, 1.0 / SMOOTH), "valid")
    equal = (LEVELS - 1) * number.cumsum() / number.sum()
    mixed = (1.0 - share) * np.arange(LEVELS) + share * equal
    return np.asarray(np.rint(mixed), dtype=np.uint8)
