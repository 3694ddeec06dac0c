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

from tracker.compiled import compiled
from tracker.picture.pyramid import AS_FILMED, Array, Box, Image, Planes

STEP = 0.03  # leg lengths from one place of the scene to the next
NOISE = 8.0  # of a match, grey levels
ROBUST = 2.5  # Cauchy scale, multiples of the noise
UNKNOWN = 1.0  # how much a point of the figure differs from what lies behind it, where that is not known
ALIKE = 0.2  # it differs by less where it shows the scene itself
MOST = 3.0  # one very different place may be anything
BLEND = np.float32(0.3)  # of what is seen into the scene, a frame
AROUND = np.ones((3, 3), np.uint8)  # of places that show the scene together: single ones do by chance
NEAR = 1  # steps by which the scene may have been moved wrongly
SOME = 2000  # places that a change of light is taken from


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

    def plain(self, pixels: Array) -> NDArray[np.bool_]:
        """(P,) at which of (P, 2) pixels the frame is known not to differ."""
        return np.asarray(self._at(pixels) < ALIKE)

    def outstanding(self, pixels: Array) -> NDArray[np.bool_]:
        """(P,) at which of (P, 2) pixels the frame is known to differ."""
        differs = self._at(pixels)
        return np.asarray((differs >= ALIKE) & (differs != UNKNOWN))

    def _at(self, pixels: Array) -> Planes:
        h, w = self.differs.shape
        column, row = np.clip((pixels + 0.5).astype(int) // self.step, 0, (w - 1, h - 1)).T
        return np.asarray(self.differs[row, column])


UNSEEN = Scenery(np.full((1, 1), UNKNOWN, np.float32), 1 << 30)


@dataclass(frozen=True)
class Backdrop:
    """The scene behind the figure after a frame.

    scene   : (h, w, 3) Lab grey levels
    known   : (h, w) whether it has been seen
    place   : (2,) whole steps by which the camera has shifted it since the first frame
    scenery : how the frame differed from it
    curve   : (256,) what grey levels become
    """

    scene: Planes
    known: NDArray[np.bool_]
    place: tuple[int, int]
    scenery: Scenery
    curve: Image

    def follow(self, image: Image, box: Box, shift: Array) -> Self:
        """Compare the next frame with the scene, and add what it shows of it.

        Args:
            image: (H, W, 3) RGB.
            box: (x0, y0, x1, y1) pixels that the figure may cover.
            shift: (2,) pixels by which the camera has shifted the scene since the first frame.
        """
        step = self.scenery.step
        now, area = small(image, step, self.curve), _area(box, step, self.known.shape)
        x, y = np.rint(shift / step).astype(int).tolist()
        scene, known = self._at(x, y)
        scenery = Scenery(_difference(now, scene, known, area), step)
        seen = np.ones_like(known)
        seen[area] = False
        share = np.where(known, BLEND, np.float32(1.0)) * seen
        scene = scene + share[..., None] * (now - scene)
        return type(self)(scene, known | seen, (x, y), scenery, self.curve)

    def _at(self, x: int, y: int) -> tuple[Planes, NDArray[np.bool_]]:
        """Scene and what is known of it where the camera has shifted it to."""
        if (x, y) == self.place:
            return self.scene, self.known
        h, w = self.known.shape
        way = np.array([[1.0, 0.0, x - self.place[0]], [0.0, 1.0, y - self.place[1]]])
        scene = cv2.warpAffine(self.scene, way, (w, h), flags=cv2.INTER_NEAREST)
        known = cv2.warpAffine(self.known.astype(np.uint8), way, (w, h), flags=cv2.INTER_NEAREST)
        return np.asarray(scene, dtype=np.float32), known > 0


def first_backdrop(image: Image, box: Box, unit: float, curve: Image = AS_FILMED) -> Backdrop:
    """What the marked frame shows beside the figure, a leg of which is unit pixels; see `Backdrop.follow`."""
    step = max(round(STEP * unit), 1)
    scene = small(image, step, curve)
    known = np.ones(scene.shape[:2], dtype=bool)
    known[_area(box, step, known.shape)] = False
    scenery = Scenery(np.full(known.shape, UNKNOWN, np.float32), step)
    return Backdrop(scene, known, (0, 0), scenery, curve)


def small(image: Image, step: int, curve: Image = AS_FILMED) -> Planes:
    """The frame's Lab grey levels (h, w, 3), one mean for each step by step pixels, through a tone curve."""
    H, W = image.shape[:2]
    whole = cv2.copyMakeBorder(image, 0, -H % step, 0, -W % step, cv2.BORDER_REPLICATE)
    less = cv2.resize(whole, None, fx=1.0 / step, fy=1.0 / step, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(cv2.LUT(less, curve), cv2.COLOR_RGB2Lab), dtype=np.float32)


def _difference(now: Planes, scene: Planes, known: NDArray[np.bool_], area: tuple[slice, slice]) -> Planes:
    """(h, w) of `Scenery` within an area, elsewhere unknown."""
    differs = np.full(known.shape, UNKNOWN, np.float32)
    if not known.any() or not known[area].size:
        return differs
    some = np.flatnonzero(known)[:: max(known.size // SOME, 1)]
    light = np.median(now.reshape(-1, 3)[some] - scene.reshape(-1, 3)[some], axis=0)
    least = np.empty(known[area].shape, np.float32)
    _nearest(now[area] - light.astype(np.float32), scene, area[0].start, area[1].start, least)
    rho = 0.5 * ROBUST**2 * np.log1p(least / (3.0 * NOISE**2 * ROBUST**2))
    differs[area] = np.where(known[area], np.minimum(rho, MOST), UNKNOWN)
    return differs


@compiled()
def _nearest(here: Planes, scene: Planes, top: int, left: int, least: Planes) -> None:
    """Squared distance of each place's colour to the scene's there or a step beside, whichever is less."""
    last_row, last_column = scene.shape[0] - 1, scene.shape[1] - 1
    for i in range(here.shape[0]):
        for j in range(here.shape[1]):
            best = np.float32(np.inf)
            for r in range(top + i - NEAR, top + i + NEAR + 1):
                for s in range(left + j - NEAR, left + j + NEAR + 1):
                    square = np.float32(0.0)
                    for c in range(3):
                        there = scene[min(max(r, 0), last_row), min(max(s, 0), last_column), c]
                        square += (here[i, j, c] - there) ** 2
                    best = min(best, square)
            least[i, j] = best


def _area(box: Box, step: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Rows and columns of the scene that a box of pixels touches."""
    x0, y0, x1, y1 = (int(side // step) for side in box)
    h, w = shape[:2]
    return slice(max(y0, 0), max(min(y1 + 1, h), 0)), slice(max(x0, 0), max(min(x1 + 1, w), 0))
