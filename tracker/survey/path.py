"""The camera's path over a film, as one similarity a frame: shift, turn and size.

Corners of a key frame (Shi and Tomasi 1994) are followed into the present frame by pyramidal Lucas-Kanade
(Bouguet 2001); the similarity is the one on which most of them agree (RANSAC), so who walks through the
picture is outvoted. Errors do not add up from frame to frame, as a key frame is kept until too few of its
corners are left; then the frame before the present one takes its place.

A camera is still, its path exactly the identity, until a corner of the picture is seen to move by STILL.
"""

from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np

from tracker.picture.corners import sharpest, sharpness
from tracker.picture.pyramid import Array, Image, Planes

# Lengths are pixels of the small picture.
CELL = 16  # of a grid, no more than one corner in each
CONTRAST = 3.0  # grey levels a pixel along a corner's weaker direction, root mean square
WINDOW = 15  # that is compared around a corner
WAYS = (0, 2)  # halvings of the picture: for short ways, then for long ones
ENDS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.02)  # a corner is followed: steps, pixels
AGREE = 1.0  # from where the similarity puts a corner
FEWEST = 30  # corners that a similarity is believed of
ENOUGH = 60  # of them tell turn and size as well, fewer a shift alone
SPREAD = 0.125  # standard deviation of them, shares of the picture's width: less may be one walker
SAME = 0.05  # between where two similarities put a corner of the picture: they are one
BETTER = 1.02  # times as far apart must a frame be from the key frame where the camera is taken to stay
OTHER = 24.0  # grey levels: of what differs by more nothing is the same
KEPT = 0.5  # share of a key frame's corners that must be left
LEFT = 2.0 / 3.0  # share of them, but no more than ENOUGH, that agree, or another key frame may tell more
STILL = 0.5  # what the noise of video and leaves shift a still scene by

IDENTITY = np.eye(3)


@dataclass(frozen=True)
class Key:
    """A frame that others are compared with.

    grey    : (h, w)
    corners : (P, 1, 2)
    place   : (3, 3) from its pixels to those of the first frame
    """

    grey: Image
    corners: Planes
    place: Array


@dataclass(frozen=True)
class Camera:
    """Where the camera looks in a frame.

    key   : what frames are compared with
    grey  : (h, w) the frame
    place : (3, 3) similarity from its pixels to those of the first frame
    sure  : whether enough corners told it
    moves : whether the camera has been seen to move
    """

    key: Key
    grey: Image
    place: Array
    sure: bool = True
    moves: bool = False

    def follow(self, image: Image) -> Self:
        """Find where the camera looks in the next frame (h, w, 3), RGB and small."""
        grey = _grey(image)
        least = min(ENOUGH, LEFT * len(self.key.corners))
        key, place = self.key, _place(self.key, grey, self.place, least)
        if place is None and self.sure:
            key = _key(self.grey, self.place)
            place = _place(key, grey, self.place, FEWEST)
        if place is None:
            return replace(self, key=key, grey=grey, sure=False)
        moves = self.moves or _farthest(place, grey.shape) > STILL
        return replace(self, key=key, grey=grey, place=place if moves else IDENTITY, sure=True, moves=moves)


def first_camera(image: Image) -> Camera:
    """The camera in the film's first frame (h, w, 3) RGB, small."""
    grey = _grey(image)
    return Camera(_key(grey, IDENTITY), grey, IDENTITY)


def _grey(image: Image) -> Image:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def _key(grey: Image, place: Array) -> Key:
    """A key frame with the sharpest corner of every cell that has one."""
    corners = sharpest(sharpness(grey, WINDOW // 2), CELL, CONTRAST)
    return Key(grey, corners[:, None], place)


def _place(key: Key, grey: Image, guess: Array, least: float) -> Array | None:
    """From a frame's pixels to those of the first; None where too few corners tell it, or `least` do not."""
    if len(key.corners) < FEWEST:
        return None
    way = np.linalg.inv(guess) @ key.place  # from the key frame to this one
    tried = (_back(key, grey, way, least, halvings) for halvings in WAYS)
    back = next((found for found in tried if found is not None), None)
    if back is None:
        return None
    stays = np.asarray(np.linalg.inv(way), dtype=np.float64)
    same = _farthest(way @ back, grey.shape) < SAME
    if same or _apart(key, grey, stays) <= BETTER * _apart(key, grey, back):
        back = stays
    return np.asarray(key.place @ back)


def _back(key: Key, grey: Image, way: Array, least: float, halvings: int) -> Array | None:
    """(3, 3) from a frame's pixels to the key frame's, as `_place`.

    Args:
        way: (3, 3) about from the key frame's to the frame's.
        halvings: of the picture, from which corners are followed.
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
    if agree.sum() < ENOUGH:
        back = np.hstack([np.eye(2), np.median((key.corners - found)[seen][agree], axis=0).T])
    return np.vstack([back, [0.0, 0.0, 1.0]])


def _apart(key: Key, grey: Image, back: Array) -> float:
    """Mean difference of a frame from the key frame, grey levels, each no more than OTHER.

    Args:
        back: (3, 3) from the frame's pixels to the key frame's.
    """
    there, shown, size = grey, None, grey.shape[::-1]
    if not np.array_equal(back, IDENTITY):
        there = np.asarray(cv2.warpAffine(grey, back[:2], size), dtype=np.uint8)
        shown = cv2.warpAffine(np.full_like(grey, 255), back[:2], size, flags=cv2.INTER_NEAREST)
    _, away = cv2.threshold(cv2.absdiff(there, key.grey), OTHER, 0.0, cv2.THRESH_TRUNC)
    return cv2.mean(away, mask=shown)[0]


def _farthest(place: Array, shape: tuple[int, ...]) -> float:
    """Pixels by which a similarity moves the corner of a picture that it moves most."""
    h, w = shape[:2]
    corners = np.array([[0.0, 0.0, 1.0], [w, 0.0, 1.0], [0.0, h, 1.0], [w, h, 1.0]]).T
    return float(np.hypot(*(place @ corners - corners)[:2]).max())
