"""The outline of a figure: a tapered, rounded bar for each link, and a zone around the trunk for the arms.

The bars are about as wide as the foreground around the marked links of the open clips. Lengths scale with the
figure's common scale, those along a link with the link's own length. Arms cover ARM_SHARE of the places in
their zone, so that R counts as log (1 - share + share e^R) there: neither foreground nor background costs
much.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kinematics.figure import Array, Figure
from kinematics.spm import Skeleton, motions, skeleton, surface
from tracker.outline.rasters import BAR, painted, silhouettes
from tracker.picture.pyramid import Planes

SOFT = 0.04  # half width of an outline's edge, leg lengths
ARM_SHARE = 0.35
TRUNK = "torso"


class Bar(NamedTuple):
    """The outline of one link.

    first, last : ends of its axis, shares of the link's length
    start, tip  : its half widths there, leg lengths
    beside      : distance from the link's axis, leg lengths, to the left when looking along the link
    """

    first: float
    last: float
    start: float
    tip: float
    beside: float = 0.0


BARS = {
    "torso": Bar(0.0, 0.88, 0.155, 0.145),
    "head": Bar(0.0, 0.62, 0.1, 0.135, -0.025),
    "thigh": Bar(0.0, 1.0, 0.165, 0.1, 0.02),
    "shank": Bar(0.0, 1.0, 0.1, 0.07, -0.01),
    "foot": Bar(0.0, 0.86, 0.06, 0.045, -0.035),
}
ARMS = Bar(-0.35, 0.85, 0.42, 0.25)  # on the trunk


@dataclass(frozen=True)
class Grid:
    """A grid of places around a hip in body coordinates, x forward and y up.

    corner  : (2,) the first place, leg lengths
    density : places in a leg length
    shape   : rows and columns
    """

    corner: tuple[float, float]
    density: float
    shape: tuple[int, int]


@dataclass(frozen=True)
class Shape:
    """A figure with its outline.

    bars : (L + 1, 5) each link's `Bar` and, last, the arms' zone
    trunk: position of the link from which the arms hang
    """

    figure: Figure
    bars: Array
    trunk: int

    @classmethod
    def of(cls, figure: Figure) -> "Shape":
        """The outline of a figure with people's widths; ValueError if it has no trunk for arms."""
        names = [link.name for link in figure.links]
        if TRUNK not in names:
            raise ValueError(f"figure {figure.name!r} has no link {TRUNK!r} for the arms to hang on")
        found = []
        for link in figure.links:
            half = 0.5 * link.width
            kind = link.name.removesuffix("_near").removesuffix("_far")
            found.append(BARS.get(kind, Bar(0.0, 1.0, half, half * link.taper)))
        return cls(figure, np.array([*found, ARMS]), names.index(TRUNK))

    def places(self, bones: Skeleton, links: list[int], along: Array, across: Array) -> Array:
        """(T, P, 2) places on links, body coordinates; P counts links, `along` and `across` in this order.

        These are shares of a link's length, and of its half width there to the left as seen along the link.
        """
        link, u, share = (each.ravel() for each in np.meshgrid(links, along, across, indexing="ij"))
        first, last, start, tip, beside = self.bars[link].T
        half = start + (tip - start) * (u - first) / (last - first)
        return surface(bones, link, u, beside + share * half)

    def painted(self, q: Array, grid: Grid) -> tuple[Planes, Planes]:
        """(N, *grid.shape) silhouettes of poses (N, D), and of the arms' zone."""
        bars, corner = self._laid(skeleton(self.figure, q)), np.asarray(grid.corner)
        body = painted(grid.shape, corner, 1.0 / grid.density, np.ascontiguousarray(bars[:, :-1]))
        arms = painted(grid.shape, corner, 1.0 / grid.density, np.ascontiguousarray(bars[:, -1:]))
        return body, (1.0 - body) * arms

    def under(self, q: Array, odds: Planes, arms: Planes, grid: Grid) -> tuple[Array, Array]:
        """(T,) log odds (T, *grid.shape) under the outlines of poses (T, D), times square leg lengths.

        The second result is their (T, D) derivative by the pose; `arms` are `arms_worth` of the odds.
        """
        bones = skeleton(self.figure, q)
        bars = self._laid(bones)
        moved = np.empty((*bars.shape[:2], 5))
        score = silhouettes(odds, arms, np.asarray(grid.corner), 1.0 / grid.density, bars, moved)
        # If its link turns or grows, a bar beside the link's axis slides as well.
        aside = self.bars[:, 4] * bones.size[:, None]
        moved[..., 3] -= aside * moved[..., 0]
        moved[..., 4] += aside * moved[..., 1]
        moved[:, self.trunk] += moved[:, -1]
        return score, np.einsum("tlk,tlkd->td", moved[:, :-1], motions(self.figure, bones))

    def _laid(self, bones: Skeleton) -> Array:
        """(N, L + 1, BAR) bars placed by poses, see `tracker.outline.rasters`."""
        link = np.append(np.arange(len(self.figure.links)), self.trunk)
        first, last, start, tip, beside = self.bars.T
        length, size = bones.length[:, link], bones.size[:, None]
        bars = np.empty((*length.shape, BAR))
        aside = (beside * size)[..., None] * bones.normal[:, link]
        bars[..., 0:2], bars[..., 2:4] = bones.start[:, link] + aside, bones.direction[:, link]
        bars[..., 4], bars[..., 5] = first * length, last * length
        bars[..., 6], bars[..., 7] = start * size, (tip - start) * size / ((last - first) * length)
        bars[..., 8] = SOFT * size
        return bars


def arms_worth(odds: Planes) -> Planes:
    """The log odds of places where arms may be, of which arms cover a share ARM_SHARE."""
    worth = np.expm1(odds)  # of a whole film, so no copies of it are made
    worth *= ARM_SHARE
    return np.log1p(worth, out=worth)
