"""The light of a picture as a share of the scene's, which automatic exposure, dimming and flicker change.

Such a change multiplies linear light, and with it, about, the stored grey levels, which are a power of it.
Shares are of the stored grey levels.
"""

import cv2
import numpy as np

from tracker.picture.pyramid import LEVELS, Array, Flags, Image, Planes

BRIGHT = 50  # percentile of lightness from which light is measured: noise is a smaller share of it there
WHITE = 250  # lightness or level from which a pixel may be overexposed, and does not show a change of light


def light_of(image: Image, lab: Planes, known: Flags) -> tuple[float, float]:
    """The light of a picture (h, w, 3), Lab, uint8, by the scene's grey levels where these are known (h, w).

    Returns:
        Its share of the scene's light, and the median distance of single pixels' shares from it, natural
        logarithm; 1 and 0 if the scene is nowhere known.
    """
    known = known & (image[..., 0] < WHITE) & (lab[..., 0] < WHITE)
    if not known.any():
        return 1.0, 0.0
    levels = _greys()
    now, scene = levels[image[known, 0]], np.interp(lab[known, 0], np.arange(LEVELS), levels)
    shares = np.log((now / scene)[scene >= np.percentile(scene, BRIGHT)])
    share = np.median(shares)
    return float(np.exp(share)), float(np.median(np.abs(shares - share)))


def relit(image: Image, share: float) -> Image:
    """(h, w, 3) RGB with this share of light made up for."""
    if share == 1.0:
        return image
    table = np.clip(np.rint(np.arange(LEVELS) / share), 0, LEVELS - 1).astype(np.uint8)
    table[WHITE:] = np.maximum(table[WHITE:], np.arange(WHITE, LEVELS))  # what may be overexposed stays so
    return np.asarray(cv2.LUT(image, table), np.uint8)


def relit_lab(image: Image, share: float) -> Image:
    """(h, w, 3) Lab with this share of light made up for."""
    if share == 1.0:
        return image
    rgb = relit(np.asarray(cv2.cvtColor(image, cv2.COLOR_Lab2RGB), np.uint8), share)
    return np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2Lab), np.uint8)


def _greys() -> Array:
    """(LEVELS,) the stored grey level, at least 1, of each stored value of lightness."""
    ramp = np.full((LEVELS, 1, 3), 128, np.uint8)
    ramp[:, 0, 0] = np.arange(LEVELS)
    return np.maximum(cv2.cvtColor(ramp, cv2.COLOR_Lab2RGB)[:, 0, 1], 1.0)
