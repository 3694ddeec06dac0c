"""One shot of a film: its pictures up to a hard cut, from which on it shows another scene.

Thumbnails of different scenes are hardly correlated, and no motion of the camera leads from one to the other.
What hides the scene for a moment, such as a flash or somebody close to the camera, is gone within a second or
changes all the time; after a cut several pictures in a row are alike.
"""

import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import cv2
import numpy as np

from tracker.picture.camera import Camera
from tracker.picture.pyramid import Array, Image

THUMB = 32, 18  # width and height of a thumbnail
SAMPLED = 128, 72  # of the pixels of the picture that it is made of
ALIKE = 0.75  # least correlation of successive pictures of a scene; at least 0.87 in films of runners
FLAT = 4.0  # contrast of a thumbnail, grey levels, below which a picture shows no scene
ALIKE_ONES = 5  # successive pictures that show a scene
PATIENCE = 30  # pictures in which the scene may come back, a second of them
KEYS, STEP = 3, 10  # earlier pictures that are compared, as the last may be half covered; one of so many


class Shot:
    """The first pictures of a film up to its first hard cut, and some after it, from which it is told.

    beyond : how many of the last ones are of another scene, once all have been read; 0 if there is no cut
    """

    def __init__(self, images: Iterable[Image], most: float = math.inf, patience: int = PATIENCE) -> None:
        """`most` are wanted; of more, up to `patience` tell whether the last of these show another scene."""
        self.beyond = 0
        self._images, self._most, self._patience = images, most, patience

    def __iter__(self) -> Iterator[Image]:
        keys: deque[_Shown] = deque(maxlen=KEYS)  # of the scene
        scene = before = None  # its last picture, and the last one of all
        since = alike = 0  # pictures after the scene's last, and how many of the last ones are alike
        more = 0  # pictures read that are not wanted
        for t, image in enumerate(self._images):
            if t < self._most:
                yield image
            else:
                more += 1
            now = _Shown(image)
            if scene is None or any(now.continues(one) for one in (scene, *keys)):
                scene = now if scene is None or not now.flat else scene
                if t % STEP == 0:
                    keys.append(scene)
                since = alike = 0
            else:
                since += 1
                alike = alike + 1 if before is not None and now.alike(before) else 1
            before = now
            told = since == 0 and t + 1 >= self._most
            if told or (since >= self._patience and alike >= ALIKE_ONES):
                break
        self.beyond = max(since - more, 0) if alike >= ALIKE_ONES else 0


@dataclass(frozen=True)
class _Shown:
    """A picture, RGB, and what tells its scene."""

    image: Image

    @cached_property
    def thumbnail(self) -> Array:
        """(n,) grey levels less each channel's mean, which changes with the light."""
        some = cv2.resize(self.image, SAMPLED, interpolation=cv2.INTER_NEAREST)
        small = cv2.resize(some, THUMB, interpolation=cv2.INTER_AREA).astype(np.float64)
        return np.asarray(small - small.mean((0, 1))).ravel()

    @cached_property
    def contrast(self) -> float:
        """Root mean square of the thumbnail, grey levels."""
        return float(np.sqrt(np.square(self.thumbnail).mean()))

    @property
    def flat(self) -> bool:
        """Whether it shows no scene."""
        return self.contrast < FLAT

    def alike(self, other: Self) -> bool:
        """Whether the pictures are alike as a whole, as far as they show a scene."""
        if self.flat or other.flat:
            return True
        covariance = float(self.thumbnail @ other.thumbnail) / len(self.thumbnail)
        return covariance > ALIKE * self.contrast * other.contrast

    def continues(self, other: Self) -> bool:
        """Whether the pictures are alike, or a motion of the camera leads from the other one to this one."""
        return self.alike(other) or Camera(other.image).follow(self.image).sure
