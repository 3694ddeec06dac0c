"""The outline of a marked figure fitted to every frame of a surveyed film."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from kinematics.figure import SCALE, Array
from kinematics.recover import Start
from kinematics.spm import joints
from tracker.outline.climb import GRID, Climbed, Marked, climb
from tracker.outline.cycles import NECK, TRUNK, Cycles, columns_of, poses
from tracker.outline.phase import Phases, phases
from tracker.outline.place import walk
from tracker.outline.shape import Shape
from tracker.outline.stage import Stage
from tracker.picture.pyramid import Planes

LEAST = 0.3  # log odds under the outline, nats times square leg lengths; a figure in full sight has 1 to 1.5
SMOOTH = 1.0  # frames over which the path's small shifts are smoothed
AROUND = 6  # frames either way of the marked one that tell which leg is near
SMOOTH_LEAN = 3.0  # the same of its lean


@dataclass(frozen=True)
class Outline:
    """A figure as its outline was seen.

    joints : (T, J, 2) pixels of each frame, as `figure.joints` names them
    score  : (T,) log odds under the outline, nats times leg lengths squared
    phases : which gait it was taken for
    margin : nats by which the legs' names agree better with the marked pose than exchanged
    """

    joints: Array
    score: Array
    phases: Phases
    margin: float

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(T,) whether the figure stands out from the scene; nowhere if it does not on the whole."""
        return (self.score > LEAST) & (np.median(self.score) > LEAST)


def outlined(stage: Stage, start: Start, frame: int, fps: float, cycles: Cycles) -> Outline:
    """Fit the outline of the figure marked in a frame.

    Args:
        stage: the film.
        start: pose marked in `frame`.
        fps: frames a second.
    """
    figure, view = start.figure, start.view
    shape = Shape.of(figure)
    hip = np.asarray(view.origin)
    hips, units = walk(stage, shape, cycles, hip, view.unit, frame)
    columns = columns_of(figure)
    marked = np.where(start.known[columns], start.q[columns], np.nan)
    found = phases(stage, shape, cycles, hips, units, marked, frame, fps)
    axes = units[:, None] * np.array([stage.facing, -1.0])
    scene = stage.in_scene(hips + axes * found.shift)
    hips = stage.in_frames(gaussian_filter1d(scene, SMOOTH, axis=0, mode="nearest"))

    angles = cycles.at(found.cycle, found.phase)
    angles[:, TRUNK] += gaussian_filter1d(found.lean, SMOOTH_LEAN, mode="nearest")
    angles[:, NECK] = start.q[columns[NECK]]
    known, q = start.known.copy(), start.q.copy()
    q[:2] = (hip - hips[frame]) / axes[frame]
    q[figure.index(SCALE)] = np.log(view.unit / units[frame])
    odds = stage.around(hips, units, GRID)
    best, margin = _named(odds, shape, poses(figure, angles), Marked(frame, q, known))
    pixels = hips[:, None] + joints(figure, best.q) * axes[:, None]
    return Outline(pixels, best.score, found, margin)


def _named(odds: Planes, shape: Shape, q: Array, marked: Marked) -> tuple[Climbed, float]:
    """The climb from a path (T, D), or from the same with the legs exchanged, and by how much it is better.

    Silhouettes do not tell the legs apart; what tells is that the poses around the marked one go on from it.
    """
    first = max(marked.frame - AROUND, 0)
    part = slice(first, marked.frame + AROUND + 1)
    here = replace(marked, frame=marked.frame - first)
    ways = [q, q[:, shape.figure.exchanged]]
    costs = [climb(odds[part], shape, way[part], here).cost for way in ways]
    better = int(np.argmin(costs))
    return climb(odds, shape, ways[better], marked), costs[1 - better] - costs[better]
