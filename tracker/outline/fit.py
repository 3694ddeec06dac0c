"""The outline of a marked figure fitted to every frame of a surveyed film."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from kinematics.figure import SCALE, Array
from kinematics.recover import Start
from kinematics.spm import joints
from tracker.outline.climb import GRID, Marked, climb
from tracker.outline.cycles import NECK, Cycles, columns_of, poses
from tracker.outline.phase import Phases, phases
from tracker.outline.place import walk
from tracker.outline.shape import Shape
from tracker.outline.stage import Stage

LEAST = 0.3  # log odds under the outline, nats times square leg lengths; a figure in full sight has 1 to 1.5
SMOOTH = 1.0  # frames over which the path's small shifts are smoothed


@dataclass(frozen=True)
class Outline:
    """A figure as its outline was seen.

    joints : (T, J, 2) pixels of each frame, as `figure.joints` names them
    score  : (T,) log odds under the outline, nats times leg lengths squared
    phases : which gait it was taken for
    """

    joints: Array
    score: Array
    phases: Phases

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
    angles[:, NECK] = start.q[columns[NECK]]
    known, q = start.known.copy(), start.q.copy()
    q[:2] = (hip - hips[frame]) / axes[frame]
    q[figure.index(SCALE)] = np.log(view.unit / units[frame])
    odds = stage.around(hips, units, GRID)
    best, score = climb(odds, shape, poses(figure, angles), Marked(frame, q, known))
    pixels = hips[:, None] + joints(figure, best) * axes[:, None]
    return Outline(pixels, score, found)
