"""What lies behind the figure: the scene as it was seen without it, and how far a frame differs from that.

A point of the figure that shows just what is seen there without it speaks against the pose that put it
there, one that differs speaks for it. A whole patch that shows the scene as it was, and not the figure, may
be covered: the scene is nearer there, a shrub or a post, and such points tell nothing of the pose.

The scene is kept at a coarse step and moves with the camera; what the figure may cover is not taken over, so
what it has covered from the start stays unknown until it has left.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.sampling import Array, Box, Image, Planes

STEP = 0.03  # leg lengths from one place of the scene to the next
NOISE = 8.0  # of a match, grey levels
ROBUST = 2.5  # Cauchy scale, multiples of the noise
UNKNOWN = 1.0  # how much a point of the figure differs from what lies behind it, where that is not known
ALIKE = 0.2  # it differs by less where it shows the scene itself
MOST = 3.0  # one very different place may be anything
BLEND = 0.3  # of what is seen into the scene, a frame
AROUND = np.ones((3, 3), np.uint8)  # of places that show the scene together: single ones do by chance
NEAR = 1  # steps by which the scene may have been moved wrongly


@dataclass(frozen=True)
class Scenery:
    """How much a frame differs from what lies behind the figure.

    differs : (h, w) half the robust squared difference, in units of the noise
    step    : pixels from one place to the next
    """

    differs: Planes
    step: int

    @cached_property
    def around(self) -> Planes:
        """(h, w) the most of it at each place and those around."""
        return np.asarray(cv2.dilate(self.differs, AROUND), dtype=np.float32)

    def plain(self, pixels: Array) -> float:
        """Share of (P, 2) pixels where the frame is known not to differ."""
        h, w = self.differs.shape
        column, row = np.clip((pixels + 0.5).astype(int) // self.step, 0, (w - 1, h - 1)).T
        return float((self.differs[row, column] < ALIKE).mean())


UNSEEN = Scenery(np.full((1, 1), UNKNOWN, np.float32), 1 << 30)


@dataclass(frozen=True)
class Backdrop:
    """The scene behind the figure after a frame.

    scene   : (h, w, 3) Lab grey levels
    known   : (h, w) whether it has been seen
    place   : (2,) whole steps by which the camera has shifted it since the first frame
    scenery : how the frame differed from it
    """

    scene: Planes
    known: NDArray[np.bool_]
    place: tuple[int, int]
    scenery: Scenery

    def follow(self, image: Image, box: Box, shift: Array) -> Self:
        """One frame on.

        Args:
            image: (H, W, 3) RGB.
            box: (x0, y0, x1, y1) pixels that the figure may cover.
            shift: (2,) pixels by which the camera has shifted the scene since the first frame.
        """
        step = self.scenery.step
        now, area = _small(image, step), _area(box, step, self.known.shape)
        x, y = np.rint(shift / step).astype(int).tolist()
        scene, known = self._at(x, y)
        scenery = Scenery(_difference(now, scene, known, area), step)
        seen = np.ones_like(known)
        seen[area] = False
        share = np.where(known, BLEND, 1.0) * seen
        scene = (scene + share[..., None] * (now - scene)).astype(np.float32)
        return type(self)(scene, known | seen, (x, y), scenery)

    def _at(self, x: int, y: int) -> tuple[Planes, NDArray[np.bool_]]:
        """Scene and what is known of it where the camera has shifted it to."""
        if (x, y) == self.place:
            return self.scene, self.known
        h, w = self.known.shape
        way = np.array([[1.0, 0.0, x - self.place[0]], [0.0, 1.0, y - self.place[1]]])
        scene = cv2.warpAffine(self.scene, way, (w, h), flags=cv2.INTER_NEAREST)
        known = cv2.warpAffine(self.known.astype(np.uint8), way, (w, h), flags=cv2.INTER_NEAREST)
        return np.asarray(scene, dtype=np.float32), known > 0


def first_backdrop(image: Image, box: Box, unit: float) -> Backdrop:
    """What the marked frame shows beside the figure, a leg of which is unit pixels; see `Backdrop.follow`."""
    step = max(round(STEP * unit), 1)
    scene = _small(image, step)
    known = np.ones(scene.shape[:2], dtype=bool)
    known[_area(box, step, known.shape)] = False
    return Backdrop(scene, known, (0, 0), Scenery(np.full(known.shape, UNKNOWN, np.float32), step))


def _difference(now: Planes, scene: Planes, known: NDArray[np.bool_], area: tuple[slice, slice]) -> Planes:
    """(h, w) of `Scenery` within an area, elsewhere unknown."""
    differs = np.full(known.shape, UNKNOWN, np.float32)
    if not known.any() or not known[area].size:
        return differs
    light = np.median((now - scene)[known][:: max(known.size // 2000, 1)], axis=0)
    least = np.full(known[area].shape, np.inf, np.float32)
    wide = cv2.copyMakeBorder(scene, NEAR, NEAR, NEAR, NEAR, cv2.BORDER_REPLICATE)
    rows, columns = area
    here = now[area] - light.astype(np.float32)
    for i in range(2 * NEAR + 1):
        for j in range(2 * NEAR + 1):
            there = wide[rows.start + i : rows.stop + i, columns.start + j : columns.stop + j]
            apart = here - there
            least = np.minimum(least, np.einsum("...c,...c", apart, apart))
    rho = 0.5 * ROBUST**2 * np.log1p(least / (3.0 * NOISE**2 * ROBUST**2))
    differs[area] = np.where(known[area], np.minimum(rho, MOST), UNKNOWN)
    return differs


def _area(box: Box, step: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Rows and columns of the scene that a box of pixels touches."""
    x0, y0, x1, y1 = (int(side // step) for side in box)
    h, w = shape[:2]
    return slice(max(y0, 0), max(min(y1 + 1, h), 0)), slice(max(x0, 0), max(min(x1 + 1, w), 0))


def _small(image: Image, step: int) -> Planes:
    """The frame's Lab grey levels, one mean for each step by step pixels."""
    H, W = image.shape[:2]
    whole = cv2.copyMakeBorder(image, 0, -H % step, 0, -W % step, cv2.BORDER_REPLICATE)
    small = cv2.resize(whole, None, fx=1.0 / step, fy=1.0 / step, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(small, cv2.COLOR_RGB2Lab), dtype=np.float32)
