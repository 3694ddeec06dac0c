"""Silhouettes of the gait cycles' poses, to compare log odds with."""

from dataclasses import dataclass

import numpy as np

from kinematics.figure import Array, Figure
from kinematics.spm import Skeleton, skeleton
from tracker.outline.cycles import COLUMNS, Cycles
from tracker.outline.kernel import painted
from tracker.outline.shape import ARMS, bars
from tracker.outline.stage import Grid
from tracker.picture.pyramid import Planes

TRUNK = "torso"


@dataclass(frozen=True)
class Dress:
    """The outline of a figure: its links' bars, and the zone of the arms on the trunk.

    figure : whose
    bars   : (L, 4) as `tracker.outline.shape.bars`
    zone   : (4,) of the arms
    trunk  : position of the link that they hang on
    """

    figure: Figure
    bars: Array
    zone: Array
    trunk: int

    def painted(self, q: Array, grid: Grid) -> tuple[Planes, Planes]:
        """(N, *grid.shape) silhouettes of poses (N, D), and the arms' zone beside them."""
        bones = skeleton(self.figure, q)
        body = _painted(bones, self.bars, grid)
        one = slice(self.trunk, self.trunk + 1)
        trunk = Skeleton(bones.start[:, one], bones.direction[:, one], bones.length[:, one], bones.size)
        return body, (1.0 - body) * _painted(trunk, self.zone[None], grid)


def dressed(figure: Figure) -> Dress:
    """A figure with its outline; ValueError if it has no trunk."""
    zone = np.array([ARMS.first, ARMS.last, ARMS.start, ARMS.tip])
    names = [link.name for link in figure.links]
    if TRUNK not in names:
        raise ValueError(f"figure {figure.name!r} has no link {TRUNK!r} for the arms to hang on")
    return Dress(figure, bars(figure), zone, names.index(TRUNK))


def columns_of(figure: Figure) -> list[int]:
    """Where a pose holds the angles of `tracker.outline.cycles.COLUMNS`."""
    return [figure.index(name) for name in COLUMNS]


def poses(figure: Figure, angles: Array) -> Array:
    """(..., D) poses with the root at the origin and nothing stretched, of angles (..., 8)."""
    q = np.zeros((*angles.shape[:-1], len(figure.freedoms)))
    q[..., columns_of(figure)] = angles
    return q


def cycle_angles(cycles: Cycles, neck: float, every: int = 1) -> Array:
    """(C, n, 8) angles of the first half of every cycle, the head held as in the marked pose."""
    half = cycles.pose.shape[1] // 2
    angles = cycles.pose[:, :half:every].copy()
    angles[..., COLUMNS.index("neck")] = neck
    return angles


def _painted(bones: Skeleton, bars_: Array, grid: Grid) -> Planes:
    corner = np.asarray(grid.corner, dtype=np.float64)
    return np.asarray(
        painted(
            grid.shape,
            corner,
            1.0 / grid.density,
            np.ascontiguousarray(bones.start),
            np.ascontiguousarray(bones.direction),
            np.ascontiguousarray(bones.length),
            bones.size,
            bars_,
        )
    )
