"""The 2-D scaled prismatic model: where a pose puts joints and surface points, and how they move with it.

Morris and Rehg (1998), section 2: a link turned by q_j moves every point p beyond its joint o_j along the
perpendicular of p - o_j; a link lengthened moves them along the link. Body coordinates are leg lengths,
x forward and y up; a `View` maps them to pixels, x right and y down.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from kinematics.figure import Array, Figure, Flags, Ints


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

    @property
    def side(self) -> str:
        """Which side of the picture the figure faces: right or left."""
        return "right" if self.facing > 0 else "left"

    def moved(self, by: Array) -> Self:
        """The view of a picture that shows everything further right and down by the pixels by[0] and by[1],
        and by[2] times as large about the origin."""
        x, y = (np.asarray(self.origin) + by[:2]).tolist()
        return replace(self, origin=(x, y), unit=float(by[2]) * self.unit)

    def to_pixels(self, points: Array) -> Array:
        """(..., 2) body coordinates to pixels."""
        return np.asarray(self.origin) + points * self.axes

    def to_body(self, pixels: Array) -> Array:
        """(..., 2) pixels to body coordinates."""
        return np.asarray((pixels - np.asarray(self.origin)) / self.axes)


UNMOVED = np.array([0.0, 0.0, 1.0])  # see `View.moved`


class Skeleton(NamedTuple):
    """The links as placed by poses, body coordinates; any leading axes.

    start     : (..., L, 2) where each link starts
    direction : (..., L, 2) unit vector along it
    length    : (..., L) leg lengths
    size      : (...) the common scale that also widens the links
    """

    start: Array
    direction: Array
    length: Array
    size: Array

    @property
    def tip(self) -> Array:
        """(..., L, 2) where each link ends."""
        return self.start + self.length[..., None] * self.direction

    @property
    def normal(self) -> Array:
        """(..., L, 2) each link's direction turned a quarter anticlockwise."""
        return np.stack([-self.direction[..., 1], self.direction[..., 0]], axis=-1)


def skeleton(figure: Figure, q: Array) -> Skeleton:
    """Place the links by poses q (..., D)."""
    layout = figure.layout
    size = np.exp(q[..., layout.scale])
    angle = (layout.rest + q[..., layout.angle] * layout.sense) @ figure.chain.T
    length = layout.length * size[..., None] * np.exp(q[..., layout.stretch] * layout.breathes)
    direction = np.empty((*angle.shape, 2))
    direction[..., 0], direction[..., 1] = np.cos(angle), np.sin(angle)
    start = q[..., None, :2] + figure.reach @ (length[..., None] * direction)
    return Skeleton(start, direction, length, size)


def joints(figure: Figure, q: Array) -> Array:
    """(..., 1 + L, 2) body coordinates of the base and of each link's tip, as `figure.joints` names them."""
    return np.concatenate([q[..., None, :2], skeleton(figure, q).tip], axis=-2)


def surface(bones: Skeleton, link: Ints, along: Array, across: Array) -> Array:
    """(..., P, 2) body coordinates of points fixed to links (P,), for the links as poses place them.

    They lie at `along` (P,), shares of the link's length, and `across` (P,), leg lengths to its left before
    the common scale.
    """
    u, v = along * bones.length.take(link, axis=-1), bones.size[..., None] * across
    # One coordinate at a time: numpy is slow on arrays with two numbers a point.
    x, y = (bones.start[..., k].take(link, axis=-1) for k in range(2))
    dx, dy = (bones.direction[..., k].take(link, axis=-1) for k in range(2))
    places = np.empty((*u.shape, 2))
    places[..., 0] = x + u * dx - v * dy
    places[..., 1] = y + u * dy + v * dx
    return places


def motions(figure: Figure, bones: Skeleton) -> Array:
    """(..., L, 5, D): M_l, the motion of each link as a whole by the pose, per leg length, radian, log unit.

    A point u along link l and v across it, leg lengths, moves with the pose by [d, n, u d, u n - v d, u d + v
    n] M_l, where d is the link's direction and n its normal: the link slides along itself and across,
    lengthens, turns and grows.
    """
    layout, L, D = figure.layout, len(figure.links), len(figure.freedoms)
    turns, breathes = layout.turns, layout.breathes
    # A vector as a complex number w, along and across the link: w conj(d).
    d = bones.direction[..., 0] + 1j * bones.direction[..., 1]
    start = bones.start[..., 0] + 1j * bones.start[..., 1]
    turned_back = d.conj()
    arm = (start[..., :, None] - start[..., None, :]) * turned_back[..., None]  # (..., l, j) from joint j
    moved = figure.chain * layout.sense
    stretched = figure.reach * (bones.length * d)[..., None, :] * turned_back[..., None]
    slide = np.zeros((*d.shape, D), complex)
    slide[..., 0], slide[..., 1] = turned_back, 1j * turned_back
    slide[..., layout.angle[turns]] = (1j * moved * arm)[..., turns]
    slide[..., layout.stretch[breathes]] = stretched[..., breathes]
    # The root stays, everything else moves away from it: for a chain from the base this is p - base.
    slide[..., layout.scale] = arm[..., 0]

    M = np.zeros((*d.shape, 5, D))
    M[..., 0, :], M[..., 1, :] = slide.real, slide.imag
    M[..., np.arange(L)[breathes], 2, layout.stretch[breathes]] = 1.0
    M[..., 3, layout.angle[turns]] = moved[:, turns]
    M[..., 4, layout.scale] = 1.0
    return M


def joint_jacobian(figure: Figure, q: Array) -> Array:
    """(..., 1 + L, 2, D) derivative of `joints` by the pose."""
    bones = skeleton(figure, q)
    d, n, u = bones.direction, bones.normal, bones.length[..., None]
    tips = np.stack([d, n, u * d, u * n, u * d], axis=-1) @ motions(figure, bones)
    base = np.zeros_like(tips[..., :1, :, :])
    base[..., 0, 0, 0] = base[..., 0, 1, 1] = 1.0
    return np.concatenate([base, tips], axis=-3)


def angle_gradients(figure: Figure, q: Array) -> Array:
    """(..., L, 1 + L, 2) derivative of each link's angle by the places of joints, radians per leg length.

    The angles are those between lines through the joints at both ends of links, as marks give them; 0 for a
    link that does not turn.
    """
    bones, joint = skeleton(figure, q), np.eye(1 + len(figure.links))
    starts = np.zeros((len(figure.links), len(joint)))
    for i, parent in enumerate(figure.parents):
        at = figure.links[i].at
        starts[i] = joint[0] if parent < 0 else (1.0 - at) * starts[parent] + at * joint[1 + parent]
    across = bones.normal / bones.length[..., None]
    turned = (joint[1:] - starts)[:, :, None] * across[..., None, :]
    parents = np.array(figure.parents)
    turned[..., parents >= 0, :, :] -= turned[..., parents[parents >= 0], :, :]
    return np.asarray(turned * figure.layout.sense[:, None, None])


def covering(figure: Figure, bones: Skeleton, points: Array, link: Ints, margin: float = 0.0) -> Flags:
    """(P,) whether a link nearer to the camera lies over each of the points (P, 2), body coordinates, of
    these links (P,).

    Links of a point's own layer never cover it; others cover up to `margin` leg lengths beyond their outline.
    """
    layout = figure.layout
    away = points[:, None] - bones.start  # (P, L, 2)
    (x, y), (ahead, up) = np.moveaxis(away, -1, 0), bones.direction.T
    along, across = x * ahead + y * up, np.abs(y * ahead - x * up)
    share = np.clip(along / bones.length, 0.0, 1.0)
    half = 0.5 * bones.size * layout.width * (1.0 + (layout.taper - 1.0) * share) + margin
    inside = (along > -margin) & (along < bones.length + margin) & (across < half)
    return np.asarray((inside & (layout.layer[link][:, None] < layout.layer)).any(1))
