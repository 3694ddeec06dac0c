"""Clips as others might have filmed or played them, made of the frames there are; repeatable."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.evaluation.disturbances import Film, Image, every_second
from tracker.tables.keypoints import Marks

Way = NDArray[np.float64]

GAMMA = 2.4
CONTRAST, VEIL = 0.25, 90.0  # share that is left, and the grey level that haze adds
VIEW = 0.62  # share of the picture's width that a panning camera sees
LAG = 4.0  # frames over which its way is smoothed
STEADY = 1.0  # the same of a hip that stays
ROLL, ROLLS = 3.5, 1.5  # degrees to either side, and how often to and fro in a film
CLOSER = 1.3  # how much larger everything is at the end of a zoom


def against_light(film: Film) -> Film:
    """Dark tones crushed, as by exposing for a bright sky: grey levels to the power of 2.4."""
    curve = np.rint(255.0 * (np.arange(256) / 255.0) ** GAMMA).astype(np.uint8)
    return replace(film, images=[cv2.LUT(image, curve) for image in film.images])


def hazy(film: Film) -> Film:
    """A quarter of the contrast."""
    curve = np.rint(VEIL + CONTRAST * np.arange(256)).astype(np.uint8)
    return replace(film, images=[cv2.LUT(image, curve) for image in film.images])


def backwards(film: Film) -> Film:
    """The last frame first: who walks forwards walks backwards."""
    last = len(film.images) - 1
    marks = {last - frame: film.marks[frame] for frame in sorted(film.marks, reverse=True)}
    return replace(film, images=film.images[::-1], marks=marks)


def slowed(film: Film) -> Film:
    """Half speed at the same frame rate, with a picture between every two."""
    images = [film.images[0]]
    for before, after in zip(film.images, film.images[1:], strict=False):
        images += [between(before, after), after]
    return replace(film, images=images, marks={2 * frame: row for frame, row in film.marks.items()})


def doubled(film: Film) -> Film:
    """Twice the speed at the same frame rate: every second frame is dropped, and with it the marks in it."""
    return replace(every_second(film), fps=film.fps)


def panned(film: Film) -> Film:
    """A narrower picture that goes along with the hip."""
    height, width = film.images[0].shape[:2]
    seen = int(VIEW * width) // 2 * 2
    left = np.clip(_way(film, LAG) - 0.5 * seen, 0, width - seen).astype(int)
    return _through_lens(film, [_aside(x) for x in left], (seen, height))


def on_the_spot(film: Film) -> Film:
    """The picture moved so that the hip stays in its middle, drawn out at its edges."""
    left = _way(film, STEADY) - 0.5 * film.images[0].shape[1]
    return _through_lens(film, [_aside(x) for x in left])


def rolling(film: Film) -> Film:
    """A camera that rolls by 3.5 degrees to either side."""
    degrees = ROLL * np.sin(np.linspace(0.0, 2.0 * np.pi * ROLLS, len(film.images)))
    return _through_lens(film, [_about_middle(film, angle, 1.0) for angle in degrees])


def zooming(film: Film) -> Film:
    """A camera that zooms in evenly, up to 1.3 times the size."""
    sizes = np.linspace(1.0, CLOSER, len(film.images))
    return _through_lens(film, [_about_middle(film, 0.0, size) for size in sizes])


def _aside(left: float) -> Way:
    return np.array([[1.0, 0.0, -left], [0.0, 1.0, 0.0]])


def _about_middle(film: Film, degrees: float, size: float) -> Way:
    height, width = film.images[0].shape[:2]
    return np.asarray(cv2.getRotationMatrix2D((0.5 * width - 0.5, 0.5 * height - 0.5), degrees, size))


def _through_lens(film: Film, ways: Sequence[Way], size: tuple[int, int] | None = None) -> Film:
    """Pictures moved by affine maps (2, 3), of another width and height if given, drawn out at the edges."""
    size = size or film.images[0].shape[1::-1]
    images = [
        np.asarray(cv2.warpAffine(image, way, size, borderMode=cv2.BORDER_REPLICATE), np.uint8)
        for image, way in zip(film.images, ways, strict=True)
    ]
    marks: Marks = {frame: {} for frame in film.marks}
    for frame, row in film.marks.items():
        for name, mark in row.items():
            x, y = (ways[frame] @ (mark.x, mark.y, 1.0)).tolist()
            marks[frame][name] = replace(mark, x=x, y=y)
    return replace(film, images=images, marks=marks)


def _way(film: Film, spread: float) -> NDArray[np.float64]:
    """(T,) where the hip is, pixels, smoothed over this many frames."""
    frames = sorted(film.marks)
    hips = np.interp(np.arange(len(film.images)), frames, [film.marks[t]["hip"].x for t in frames])
    return np.asarray(cv2.GaussianBlur(hips[None], (0, 0), spread, borderType=cv2.BORDER_REPLICATE)[0])


FILMS: dict[str, Callable[[Film], Film]] = {
    "against the light": against_light,
    "in haze": hazy,
    "camera that goes along": panned,
    "camera that rolls": rolling,
    "camera that zooms": zooming,
    "played backwards": backwards,
    "half speed": slowed,
    "double speed": doubled,
}


def between(before: Image, after: Image) -> Image:
    """The picture half way: either frame moved by half the optical flow to the other, and their mean."""
    flow = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    greys = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in (before, after)]
    there, back = flow.calc(*greys, None), flow.calc(*greys[::-1], None)
    halves = [_moved(before, 0.5 * there), _moved(after, 0.5 * back)]
    return np.rint(np.mean(halves, axis=0)).astype(np.uint8)


def _moved(image: Image, way: NDArray[np.float32]) -> Image:
    """An image (h, w, 3) moved by a way (h, w, 2), pixels."""
    h, w = way.shape[:2]
    x, y = np.meshgrid(np.arange(w, dtype=np.float32), np.arange(h, dtype=np.float32))
    return cv2.remap(
        image, x - way[..., 0], y - way[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
