"""The camera's path over a film, as one similarity a frame: shift, rotation and scale.

Corners of a key frame (Shi and Tomasi 1994) are followed into the present frame by pyramidal Lucas-Kanade
(Bouguet 2001), both pictures small and less their local mean; the similarity is the one on which most of
them agree (RANSAC), so that people in the picture are outvoted. Errors do not accumulate from frame to frame,
as a key frame is kept until too few of its corners are left; then the frame before takes its place.

A camera counts as still, with the identity as its place, until a corner of the picture moves by STILL. A
scene with few corners, such as a bare wall, does not show the camera's motion; the place then stays the same.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import cv2
import numpy as np

from tracker.picture.pyramid import Array, Box, Image, Planes
from tracker.picture.small import reduced, small_size, to_film

SIDE = 320  # largest length of the small picture's longer side, pixels

# Lengths are pixels of the small picture.
CELL = 16  # side of a cell of the grid, which has one corner at most
CONTRAST = 3.0  # least gradient along a corner's weaker direction, root mean square, grey levels a pixel
WINDOW = 15  # side of the window that is compared around a corner
WAYS = (0, 2)  # halvings of the picture: for short motions, then for long ones
ENDS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.02)  # a corner is followed: steps, pixels
AGREE = 1.0  # largest distance of an agreeing corner from its place by the similarity
FEWEST = 30  # agreeing corners that a similarity needs
ENOUGH = 60  # corners that rotation and scale need too; fewer give a shift only
SPREAD = 0.125  # least standard deviation of them, shares of the picture's width; fewer may be one walker
SAME = 0.05  # distance between the places of a corner below which two similarities count as equal
BETTER = 1.02  # ratio by which motion must reduce the difference from the key frame, else the camera stays,
CLEARLY = 1.2  # or around most corners, if ENOUGH agree
OTHER = 24.0  # largest difference of a pixel that counts, grey levels
KEPT = 0.5  # share of a key frame's corners that must be left
LEFT = 2.0 / 3.0  # share of them, at most ENOUGH, that must agree, else another key frame is tried
LIGHTER = 4.0  # largest ratio of contrasts, either way, by which a change of light is made up for
STILL = 0.5  # largest motion of a still scene by video noise and moving leaves

IDENTITY = np.eye(3)


@dataclass(frozen=True)
class Key:
    """A frame with which others are compared.

    grey    : (h, w) small, less its local mean
    beside  : (h, w) 255 beside the figure, 0 where it may be
    corners : (P, 1, 2)
    place   : (3, 3) from its pixels to those of the first frame
    """

    grey: Image
    beside: Image
    corners: Planes
    place: Array


@dataclass(frozen=True)
class Camera:
    """The camera in a frame.

    image : (H, W, 3) the frame, RGB
    box   : (x0, y0, x1, y1) around a figure, which moves by itself, pixels; None if it is not known
    key   : the present key frame, None for this frame itself
    small : (3, 3) similarity from the pixels of its small picture to those of the first frame's
    sure  : whether enough corners agreed
    moves : whether the camera has moved so far
    """

    image: Image
    box: Box | None = None
    key: Key | None = None
    small: Array = field(default_factory=lambda: IDENTITY)
    sure: bool = True
    moves: bool = False

    @cached_property
    def place(self) -> Array:
        """(3, 3) similarity from the frame's pixels to those of the first frame."""
        up = _up(self.image)
        return up @ self.small @ np.linalg.inv(up) if self.moves else IDENTITY

    @cached_property
    def shift(self) -> Array:
        """(2,) pixels by which the scene, in the middle of the frame, has shifted right and down."""
        middle = np.array([0.5 * self.image.shape[1], 0.5 * self.image.shape[0], 1.0])
        return np.asarray((middle - self.place @ middle)[:2])

    def follow(self, image: Image, box: Box | None = None, place: Array | None = None) -> Self:
        """The camera in the next frame, which has this image, box and, if it is known, place."""
        if place is not None:
            up, moves = _up(image), self.moves or not np.array_equal(place, IDENTITY)
            return type(self)(image, box, None, np.linalg.inv(up) @ place @ up, True, moves)
        grey, key = _grey(image), self.key or self._as_key()
        small = _place(key, grey, self.small, min(ENOUGH, LEFT * len(key.corners)))
        if small is None and self.key is not None:
            key = self._as_key()
            small = _place(key, grey, self.small, FEWEST)
        if small is None:  # the old key frame may be recognised again once a cover is gone
            return replace(self, image=image, box=box, key=self.key or key, sure=False)
        moves = self.moves or _farthest(small, grey.shape) > STILL
        return type(self)(image, box, key, small if moves else IDENTITY, True, moves)

    def _as_key(self) -> Key:
        """The frame as a key frame, with the sharpest corner of every cell outside the figure."""
        grey = _grey(self.image)
        beside = np.full_like(grey, 255)
        if self.box is not None:
            x0, y0, x1, y1 = (max(int(side / _up(self.image)[0, 0]), 0) for side in self.box)
            beside[y0 : y1 + 1, x0 : x1 + 1] = 0
        corners = sharpest(sharpness(grey) * (beside > 0))
        return Key(grey, beside, corners[:, None], self.small)


def sharpness(grey: Image) -> Planes:
    """(h, w) squared gradient along the weaker direction, averaged around each pixel, grey levels a pixel."""
    # OpenCV's derivative is twice the gradient.
    return np.asarray(cv2.cornerMinEigenVal(grey.astype(np.float32), WINDOW // 2) / 4.0, dtype=np.float32)


def sharpest(sharp: Planes) -> Planes:
    """(P, 2) pixels of the sharpest corner in every cell that has one, by the sharpness (h, w)."""
    rows, columns = (n // CELL for n in sharp.shape)
    grid = sharp[: rows * CELL, : columns * CELL].reshape(rows, CELL, columns, CELL)
    cells = grid.swapaxes(1, 2).reshape(rows * columns, CELL**2)
    best = cells.argmax(1)
    row, column = np.divmod(np.arange(len(cells)), columns)
    corners = np.stack([column * CELL + best % CELL, row * CELL + best // CELL], axis=1)
    return np.asarray(corners[cells.max(1) > CONTRAST**2], dtype=np.float32)


def _size(image: Image) -> tuple[int, int]:
    """Width and height of the small picture."""
    H, W = image.shape[:2]
    return small_size(W, H, max(max(H, W) / SIDE, 1.0))


def _up(image: Image) -> Array:
    """(3, 3) map from the small picture's pixels to the frame's."""
    return to_film(_size(image), (image.shape[1], image.shape[0]))


def _grey(image: Image) -> Image:
    """The small picture, grey and less its local mean, or a change of light would look like a motion."""
    grey = cv2.cvtColor(reduced(image, _size(image)), cv2.COLOR_RGB2GRAY)
    around = cv2.boxFilter(grey, -1, (2 * WINDOW + 1, 2 * WINDOW + 1))
    return np.asarray(cv2.addWeighted(grey, 1.0, around, -1.0, 128.0), dtype=np.uint8)


def _place(key: Key, grey: Image, guess: Array, least: float) -> Array | None:
    """Map from a frame's pixels to the first frame's; None if too few corners, or fewer than `least`, agree,
    or if they contradict the picture."""
    if len(key.corners) < FEWEST:
        return None
    grey = _as_bright(grey, key.grey)
    way = np.linalg.inv(guess) @ key.place  # from the key frame to this one
    tried = (_back(key, grey, way, least, halvings) for halvings in WAYS)
    found = next((each for each in tried if each is not None), None)
    if found is None:
        return None
    back, many = found
    stays = np.asarray(np.linalg.inv(way), dtype=np.float64)
    differences = [_apart(key, grey, each) for each in (back, stays)]
    if _farthest(way @ back, grey.shape) < SAME:
        back = stays
    elif not _nearer(*differences):
        if not _nearer_at(key.corners, *differences):
            back = stays
        elif not many:  # the camera may go along with a figure, or a figure alone have corners
            return None
    return np.asarray(key.place @ back)


def _as_bright(grey: Image, key: Image) -> Image:
    """The picture with the contrast of another one, whose light may have been different."""
    spread, wanted = (float(cv2.meanStdDev(each)[1][0, 0]) for each in (grey, key))
    gain = min(max(wanted / max(spread, 1.0), 1.0 / LIGHTER), LIGHTER)
    return np.asarray(cv2.addWeighted(grey, gain, grey, 0.0, 128.0 * (1.0 - gain)), dtype=np.uint8)


def _back(key: Key, grey: Image, way: Array, least: float, halvings: int) -> tuple[Array, bool] | None:
    """(3, 3) map from a frame's pixels to the key frame's, and whether ENOUGH corners agree; or None.

    `way` is about the map the other way. Following the corners begins at so many halvings of the picture.
    """
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        key.grey,
        grey,
        key.corners,
        np.asarray(cv2.transform(key.corners, way[:2]), dtype=np.float32),
        winSize=(WINDOW, WINDOW),
        maxLevel=halvings,
        criteria=ENDS,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    seen = status[:, 0] > 0
    if seen.sum() < max(FEWEST, KEPT * len(key.corners)):
        return None
    similarity, inliers = cv2.estimateAffinePartial2D(
        found[seen], key.corners[seen], method=cv2.RANSAC, ransacReprojThreshold=AGREE
    )
    if similarity is None:
        return None
    back, agree = np.asarray(similarity, dtype=np.float64), np.ravel(inliers) > 0
    wide = found[seen][agree][..., 0].std() >= SPREAD * grey.shape[1]
    if agree.sum() < max(FEWEST, least, KEPT * seen.sum()) or not wide:
        return None
    many = bool(agree.sum() >= ENOUGH)
    if not many:
        back = np.hstack([np.eye(2), np.median((key.corners - found)[seen][agree], axis=0).T])
    return np.vstack([back, [0.0, 0.0, 1.0]]), many


def _nearer(one: tuple[Image, Image], other: tuple[Image, Image]) -> bool:
    """Whether one difference from the key frame is less than another in the mean."""
    (away, shown), (before, also) = one, other
    return BETTER * cv2.mean(away, mask=shown)[0] < cv2.mean(before, mask=also)[0]


def _nearer_at(corners: Planes, one: tuple[Image, Image], other: tuple[Image, Image]) -> bool:
    """Whether one difference from the key frame is clearly less than another around most of some corners."""
    (away, shown), (before, also) = one, other
    x, y = (corners[:, 0] / 2.0).astype(np.intp).T
    least, most = (
        cv2.boxFilter(each, cv2.CV_32F, (WINDOW // 2, WINDOW // 2))[y, x] for each in (away, before)
    )
    there = cv2.bitwise_and(shown, also)[y, x] > 0
    return bool(there.any() and np.median((most - CLEARLY * least)[there]) > 0.0)


def _apart(key: Key, grey: Image, back: Array) -> tuple[Image, Image]:
    """Difference of a frame from the key frame in every second row and column, grey levels, at most OTHER;
    and 255 where it shows what the key frame does beside the figure. `back` (3, 3) maps it to the key frame.
    """
    before = key.grey[::2, ::2]
    there, shown, size = grey[::2, ::2], key.beside[::2, ::2], before.shape[::-1]
    if not np.array_equal(back, IDENTITY):
        way = 0.5 * back[:2]
        there = np.asarray(cv2.warpAffine(grey, way, size), dtype=np.uint8)
        inside = cv2.warpAffine(np.full_like(grey, 255), way, size, flags=cv2.INTER_NEAREST)
        shown = np.asarray(cv2.bitwise_and(shown, inside), dtype=np.uint8)
    _, away = cv2.threshold(cv2.absdiff(there, before), OTHER, 0.0, cv2.THRESH_TRUNC)
    return np.asarray(cv2.bitwise_and(away, shown), dtype=np.uint8), shown


def _farthest(place: Array, shape: tuple[int, ...]) -> float:
    """Largest distance by which a similarity moves a corner of a picture, pixels."""
    h, w = shape[:2]
    corners = np.array([[0.0, 0.0, 1.0], [w, 0.0, 1.0], [0.0, h, 1.0], [w, h, 1.0]]).T
    return float(np.hypot(*(place @ corners - corners)[:2]).max())
