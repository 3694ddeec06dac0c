"""The 2-D scaled prismatic model: where a pose puts joints and surface points, and how they move with it.

Morris and Rehg (1998), section 2: a link turned by q_j moves every point p beyond its joint o_j along the
perpendicular of p - o_j; a link lengthened moves them along the link. Body coordinates are leg lengths,
x forward and y up; a `View` maps them to pixels, x right and y down.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinematics.figure import SCALE, STRETCH, Array, Figure

Index = NDArray[np.intp]


@dataclass(frozen=True)
class View:
    """How body coordinates appear in the picture: pixel = origin + unit (facing x, -y).

    origin : (2,) pixel where the root stands at root_x = root_y = 0
    unit   : pixels in a leg length
    facing : +1 if the figure faces right, -1 if left
    """

    origin: tuple[float, float]
    unit: float
    facing: int

    def __post_init__(self) -> None:
        if self.facing not in (-1, 1):
            raise ValueError(f"facing must be 1 (right) or -1 (left); got {self.facing}")
        if not 0.0 < self.unit < np.inf:
            raise ValueError(f"a leg length must be above 0 pixels; got {self.unit}")

    @property
    def axes(self) -> Array:
        """(2,) pixels per leg length along body x and y."""
        return np.array([self.facing * self.unit, -self.unit])

    def to_pixels(self, points: Array) -> Array:
        """(..., 2) body coordinates to pixels."""
        return np.asarray(self.origin) + points * self.axes

    def to_body(self, pixels: Array) -> Array:
        """(..., 2) pixels to body coordinates."""
        return np.asarray((pixels - np.asarray(self.origin)) / self.axes)


@dataclass(frozen=True)
class Skeleton:
    """The links as a pose lays them out, body coordinates.

    start     : (L, 2) where each link starts
    direction : (L, 2) unit vector along it
    length    : (L,) leg lengths
    size      : the common scale that also widens the links
    """

    start: Array
    direction: Array
    length: Array
    size: float

    @property
    def tip(self) -> Array:
        """(L, 2) where each link ends."""
        return self.start + self.length[:, None] * self.direction

    @property
    def normal(self) -> Array:
        """(L, 2) each link's direction turned a quarter anticlockwise."""
        return np.stack([-self.direction[:, 1], self.direction[:, 0]], axis=-1)


def skeleton(figure: Figure, q: Array) -> Skeleton:
    """Lay the links out for one pose q (D,)."""
    at = {name: i for i, name in enumerate(figure.freedoms)}
    size = float(np.exp(q[at[SCALE]]))
    L = len(figure.links)
    start, direction, length, angle = np.empty((L, 2)), np.empty((L, 2)), np.empty(L), np.empty(L)
    for i, (link, parent) in enumerate(zip(figure.links, figure.parents, strict=True)):
        turn = link.sense * q[at[link.freedom]] if link.freedom is not None else 0.0
        angle[i] = link.rest + turn + (angle[parent] if parent >= 0 else 0.0)
        stretch = q[at[STRETCH + link.name]] if link.breathes else 0.0
        length[i] = link.length * size * np.exp(stretch)
        direction[i] = np.cos(angle[i]), np.sin(angle[i])
        start[i] = start[parent] + link.at * length[parent] * direction[parent] if parent >= 0 else q[:2]
    return Skeleton(start, direction, length, size)


def joints(figure: Figure, q: Array) -> Array:
    """(1 + L, 2) body coordinates of the base and of each link's tip, in the order of `figure.joints`."""
    return np.concatenate([q[None, :2], skeleton(figure, q).tip])


def surface(bones: Skeleton, link: Index, along: Array, across: Array) -> Array:
    """Body coordinates of points fixed to links.

    Args:
        bones: the links as laid out.
        link: (P,) which link each point is fixed to.
        along: (P,) share of the link's length.
        across: (P,) leg lengths to the left of the link, before the common scale.

    Returns:
        (P, 2) leg lengths.
    """
    lengthwise = (along * bones.length[link])[:, None] * bones.direction[link]
    return bones.start[link] + lengthwise + (bones.size * across)[:, None] * bones.normal[link]


def jacobian(figure: Figure, bones: Skeleton, link: Index, along: Array, across: Array) -> Array:
    """Derivative of `surface` by the pose.

    Returns:
        (P, 2, D): d point / d q, leg lengths per leg length, per radian, per log unit.
    """
    points = surface(bones, link, along, across)
    J = np.zeros((len(link), 2, len(figure.freedoms)))
    J[:, 0, 0] = J[:, 1, 1] = 1.0
    angle_column = 2
    stretch_column = figure.freedoms.index(SCALE) + 1
    for j, part in enumerate(figure.links):
        moved = figure.chain[link, j]
        if part.freedom is not None:
            arm = np.where(moved[:, None], points - bones.start[j], 0.0) * part.sense
            J[:, 0, angle_column], J[:, 1, angle_column] = -arm[:, 1], arm[:, 0]
            angle_column += 1
        if part.breathes:
            share = np.where(link == j, along, figure.reach[link, j])
            J[:, :, stretch_column] = share[:, None] * (bones.length[j] * bones.direction[j])
            stretch_column += 1
    # The root stays, everything else moves away from it: for a chain from the base this is p - base.
    J[:, :, figure.freedoms.index(SCALE)] = points - bones.start[0]
    return J


def joint_jacobian(figure: Figure, q: Array) -> Array:
    """(1 + L, 2, D) derivative of `joints` by the pose."""
    L = len(figure.links)
    tips = jacobian(figure, skeleton(figure, q), np.arange(L), np.ones(L), np.zeros(L))
    base = np.zeros((1, 2, len(figure.freedoms)))
    base[0, 0, 0] = base[0, 1, 1] = 1.0
    return np.concatenate([base, tips])


def covering(
    figure: Figure, bones: Skeleton, points: Array, link: Index, margin: float = 0.0
) -> NDArray[np.bool_]:
    """(P,): whether a link nearer to the camera lies over each point.

    Args:
        points: (P, 2) body coordinates.
        link: (P,) the link each point is fixed to; links of its own layer never cover it.
        margin: how far beyond a link's outline it still covers, leg lengths.
    """
    layers = np.array([part.layer for part in figure.links])
    covered = np.zeros(len(points), dtype=bool)
    for j, part in enumerate(figure.links):
        below = layers[link] < part.layer
        offset = points[below] - bones.start[j]
        along = offset @ bones.direction[j]
        across = np.abs(offset @ bones.normal[j])
        share = np.clip(along / bones.length[j], 0.0, 1.0)
        half = 0.5 * bones.size * part.width * (1.0 + (part.taper - 1.0) * share) + margin
        inside = (along > -margin) & (along < bones.length[j] + margin) & (across < half)
        covered[below] |= inside
    return covered
