"""The log odds of a whole film, sampled around a figure for fitting its outline."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from kinematics.figure import Array
from tracker.often import USUAL, often
from tracker.outline.shape import Grid
from tracker.picture.pyramid import Image, Planes
from tracker.survey.evidence import NOTHING, UNITS

WEIGHT = 25.0  # nats for a square leg length of log odds where a figure is sought


@dataclass(frozen=True)
class Stage:
    """The log odds of a film.

    odds   : (T, h, w) as `tracker.survey.evidence` stores them
    light  : (T, h, w) lightness of the same pixels
    up     : (3, 3) map from their pixels to the film's
    places : (T, 3, 3) map from each frame's pixels of the film to the first frame's
    facing : +1 if the figure faces right, -1 left
    fps    : frames a second
    shares : (T,) the light of each frame as a share of the scene's
    """

    odds: Image
    light: Image
    up: Array
    places: Array
    facing: int
    fps: float
    shares: Array

    def __len__(self) -> int:
        return len(self.odds)

    @property
    def often(self) -> float:
        """Frames for each at 30 a second, see `tracker.often`, of which each counts as much less."""
        return often(self.fps)

    @property
    def rate(self) -> float:
        """Frames in the time of one at 30 a second, at lower rates a share of one: for lengths of time."""
        return self.fps / USUAL

    @property
    def zoom(self) -> Array:
        """(T,) pixels of the first frame in a pixel of each frame."""
        return np.asarray(np.hypot(self.places[:, 0, 0], self.places[:, 1, 0]))

    def part(self, frames: slice) -> "Stage":
        """The film's log odds reduced to some of its frames."""
        odds, light = self.odds[frames], self.light[frames]
        return replace(self, odds=odds, light=light, places=self.places[frames], shares=self.shares[frames])

    def around(self, hips: Array, units: Array, grid: Grid) -> Planes:
        """(T, *grid.shape) log odds R, nats.

        Args:
            hips: (T, 2) pixels of the film in each frame.
            units: (T,) leg lengths in pixels.
        """
        down, found = np.linalg.inv(self.up), np.empty((len(self), *grid.shape), np.float32)
        pixels = round(float(np.median(units)) / self.up[0, 0] / grid.density)
        size = grid.shape[::-1]
        for t, (hip, unit) in enumerate(zip(hips, units, strict=True)):
            step = unit / grid.density
            x, y = hip[0] + self.facing * unit * grid.corner[0], hip[1] - unit * grid.corner[1]
            way = down @ np.array([[self.facing * step, 0.0, x], [0.0, step, y], [0.0, 0.0, 1.0]])
            how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
            cut = cv2.warpAffine(blurred(self.odds[t], pixels), way[:2], size, flags=how, borderValue=NOTHING)
            found[t] = (cut.astype(np.float32) - NOTHING) / UNITS
        return found

    def at(self, images: Image, hips: Array, units: Array, places: Array, beyond: int | None = None) -> Array:
        """(T, P) stored values of the odds or the light at places relative to figures as in `around`.

        Args:
            places: (T, P, 2) body coordinates.
            beyond: value outside the images, None for the one at their edge.
        """
        pixels = hips[:, None] + places * units[:, None, None] * np.array([self.facing, -1.0])
        small = (_with_one(pixels) @ np.linalg.inv(self.up)[:2].T).astype(np.float32)
        found = np.empty(places.shape[:2])
        for t, at in enumerate(small):
            x, y = np.ascontiguousarray(at.T)
            edge = cv2.BORDER_REPLICATE if beyond is None else cv2.BORDER_CONSTANT
            here = cv2.remap(images[t], x, y, cv2.INTER_LINEAR, borderMode=edge, borderValue=beyond or 0)
            found[t] = here[:, 0]
        return found

    def in_scene(self, pixels: Array) -> Array:
        """(T, 2) pixels of each frame converted to the first frame's."""
        return np.asarray(np.einsum("tij,tj->ti", self.places[:, :2], _with_one(pixels)))

    def travel(self, hips: Array, units: Array) -> float:
        """Travel of a hip, as in `around`, to the right over the scene in all the frames, leg lengths."""
        begins, ends = self.in_scene(hips)[[0, -1], 0]
        return float((ends - begins) / np.median(units * self.zoom))

    def in_frames(self, pixels: Array) -> Array:
        """(T, 2) pixels of the first frame converted to each frame's."""
        return np.asarray(np.einsum("tij,tj->ti", np.linalg.inv(self.places)[:, :2], _with_one(pixels)))


def blurred(image: Image, size: int) -> Image:
    """The means over squares of `size` pixels; if it is even, pixels at their edges count half."""
    if size < 2:
        return image
    box = np.full(size + 1 - size % 2, 1.0 / size)
    if size % 2 == 0:
        box[[0, -1]] *= 0.5
    return np.asarray(cv2.sepFilter2D(image, -1, box, box), dtype=np.uint8)


def _with_one(pixels: Array) -> Array:
    return np.concatenate([pixels, np.ones((*pixels.shape[:-1], 1))], axis=-1)
