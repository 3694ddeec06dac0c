"""Log odds of foreground, pixel by pixel.

A pixel x (Lab) shows either foreground, for which all colours are equally likely, or the scene within its
spread, or the scene in a shadow, darker by an unknown factor:

    R = log p(x | foreground) - log (p(x | scene) + shaded p(x | scene in a shadow)),

clipped at +-MOST, as errors of neighbouring pixels are correlated. Where the scene is unknown R is 0. A
change of light common to the picture is removed first. In the dark and in haze all colours, of clothes and
scene, are closer to each other. Chroma shrinks with the light in a shadow, except for what another light,
such as the sky's, adds. Dark grey clothes look like a shadow, and clothes may have the scene's own colours:
`Expected` has the prior probabilities of both. If a share a of the foreground looks like the scene, R counts
as log ((1 - a) exp R + a).
"""

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from tracker.compiled import compiled
from tracker.picture.pyramid import Array, Flags, Image, Planes
from tracker.survey.mosaic import FULL, NOISE, Scene, apart

MOST = 2.5  # largest log odds of a pixel, nats
UNITS = 50.0  # stored steps for a nat
NOTHING = 128  # stored value of log odds of 0
CHROMAS = 50.0  # range of a and of b of clothes and skin in full light
FEWEST = 5.0  # the same in the dark
GREY = 6.0  # standard deviation of the chroma of grey clothes
ALL_GREY = 0.999  # share of grey clothes in a film without colours
DARKER = 14.0  # factor on the expected share of shadow in such a film
DARKEST = 0.4  # least share of the light in a shadow
TINT = 10.0  # standard deviation of the chroma in total shadow, where there are colours
NONE = 1e-30  # least share, so that its logarithm exists
SOME = 17  # a change of light is measured on every such row


@dataclass(frozen=True)
class Expected:
    """Prior shares of what a film may show besides its scene.

    grey   : share of clothes that are about grey; others may have any colour
    shaded : share of the scene that lies in a new shadow
    alike  : share of the foreground that looks like the scene
    """

    grey: float = 0.0
    shaded: float = 0.05
    alike: float = 0.0


ORDINARY = Expected()
SOMEBODY = Expected(grey=0.3, alike=0.1)
GREY_CLOTHES = Expected(grey=0.5)
AS_THE_SCENE = Expected(grey=0.5, alike=0.25)
HARDLY_SHADOWS = Expected(grey=0.5, shaded=0.002, alike=0.25)
FULL_OF_SHADOWS = Expected(shaded=0.2)


def evidence(image: Image, place: Array, scene: Scene, expected: Expected = ORDINARY) -> Image:
    """(h, w) log odds R, stored as NOTHING + UNITS R, of a picture (h, w, 3), Lab; place as in `Scene`."""
    lab, spread, known = scene.seen(place, image.shape[1::-1])
    apart = (image[::SOME, ::3] - lab[::SOME, ::3])[known[::SOME, ::3]]
    light = (np.median(apart, axis=0) if len(apart) else np.zeros(3)).astype(np.float32)
    chroma, shaded, tint = GREY * scene.contrast, expected.shaded, TINT
    if scene.colourless:  # neither clothes nor shadows have a chroma, and any darker place may be a shadow
        chroma, shaded, tint = float(NOISE[1]), min(DARKER * expected.shaded, 1.0), 0.0
    colours = _colours(scene, ALL_GREY if scene.colourless else expected.grey, chroma)
    odds = _odds(image, lab, spread, known, light, colours, (chroma, shaded, tint))
    return np.asarray(cv2.LUT(odds, _worth(expected.alike)), dtype=np.uint8)


def _colours(scene: Scene, grey: float, chroma: float) -> Planes:
    """(2, 256) log densities of foreground at each lightness: of any colour, and of grey at chroma 0.

    A share `grey` of it is grey, with this standard deviation of its chroma.
    """
    lightness = -np.log(FULL * scene.contrast)
    any_chroma = np.maximum(CHROMAS * apart(np.arange(256.0), scene.contrast), FEWEST)
    any_colour = np.log(1.0 - grey) + lightness - 2.0 * np.log(any_chroma)
    about_grey = np.log(max(grey, NONE) / (2.0 * np.pi * chroma**2)) + lightness
    return np.stack([any_colour, np.full(256, about_grey)]).astype(np.float32)


@cache
def _worth(alike: float) -> Image:
    """(256,) table of stored log odds if this share of the foreground looks like the scene."""
    odds = (np.arange(256) - NOTHING) / UNITS
    return np.asarray(np.rint(NOTHING + UNITS * np.log((1.0 - alike) * np.exp(odds) + alike)), dtype=np.uint8)


@compiled(fastmath=True, error_model="numpy")
def _odds(
    image: Image,
    lab: Planes,
    spread: Planes,
    known: Flags,
    light: Planes,
    colours: Planes,
    of_film: tuple[float, float, float],
) -> Image:
    h, w = known.shape
    chroma, shaded, tinted = of_film  # chroma of grey clothes, share of shadow, chroma in total shadow
    enough = MOST + np.log(np.exp(colours[0]) + np.exp(colours[1]))
    found = np.full((h, w), NOTHING, np.uint8)
    half, log_shaded = 0.5 * np.log(2.0 * np.pi), np.log(shaded)
    for i in range(h):
        for j in range(w):
            if not known[i, j]:
                continue
            s0, s1, s2 = spread[i, j, 0], spread[i, j, 1], spread[i, j, 2]
            b0 = max(lab[i, j, 0] + light[0], 1.0)
            b1 = lab[i, j, 1] + light[1] - 128.0
            b2 = lab[i, j, 2] + light[2] - 128.0
            x0, x1, x2 = float(image[i, j, 0]), image[i, j, 1] - 128.0, image[i, j, 2] - 128.0
            away = ((x0 - b0) / s0) ** 2 + ((x1 - b1) / s1) ** 2 + ((x2 - b2) / s2) ** 2
            scene = -0.5 * away - np.log(s0 * s1 * s2) - 3.0 * half
            # Most pixels show the scene unshaded, where a shadow cannot lower R further.
            if scene > enough[image[i, j, 0]]:
                found[i, j] = NOTHING - UNITS * MOST
                continue
            # In a shadow chroma shrinks with the light.
            share = min(max(x0 / b0, DARKEST), 1.0)
            tint = (tinted * (1.0 - share)) ** 2
            s1, s2 = np.sqrt(s1 * s1 + tint), np.sqrt(s2 * s2 + tint)
            off = ((x1 - share * b1) / s1) ** 2 + ((x2 - share * b2) / s2) ** 2
            off += ((x0 - share * b0) / s0) ** 2
            shade = log_shaded - 0.5 * off - np.log(s1 * s2 * ((1.0 - DARKEST) * b0 + 2.5 * s0)) - 2.0 * half
            more = max(scene, shade)
            behind = more + np.log1p(np.exp(min(scene, shade) - more))
            coloured = colours[0, image[i, j, 0]]
            grey = colours[1, image[i, j, 0]] - 0.5 * (x1 * x1 + x2 * x2) / chroma**2
            more = max(coloured, grey)
            something = more + np.log1p(np.exp(min(coloured, grey) - more))
            found[i, j] = np.uint8(NOTHING + np.rint(UNITS * min(max(something - behind, -MOST), MOST)))
    return found
