"""A film surveyed: camera and scene in a first pass, the log odds of every frame in a second one.

Small pictures are kept from the first pass for the second; those of a long film are read again.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from tracker.picture.camera import Camera
from tracker.picture.light import relit_lab
from tracker.picture.pyramid import Array, Flags, Image
from tracker.picture.small import reduced, small_size, to_film
from tracker.survey.evidence import NOTHING, ORDINARY, Expected, evidence
from tracker.survey.mosaic import Scene, scene_of

VIEWS = 60  # largest number of pictures in the median of the scene
MOSTLY = 0.6  # share of foreground from which a frame hardly shows the scene
HELD = 64 * 2**20  # largest size of small pictures kept in memory, bytes


@dataclass(frozen=True)
class Survey:
    """The survey of a film.

    size   : width and height of the small pictures
    up     : (3, 3) map from their pixels to the film's
    places : (T, 3, 3) map from each frame's pixels of the film to the first frame's
    scene  : in pixels of the small pictures
    sure   : (T,) whether enough corners agreed on the camera's place
    held   : (T, h, w, 3) the small pictures in Lab; none if they exceed HELD bytes
    """

    size: tuple[int, int]
    up: Array
    places: Array
    scene: Scene
    sure: Flags
    held: Image

    def seen(
        self, images: Iterable[Image], expected: Expected = ORDINARY
    ) -> Iterator[tuple[Image, Image, float]]:
        """Log odds and lightness (h, w) of each of the surveyed frames, both in the scene's light, and the
        share of it that the frame had, see `tracker.survey.evidence` and `tracker.picture.light`. Of a frame
        that hardly shows the scene, such as a flash or a fade, nothing is told. The images, as surveyed, are
        read only if no small pictures are held.
        """
        down = np.linalg.inv(self.up)
        labs = self.held if len(self.held) else (_lab(image, self.size) for image in images)
        for lab, place in zip(labs, self.places, strict=False):
            way = down @ place @ self.up
            share = 1.0 if self.scene.steady else self.scene.light(lab, way)[0]
            even = relit_lab(lab, share)
            odds = evidence(even, way, self.scene, expected)
            if np.count_nonzero(odds > NOTHING) > MOSTLY * np.count_nonzero(odds != NOTHING):
                odds.fill(NOTHING)
            yield odds, even[..., 0].copy(), share


def survey(
    images: Iterable[Image], by: float, frames: int = 0, beyond: Callable[[], int] = lambda: 0
) -> Survey:
    """Survey a film.

    Args:
        images: RGB, in order, at least one.
        by: number of the film's pixels along the side of a pixel of the small pictures.
        frames: approximate number of images, 0 if unknown.
        beyond: number of the last images that are of another scene, which is known when all are read.
    """
    places, sure = [], []
    camera: Camera | None = None
    every = 1
    for t, image in enumerate(images):
        if camera is None:
            film = image.shape[1], image.shape[0]
            size = small_size(*film, by)
            up = to_film(size, film)
            views, held = _room(size, frames)
        camera = Camera(image) if camera is None else camera.follow(image)
        places.append(camera.place)
        sure.append(camera.sure)
        if t < len(held) or t % every == 0:
            lab = _lab(image, size)
        if t < len(held):
            held[t] = lab
        if t % every == 0:
            views[t // every] = lab
            if t // every == VIEWS:
                views[: VIEWS // 2 + 1] = views[::2]
                every *= 2
    T, whole = len(places) - beyond(), len(places) <= len(held)
    places = places[:T]
    shown = [np.linalg.inv(up) @ place @ up for place in places[::every]]
    scene = scene_of(list(views[: len(shown)]), shown)
    return Survey(size, up, np.stack(places), scene, np.array(sure[:T]), held[: T if whole else 0])


def _room(size: tuple[int, int], frames: int) -> tuple[Image, Image]:
    """Room for views of the scene, and for the pictures of a film of so many frames if it holds them.

    Pictures kept as separate arrays would fragment the memory.
    """
    shape = size[1], size[0], 3
    most = HELD // int(np.prod(shape))
    return (
        np.empty((VIEWS + 1, *shape), np.uint8),
        np.empty((most if frames <= most else 0, *shape), np.uint8),
    )


def _lab(image: Image, size: tuple[int, int]) -> Image:
    return np.asarray(cv2.cvtColor(reduced(image, size), cv2.COLOR_RGB2Lab), dtype=np.uint8)
