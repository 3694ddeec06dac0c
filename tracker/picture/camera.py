"""A camera that moves: by how many pixels the scene behind the figure has shifted since the marked frame.

Corners of the background, the best of every cell of a grid, are followed by pyramidal Lucas-Kanade (Bouguet
2001) from a key frame into the present one, both small and less their local mean; the shift is the median of
those that agree. Errors do not add up from frame to frame, as a key frame is kept until too few of its
corners are left to tell; then the frame before the present one takes its place.

A camera is still, its shift exactly zero, until it is seen to move by more than STILL. A scene of few
corners, such as a bare wall with a shadow on it, shows nothing of the camera, whose shift then stays.
"""

from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np

from tracker.picture.corners import Corners, sharpest, sharpness
from tracker.picture.pyramid import Array, Box, Image

# Lengths are in pixels of the small picture.
SIZE = 160  # of its longer side at most
CELL = 10  # of the grid, no more than one corner in each
WINDOW = 9  # that is compared around a corner
HALVINGS = 2  # of the small picture, for long ways
CONTRAST = 3.0  # grey levels a pixel along a corner's weaker direction, root mean square
FEWEST = 30  # corners that a shift is believed of
AGREE = 1.0  # from their median
SPREAD = 0.125  # standard deviation across the picture, shares of its width: less may be one walker
STILL = 0.25  # 1 pixel of 640: what the noise of video, clouds and leaves shift a still scene by


@dataclass(frozen=True)
class Scene:
    """A frame that others may be compared with.

    image : (h, w) small and grey, less its local mean
    box   : (x0, y0, x1, y1) around the figure, pixels of the small image
    shift : (2,) the scene's in this frame, pixels of the video
    """

    image: Image
    box: Box
    shift: Array


@dataclass(frozen=True)
class Camera:
    """What is known of the camera after a frame.

    last    : the frame
    key     : what frames are compared with
    corners : (P, 2) of the key frame, beside the figure
    moves   : whether the camera has been seen to move
    """

    last: Scene
    key: Scene
    corners: Corners
    moves: bool = False

    @property
    def shift(self) -> Array:
        """(2,) pixels by which the scene lies further right and down than in the marked frame."""
        return self.last.shift

    def follow(self, image: Image, box: Box) -> Self:
        """Find where the camera looks in the next frame.

        Args:
            image: (H, W, 3) RGB.
            box: (x0, y0, x1, y1) pixels around the figure, which moves by itself.
        """
        now, factor = _scene(image, box, self.shift)
        key, corners = self.key, self.corners
        way = _way(key, corners, now, factor)
        if way is None:
            key, corners = self.last, _corners(self.last)
            way = _way(key, corners, now, factor)
        if way is None:  # the old key may be recognised when a cover is gone
            return replace(self, last=now)
        shift = key.shift + way
        moves = self.moves or bool(np.abs(shift).max() > STILL * factor)
        return type(self)(replace(now, shift=shift) if moves else now, key, corners, moves)


def first_camera(image: Image, box: Box) -> Camera:
    """The camera in the marked frame; image and box as in `Camera.follow`."""
    scene, _ = _scene(image, box, np.zeros(2))
    return Camera(scene, scene, _corners(scene))


def _scene(image: Image, box: Box, shift: Array) -> tuple[Scene, int]:
    """A frame made small, and how many pixels of the video each of its pixels spans."""
    H, W = image.shape[:2]
    factor = -(-max(H, W) // SIZE)
    h, w = max(H // factor, 1), max(W // factor, 1)
    # Means over whole blocks of pixels are fast, and move with the scene exactly.
    grey = cv2.cvtColor(image[: h * factor, : w * factor], cv2.COLOR_RGB2GRAY)
    small = cv2.resize(grey, (w, h), interpolation=cv2.INTER_AREA)
    # Less its surroundings, or a change of light would look like a way of every slope.
    around = cv2.boxFilter(small, -1, (2 * WINDOW + 1, 2 * WINDOW + 1))
    plain = cv2.addWeighted(small, 1.0, around, -1.0, 128.0)
    x0, y0, x1, y1 = (side / factor for side in box)
    return Scene(plain.astype(np.uint8, copy=False), (x0, y0, x1, y1), shift), factor


def _corners(scene: Scene) -> Corners:
    """The sharpest corner of every cell that has one."""
    sharp = sharpness(scene.image, WINDOW)
    edge = WINDOW // 2
    inner = np.zeros_like(sharp)
    inner[edge:-edge, edge:-edge] = sharp[edge:-edge, edge:-edge]
    x0, y0, x1, y1 = (int(np.clip(side, 0.0, SIZE)) for side in scene.box)
    inner[y0 : y1 + 1, x0 : x1 + 1] = 0.0
    return sharpest(inner, CELL, CONTRAST)


def _way(key: Scene, corners: Corners, now: Scene, factor: int) -> Array | None:
    """How far the scene has shifted since the key frame, pixels; None where too few corners tell it."""
    if len(corners) < FEWEST:
        return None
    guess = ((now.shift - key.shift) / factor).astype(np.float32)
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        key.image,
        now.image,
        corners,
        corners + guess,
        winSize=(WINDOW, WINDOW),
        maxLevel=HALVINGS,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    seen = status[:, 0] > 0
    if seen.sum() < FEWEST:
        return None
    found, ways = found[seen], (found - corners)[seen].astype(np.float64)
    agree = np.abs(ways - np.median(ways, axis=0)).max(1) < AGREE
    if agree.sum() < FEWEST or found[agree, 0].std() < SPREAD * now.image.shape[1]:
        return None
    return np.asarray(factor * np.median(ways[agree], axis=0))
