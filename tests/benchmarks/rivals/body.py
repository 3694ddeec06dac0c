"""What the rivals are given: the start frame's marked joints and the outlines of the links between them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kinematics.recover import Start
from kinematics.spm import joints
from tracker.tables.keypoints import Mark

Array = NDArray[np.float64]
Mask = NDArray[np.uint8]
Image = NDArray[np.uint8]


@dataclass(frozen=True)
class Body:
    """A figure in the start frame, pixels.

    names  : of the J joints
    joints : (J, 2) where they are marked; where they are not, as the pose has them
    ends   : (L, 2) the joints at which each link starts and ends
    widths : (L, 2) there
    layers : (L,) larger is nearer to the camera
    leg    : thigh and shank
    """

    names: tuple[str, ...]
    joints: Array
    ends: NDArray[np.intp]
    widths: Array
    layers: NDArray[np.intp]
    leg: float

    def outlines(self, places: Array) -> Array:
        """(L, 4, 2) corners of every link where the joints (J, 2) are there."""
        start, tip = places[self.ends[:, 0]], places[self.ends[:, 1]]
        along = tip - start
        across = np.stack([-along[:, 1], along[:, 0]], 1)
        across /= np.maximum(np.hypot(*along.T), 1e-9)[:, None]
        first, last = (0.5 * width[:, None] * across for width in self.widths.T)
        return np.stack([start - first, start + first, tip + last, tip - last], 1)

    def masks(self, places: Array, shape: tuple[int, int]) -> list[Mask]:
        """(H, W) of every link: 255 inside its outline where no link nearer to the camera lies over it."""
        filled = [_filled(outline, shape) for outline in self.outlines(places)]
        return [
            cv2.bitwise_and(mask, cv2.bitwise_not(self._above(layer, filled, shape)))
            for mask, layer in zip(filled, self.layers, strict=True)
        ]

    def at_joints(self, carried: Array) -> Array:
        """(J, 2): the mean of what the links (L, 2, 2) make of the joints at their ends."""
        sums, counts = np.zeros_like(self.joints), np.zeros(len(self.joints))
        np.add.at(sums, self.ends, carried)
        np.add.at(counts, self.ends, 1.0)
        return sums / counts[:, None]

    def _above(self, layer: int, filled: list[Mask], shape: tuple[int, int]) -> Mask:
        above = np.zeros(shape, np.uint8)
        for mask, other in zip(filled, self.layers, strict=True):
            if other > layer:
                above |= mask
        return above


def body_at(start: Start, marks: Mapping[str, Mark]) -> Body:
    """The body that a marked frame shows."""
    figure, unit = start.figure, start.view.unit
    places = start.view.to_pixels(joints(figure, start.q))
    for j, name in enumerate(figure.joints):
        if name in marks:
            places[j] = marks[name].x, marks[name].y
    layout = figure.layout
    return Body(
        names=figure.joints,
        joints=places,
        ends=np.array([(parent + 1, i + 1) for i, parent in enumerate(figure.parents)]),
        widths=unit * np.stack([layout.width, layout.width * layout.taper], 1),
        layers=layout.layer,
        leg=unit,
    )


def by_frame(body: Body, rows: Iterable[Array]) -> dict[int, dict[str, tuple[float, float]]]:
    """Joints (J, 2) of the start frame and those after it, as `tracker.run.score.score` takes them."""
    return {
        frame: {name: (float(x), float(y)) for name, (x, y) in zip(body.names, row, strict=True)}
        for frame, row in enumerate(rows)
    }


def _filled(outline: Array, shape: tuple[int, int]) -> Mask:
    mask = np.zeros(shape, np.uint8)
    return cv2.fillConvexPoly(mask, np.round(outline).astype(np.int32), 255)
