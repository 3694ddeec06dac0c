"""What lies behind the figure in the marked frame, as the frames around show it without the figure.

A limb that was not marked has no look to be followed by; what tells of it is that it stands out from the
scene. For that the scene must be known where the figure stands: it is the median of the frames around, each
moved to where the camera saw it, since a figure that walks covers no place for long. Where they differ the
scene stays unknown.
"""

from collections.abc import Iterable

import cv2
import numpy as np

from tracker.picture.backdrop import NOISE, Backdrop, first_backdrop, small, step_of
from tracker.picture.camera import first_camera
from tracker.picture.pyramid import AS_FILMED, Array, Box, Image, Planes

REACH = 150  # frames either way: five seconds
EVERY = 4  # so manieth frame is kept
FEWEST = 5  # frames that must show a place


def plate(
    images: Iterable[Image], frame: int, box: Box, unit: float, curve: Image = AS_FILMED
) -> Backdrop | None:
    """The scene of one frame; None if there is no such frame.

    Args:
        images: RGB, in order.
        frame: of them.
        box: (x0, y0, x1, y1) pixels that the figure may cover in that frame.
        unit: pixels in a leg length.
        curve: (256,) what grey levels become.
    """
    step, camera = step_of(unit), None
    kept: list[tuple[Array, Planes]] = []
    here: tuple[Array, Image] | None = None
    for t, image in enumerate(images):
        camera = first_camera(image, box) if camera is None else camera.follow(image, box)
        if t == frame:
            here = camera.shift, image
        if t % EVERY == 0:
            kept.append((camera.shift, small(image, step, curve)))
    if here is None:
        return None
    shift, marked = here
    views = np.stack([_moved(view, (shift - there) / step) for there, view in kept])
    scene, spread, number = _middle(views)
    return first_backdrop(marked, box, unit, curve).replaced(scene, (number >= FEWEST) & (spread < NOISE))


def _moved(view: Planes, steps: Array) -> Planes:
    """A view (h, w, 3) moved right and down by steps (2,), NaN where it shows nothing."""
    x, y = np.rint(steps).tolist()
    if x == y == 0.0:
        return view
    way = np.array([[1.0, 0.0, x], [0.0, 1.0, y]])
    h, w = view.shape[:2]
    beyond = (np.nan, np.nan, np.nan)
    found = cv2.warpAffine(view, way, (w, h), flags=cv2.INTER_NEAREST, borderValue=beyond)
    return np.asarray(found, dtype=np.float32)


def _middle(views: Planes) -> tuple[Planes, Planes, Array]:
    """Of views (T, h, w, 3), NaN where they show nothing: the median (h, w, 3), its channels' largest median
    absolute deviation (h, w), and of how many views (h, w)."""
    number = np.isfinite(views[..., 0]).sum(0)
    median = _median(views, number)
    return median, _median(np.abs(views - median), number).max(-1), number


def _median(values: Planes, number: Array) -> Planes:
    """(h, w, 3): of the first `number` (h, w) in order of (T, h, w, 3), NaN last."""
    at = np.maximum(number - 1, 0)[None, ..., None] // 2
    return np.asarray(np.take_along_axis(np.sort(values, axis=0), at, axis=0)[0], dtype=np.float32)
