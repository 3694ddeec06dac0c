"""The scene behind the figure, as earlier frames have shown it, and how much a frame differs from it.

A point of the figure where the frame shows the scene is evidence against the pose; one where it differs is
evidence for it. A whole patch that shows the scene instead of the figure may be covered: something of the
scene is nearer there, a shrub or a post, and such points are no evidence about the pose.

The scene is stored at a coarse step and moves with the camera. Places that the figure may cover are not
updated, so those it covers from the start stay unknown until it has left them.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import cv2
import numpy as np

from tracker.compiled import compiled
from tracker.picture.pyramid import AS_FILMED, Array, Box, Flags, Image, Planes, lab

STEP = 0.03  # distance from one place of the scene to the next, leg lengths
NOISE = 8.0  # standard deviation of a frame about the scene, grey levels
ROBUST = 2.5  # Cauchy scale, multiples of the noise
UNKNOWN = 1.0  # assumed difference of a point of the figure from an unknown scene
ALIKE = 0.2  # difference below which a point shows the scene itself
MOST = 3.0  # largest difference that counts for one place
BLEND = np.float32(0.3)  # share of a frame in the updated scene
AROUND = np.ones((3, 3), np.uint8)  # places that must show the scene together; single ones do by chance
NEAR = 1  # error of the scene's shift, steps
SOME = 2000  # places from which a change of light is measured


@dataclass(frozen=True)
class Scenery:
    """How much a frame differs from the scene behind the figure.

    differs : (h, w) half the robust squared difference, in units of the noise
    step    : distance from one place to the next, pixels
    """

    differs: Planes
    step: int

    @cached_property
    def around(self) -> Planes:
        """(h, w) its maximum over each place and the places around."""
        return np.asarray(cv2.dilate(self.differs, AROUND), dtype=np.float32)

    def plain(self, pixels: Array) -> Flags:
        """(P,) whether the frame is known to show the scene at each of (P, 2) pixels."""
        h, w = self.differs.shape
        column, row = np.clip((pixels + 0.5).astype(int) // self.step, 0, (w - 1, h - 1)).T
        return np.asarray(self.differs[row, column] < ALIKE)


UNSEEN = Scenery(np.full((1, 1), UNKNOWN, np.float32), 1 << 30)


@dataclass(frozen=True)
class Backdrop:
    """The scene behind the figure after a frame.

    scene   : (h, w, 3) Lab grey levels
    known   : (h, w) whether it has been seen
    place   : (2,) whole steps by which the camera has shifted it since the first frame
    scenery : how the frame differed from it
    curve   : (256,) tone curve of grey levels
    """

    scene: Planes
    known: Flags
    place: tuple[int, int]
    scenery: Scenery
    curve: Image

    def follow(self, image: Image, box: Box, shift: Array) -> Self:
        """Compare the next frame with the scene, and update the scene from it.

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

    def _at(self, x: int, y: int) -> tuple[Planes, Flags]:
        """The scene, and where it is known, when the camera has shifted it by x, y whole steps."""
        if (x, y) == self.place:
            return self.scene, self.known
        h, w = self.known.shape
        way = np.array([[1.0, 0.0, x - self.place[0]], [0.0, 1.0, y - self.place[1]]])
        scene = cv2.warpAffine(self.scene, way, (w, h), flags=cv2.INTER_NEAREST)
        known = cv2.warpAffine(self.known.astype(np.uint8), way, (w, h), flags=cv2.INTER_NEAREST)
        return np.asarray(scene, dtype=np.float32), known > 0


def first_backdrop(image: Image, box: Box, unit: float, curve: Image = AS_FILMED) -> Backdrop:
    """The scene in the marked frame, outside the figure; a leg is `unit` pixels. See `Backdrop.follow`."""
    step = max(round(STEP * unit), 1)
    scene = small(image, step, curve)
    known = np.ones(scene.shape[:2], dtype=bool)
    known[_area(box, step, known.shape)] = False
    scenery = Scenery(np.full(known.shape, UNKNOWN, np.float32), step)
    return Backdrop(scene, known, (0, 0), scenery, curve)


def small(image: Image, step: int, curve: Image = AS_FILMED) -> Planes:
    """The frame's Lab grey levels (h, w, 3) through a tone curve, averaged over squares of `step` pixels.

    Squares that reach beyond the frame have the values of those beside them.
    """
    whole = lab(image, step, curve)
    below, beside = (int(side > n * step) for side, n in zip(image.shape[:2], whole.shape[:2], strict=True))
    return np.asarray(cv2.copyMakeBorder(whole, 0, below, 0, beside, cv2.BORDER_REPLICATE), dtype=np.float32)


def _difference(now: Planes, scene: Planes, known: Flags, area: tuple[slice, slice]) -> Planes:
    """(h, w) the difference of `Scenery` within an area; unknown elsewhere."""
    differs = np.full(known.shape, UNKNOWN, np.float32)
    if not known.any() or not known[area].size:
        return differs
    places = np.flatnonzero(known)
    some = places[:: max(len(places) // SOME, 1)]
    light = np.median(now.reshape(-1, 3)[some] - scene.reshape(-1, 3)[some], axis=0)
    least = np.empty(known[area].shape, np.float32)
    _nearest(now[area] - light.astype(np.float32), scene, area[0].start, area[1].start, least)
    rho = 0.5 * ROBUST**2 * np.log1p(least / (3.0 * NOISE**2 * ROBUST**2))
    differs[area] = np.where(known[area], np.minimum(rho, MOST), UNKNOWN)
    return differs


@compiled()
def _nearest(here: Planes, scene: Planes, top: int, left: int, least: Planes) -> None:
    """Write to `least` each place's least squared distance of colour from the scene within a step."""
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
