"""Clips as others might have filmed or played them, made of the frames there are; repeatable."""

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.evaluation.disturbances import Film, Image, every_second
from tracker.tables.keypoints import Mark, Marks

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
    width = film.images[0].shape[1]
    seen = int(VIEW * width) // 2 * 2
    left = np.clip(_way(film, LAG) - 0.5 * seen, 0, width - seen).astype(int)
    images = [
        np.ascontiguousarray(image[:, x : x + seen]) for image, x in zip(film.images, left, strict=True)
    ]
    return replace(film, images=images, marks=_left_of(film.marks, left))


def on_the_spot(film: Film) -> Film:
    """The picture moved so that the hip stays in its middle, drawn out at its edges."""
    height, width = film.images[0].shape[:2]
    left = _way(film, STEADY) - 0.5 * width
    ways = [np.array([[1.0, 0.0, -x], [0.0, 1.0, 0.0]]) for x in left]
    images = [
        np.asarray(cv2.warpAffine(image, way, (width, height), borderMode=cv2.BORDER_REPLICATE), np.uint8)
        for image, way in zip(film.images, ways, strict=True)
    ]
    return replace(film, images=images, marks=_left_of(film.marks, left))


def rolling(film: Film) -> Film:
    """A camera that rolls by 3.5 degrees to either side."""
    turns = np.linspace(0.0, 2.0 * np.pi * ROLLS, len(film.images))
    return _through_lens(film, ROLL * np.sin(turns), np.ones(len(turns)))


def zooming(film: Film) -> Film:
    """A camera that zooms in evenly, up to 1.3 times the size."""
    T = len(film.images)
    return _through_lens(film, np.zeros(T), np.linspace(1.0, CLOSER, T))


def _through_lens(film: Film, degrees: NDArray[np.float64], size: NDArray[np.float64]) -> Film:
    """Pictures turned about their middle by (T,) degrees and (T,) times as large, drawn out at the edges."""
    height, width = film.images[0].shape[:2]
    middle = 0.5 * width - 0.5, 0.5 * height - 0.5
    ways = [np.asarray(cv2.getRotationMatrix2D(middle, *each)) for each in zip(degrees, size, strict=True)]
    images = [
        np.asarray(cv2.warpAffine(image, way, (width, height), borderMode=cv2.BORDER_REPLICATE), np.uint8)
        for image, way in zip(film.images, ways, strict=True)
    ]
    marks = {
        frame: {name: _seen_through(mark, ways[frame]) for name, mark in row.items()}
        for frame, row in film.marks.items()
    }
    return replace(film, images=images, marks=marks)


def _seen_through(mark: Mark, way: NDArray[np.float64]) -> Mark:
    x, y = (way @ (mark.x, mark.y, 1.0)).tolist()
    return replace(mark, x=x, y=y)


def _way(film: Film, spread: float) -> NDArray[np.float64]:
    """(T,) where the hip is, pixels, smoothed over this many frames."""
    frames = sorted(film.marks)
    hips = np.interp(np.arange(len(film.images)), frames, [film.marks[t]["hip"].x for t in frames])
    return np.asarray(cv2.GaussianBlur(hips[None], (0, 0), spread, borderType=cv2.BORDER_REPLICATE)[0])


def _left_of(marks: Marks, left: NDArray[np.generic]) -> Marks:
    """The marks in pictures that begin so many pixels (T,) further right."""
    return {
        frame: {name: replace(mark, x=mark.x - float(left[frame])) for name, mark in row.items()}
        for frame, row in marks.items()
    }


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
