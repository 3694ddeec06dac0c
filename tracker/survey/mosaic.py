"""The scene without the people who walk through it: the median of the frames, aligned by the camera's path.

A place that people cover in less than half of the frames has the median of the empty scene. The spread about
the median combines the median absolute deviation of the frames, the gradient of the picture, along which a
small error of the camera's path changes grey levels, and noise of coding and unsteady light, which is less
where the film has little contrast or the place is dark.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from tracker.compiled import compiled
from tracker.picture.light import light_of, relit_lab
from tracker.picture.pyramid import LEVELS, Array, Flags, Image, Ints, Planes

FEWEST = 5  # frames that must show a place
NOISE = np.array([5.0, 2.5, 2.5], np.float32)  # noise of coding and light in L, a and b, grey levels
LEAST = 1.0  # least value of it
FULL = 170.0  # grey levels from the darkest to the brightest of a film with full contrast
FLATTEST = 0.1  # least contrast that is distinguished, as a share of that
DARK = 60.0  # lightness below which colours are closer to each other
SLIP = 0.3  # error of the camera's path, pixels of the small picture
SIGMA = 1.4826  # standard deviation of a Gaussian over its median absolute deviation
GREY, HARDLY = 128, 3  # stored chroma of grey, and its error by coding
SOME = 3  # every such row and column is checked for colours and light
AT_ONCE = 24 * 2**20  # size of the pictures whose medians are taken together, bytes
LITTLE = 0.05  # change of light, natural logarithm, up to which it is called steady
COMMON = 0.25  # of a change common to the picture, share by which the median pixel's change deviates at most
ROUNDS = 3  # of measuring the light by the scene that the round before gave
LINEAR = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
BEYOND = 255  # value of missing pixels, which sort last
LARGEST = 6.0  # largest area of the mosaic in pictures; the scene beyond it stays unknown


@dataclass(frozen=True)
class Scene:
    """A mosaic of a film without the people who walk through it.

    lab    : (h, w, 3) grey levels
    spread : (h, w, 3) standard deviation of a frame about it, grey levels
    known  : (h, w) whether enough frames show it
    corner : (2,) its top-left pixel, in pixels of the first frame
    colourless : whether the film is black and white
    contrast   : from its darkest to its brightest as a share of a film's with full contrast, at most 1
    steady     : whether its light is taken as filmed: it hardly changes, or not as a whole
    """

    lab: Planes
    spread: Planes
    known: Flags
    corner: Array
    colourless: bool = False
    contrast: float = 1.0
    steady: bool = True

    def seen(self, place: Array, size: tuple[int, int]) -> tuple[Planes, Planes, Flags]:
        """`lab`, `spread` and `known` in a picture of this size, whose place maps it to the first frame."""
        way = place.copy()
        way[:2, 2] -= self.corner
        share = cv2.warpAffine(np.uint8(255) * self.known, way[:2], size, flags=LINEAR)
        known = share == 255  # wherever no unknown place is mixed in
        return _seen(self.lab, way, size), _seen(self.spread, way, size), known

    def light(self, image: Image, place: Array) -> tuple[float, float]:
        """The light of a picture (h, w, 3), Lab, uint8, with a place as in `seen`; see `light_of`."""
        some = image[::SOME, ::SOME]
        lab, _, known = self.seen(place @ np.diag([SOME, SOME, 1.0]), some.shape[1::-1])
        return light_of(some, lab, known)


def scene_of(images: Sequence[Image], places: Sequence[Array]) -> Scene:
    """The scene from small pictures (h, w, 3), Lab, uint8, with places as in `Scene.seen`.

    It has their median light if their light changes as a whole.
    """
    as_filmed = scene = _scene(images, places)
    for _ in range(ROUNDS):
        lights = [scene.light(image, place) for image, place in zip(images, places, strict=True)]
        changes = np.abs(np.log([share for share, _ in lights]))
        if changes.max() <= LITTLE:
            return as_filmed
        even = [relit_lab(image, share) for image, (share, _) in zip(images, lights, strict=True)]
        scene = replace(_scene(even, places), steady=False)
    apart = np.array([apart for _, apart in lights]) / np.maximum(changes, LITTLE)
    return scene if np.median(apart[changes > LITTLE]) < COMMON else as_filmed


def _seen(planes: Planes, way: Array, size: tuple[int, int]) -> Planes:
    """A mosaic's planes resampled to a frame of this size."""
    if planes.shape[1::-1] == size and np.array_equal(way, np.eye(3)):
        return planes
    return np.asarray(cv2.warpAffine(planes, way[:2], size, flags=LINEAR, borderMode=cv2.BORDER_REPLICATE))


def _scene(images: Sequence[Image], places: Sequence[Array]) -> Scene:
    corner, (width, height) = _frame(images[0].shape, places)
    rows = max(AT_ONCE // (3 * len(images) * width), 1)
    parts = [
        _medians(images, places, corner + np.array([0.0, top]), (width, min(rows, height - top)))
        for top in range(0, height, rows)
    ]
    lab, away, number = (np.concatenate(part) for part in zip(*parts, strict=True))
    spread = SIGMA * away.astype(np.float32)
    planes = lab.astype(np.float32)
    slope = np.hypot(*(cv2.Sobel(planes, -1, dx, 1 - dx, ksize=3, scale=0.125) for dx in (1, 0)))
    colourless, contrast = _colourless(images), _contrast(images)
    noise = np.maximum(apart(planes[..., :1], contrast) * NOISE, LEAST)
    if colourless:  # what has no colour has none anywhere
        noise[..., 1:] = NOISE[1:]
    spread = np.sqrt(noise**2 + spread**2 + (SLIP * slope) ** 2).astype(np.float32)
    return Scene(planes, spread, number >= min(FEWEST, len(images)), corner, colourless, contrast)


def _medians(
    images: Sequence[Image], places: Sequence[Array], corner: Array, size: tuple[int, int]
) -> tuple[Image, Image, Ints]:
    """(h, w, 3) medians of what is seen of a part of the scene, and of how far it is from them.

    With them (h, w) how many frames show it. The part has this top-left corner, width and height.
    """
    views = np.full((len(images), size[1], size[0], 3), BEYOND, np.uint8)
    shown = np.zeros((len(images), size[1], size[0]), bool)
    for t, (image, place) in enumerate(zip(images, places, strict=True)):
        way = place.copy()
        way[:2, 2] -= corner
        whole = np.ones(image.shape[:2], np.uint8)
        shown[t] = cv2.warpAffine(whole, way[:2], size, flags=cv2.INTER_NEAREST) > 0
        cv2.warpAffine(image, way[:2], size, dst=views[t], borderMode=cv2.BORDER_REPLICATE)
        views[t][~shown[t]] = BEYOND
    number = shown.sum(0)
    middle, spread = np.empty_like(views[0]), np.empty_like(views[0])
    _lower_medians(views, number, middle)
    away = np.asarray(np.maximum(views, middle) - np.minimum(views, middle), dtype=np.uint8)
    np.copyto(away, BEYOND, where=~shown[..., None])
    _lower_medians(away, number, spread)
    return middle, spread, number


@compiled()
def _lower_medians(values: Image, number: Ints, middle: Image) -> None:
    """Write the lower median of the first `number` (h, w) in order of values (T, h, w, 3) to `middle`."""
    count = np.zeros(LEVELS, np.intp)
    for i in range(values.shape[1]):
        for j in range(values.shape[2]):
            for c in range(values.shape[3]):
                for level in range(LEVELS):
                    count[level] = 0
                for t in range(len(values)):
                    count[values[t, i, j, c]] += 1
                level, fewer = 0, count[0]
                while fewer <= (max(number[i, j], 1) - 1) // 2:
                    level += 1
                    fewer += count[level]
                middle[i, j, c] = level


def apart(light: Array | Planes, contrast: float) -> Array:
    """Distance of colours at a lightness, as a share of that in full light and contrast."""
    return np.clip(light / DARK, 0.0, contrast)


def _contrast(images: Sequence[Image]) -> float:
    """Range from the darkest to the brightest of the film, as a share of FULL."""
    low, high = np.percentile([image[::3, ::3, 0] for image in images[::5]], [0.1, 99.9])
    return float(np.clip((high - low) / FULL, FLATTEST, 1.0))


def _colourless(images: Sequence[Image]) -> bool:
    """Whether no picture has a colour."""
    chroma = (np.abs(image[::SOME, ::SOME, 1:].astype(np.int16) - GREY) for image in images)
    return all(each.max() <= HARDLY for each in chroma)


def _frame(shape: tuple[int, ...], places: Sequence[Array]) -> tuple[Array, tuple[int, int]]:
    """Top-left corner (2,) of the mosaic and its width and height."""
    h, w = shape[:2]
    corners = np.array([[0.0, 0.0, 1.0], [w - 1.0, 0.0, 1.0], [0.0, h - 1.0, 1.0], [w - 1.0, h - 1.0, 1.0]]).T
    low, high = np.zeros(2), np.array([w - 1.0, h - 1.0])
    for place in places:
        found = (place @ corners)[:2]
        lower, higher = np.minimum(low, found.min(1)), np.maximum(high, found.max(1))
        if np.prod(higher - lower + 1.0) > LARGEST * h * w:
            break
        low, high = lower, higher
    low, high = np.floor(low), np.ceil(high)
    return low, (int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1)
