"""The outline of a marked figure fitted to every frame of a surveyed film."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from kinematics.figure import SCALE, Array, Figure
from kinematics.recover import Start
from kinematics.spm import joints, skeleton, surface
from tracker.outline.climb import GRID, ROUNDS, Marked, climb
from tracker.outline.cycles import NECK, TRUNK, Cycles, at_phases, columns_of, poses
from tracker.outline.doubt import spread
from tracker.outline.near import NEARER, nearness
from tracker.outline.phase import Phases, likeness, phases
from tracker.outline.place import walk
from tracker.outline.shape import Shape
from tracker.outline.smooth import smooth
from tracker.outline.stage import Stage
from tracker.picture.pyramid import Planes
from tracker.survey.evidence import NOTHING

LEAST = 0.3  # log odds under the outline, nats times square leg lengths; a figure in full sight has 1 to 1.5
SMOOTH = 1.0  # frames over which the path's small shifts are smoothed
LASTING = 0.2  # seconds over which a pose stays unlike its phase of the cycle as it was marked
AROUND = 6  # frames either way of the marked one that tell which leg is near
ALONG = np.linspace(0.1, 0.9, 9)  # places on the axis of a link, shares of its length
MOSTLY = 0.65  # of them stand out where a link does
RIGHTLY = 2.2  # log odds, before the film is looked at, that who marks the legs names them rightly
MARGIN = 10.0  # nats of two climbs that count as one: neighbouring pixels err together
SMOOTH_LEAN = 3.0  # the same of its lean


@dataclass(frozen=True)
class Outline:
    """A figure as its outline was seen.

    q      : (T, D) poses, their root beside `hips`
    hips   : (T, 2) pixels of each frame
    units  : (T,) pixels in a leg length
    joints : (T, J, 2) pixels of each frame, as `figure.joints` names them
    score  : (T,) log odds under the outline, nats times leg lengths squared
    shown  : (T, J) whether the link that ends at a joint stands out from the scene
    spread : (T,) leg lengths by which its joints may be off
    gait   : "walk" or "run"
    way    : +1, -1 with time running back in its stride
    named  : log odds that the legs are named rightly
    misnamed : probability that the start, from which it goes on, names them wrongly
    """

    q: Array
    hips: Array
    units: Array
    joints: Array
    score: Array
    shown: NDArray[np.bool_]
    spread: Array
    gait: str
    way: int
    named: float
    misnamed: float

    @property
    def wrong(self) -> float:
        """Probability that the legs are named wrongly."""
        return _improbable(self.named)

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(T,) whether the figure stands out from the scene; nowhere if it does not on the whole."""
        return _seen(self.score)

    def around(self, inner: slice) -> slice:
        """The frames of `inner` and those before and after it up to the first in which it is not seen."""
        unseen = np.flatnonzero(self.score < LEAST)
        before, after = unseen[unseen < inner.start], unseen[unseen >= inner.stop]
        return slice(int(before.max(initial=-1)) + 1, int(after.min(initial=len(self.score))))

    def part(self, frames: slice) -> Self:
        """The outline in some of the frames."""
        rows = ("q", "hips", "units", "joints", "score", "shown", "spread")
        some = {name: getattr(self, name)[frames] for name in rows}
        return replace(self, **some)


def fitted(stage: Stage, start: Start, frame: int, cycles: Cycles, rounds: int = ROUNDS) -> Outline:
    """Fit the outline of a figure to every frame.

    Args:
        stage: the film; the figure faces as it says.
        start: pose in `frame`; where nothing of it is known it tells the place and about the size.
        rounds: of climbing at most.
    """
    figure, shape, columns = start.figure, Shape.of(start.figure), columns_of(start.figure)
    hips, units, phase = _gait(stage, start, frame, cycles)
    axes = units[:, None] * np.array([stage.facing, -1.0])
    angles = at_phases(cycles.pose[phase.cycle], phase.phase)
    angles[:, TRUNK] += smooth(phase.lean, SMOOTH_LEAN)
    angles[:, NECK] = start.q[columns[NECK]]
    q = start.q.copy()
    q[:2] = (np.asarray(start.view.origin) - hips[frame]) / axes[frame]
    q[figure.index(SCALE)] = np.log(start.view.unit / units[frame])
    odds = stage.around(hips, units, GRID)
    path, marks = poses(figure, angles), Marked(frame, q, start.known)
    ways = [through(figure, way, marks, stage.fps) for way in (path, path[:, figure.exchanged])]
    better, margin = _as_marked(odds, shape, ways, marks) if start.known.any() else (0, 0.0)
    best = climb(odds, shape, ways[better][0], marks, rounds)
    looks = NEARER * nearness(shape, best.q, stage, hips, units, _seen(best.score))
    named = looks + agreeing(margin, RIGHTLY)
    if named < 0.0 and margin < RIGHTLY:
        best = climb(odds, shape, ways[1 - better][0], marks, rounds)
    elif named < 0.0:  # the marks themselves name the other leg
        best = replace(best, q=best.q[:, figure.exchanged])
    pixels = hips[:, None] + joints(figure, best.q) * axes[:, None]
    shown = _shown(shape, best.q, stage, hips, units)
    off = spread(shape, best.q, odds, GRID)
    gait, misnamed = cycles.gait(phase.cycle), _improbable(RIGHTLY + looks)
    return Outline(best.q, hips, units, pixels, best.score, shown, off, gait, phase.way, abs(named), misnamed)


def _gait(stage: Stage, start: Start, frame: int, cycles: Cycles) -> tuple[Array, Array, Phases]:
    """Hip (T, 2), pixels in a leg length (T,) and phase in every frame."""
    shape, columns = Shape.of(start.figure), columns_of(start.figure)
    hips, units = walk(stage, shape, cycles, start, frame)
    marked = np.where(start.known[columns], start.q[columns], np.nan)
    found = phases(stage, shape, cycles, hips, units, marked, frame)
    scene = stage.in_scene(hips + units[:, None] * np.array([stage.facing, -1.0]) * found.shift)
    hips = stage.in_frames(smooth(scene, SMOOTH))
    return hips, units, found


def through(figure: Figure, path: Array, marked: Marked, fps: float) -> tuple[Array, float]:
    """The path (T, D) drawn to the marked angles, the less the further from their frame.

    People differ from a mean cycle, who starts off above all, and go on differing for a while. With the path
    comes how like the cycle the marked angles are, nats.
    """
    columns = columns_of(figure)
    off = np.where(marked.known, marked.q - path[marked.frame], 0.0)[columns]
    away = np.abs(np.arange(len(path)) - marked.frame) / fps
    drawn = path.copy()
    drawn[:, columns] += np.exp(-away / LASTING)[:, None] * off
    return drawn, float(likeness(off))


def agreeing(one: float, other: float) -> float:
    """Log odds that two statements are both true or both false, of the log odds that each is true."""
    return float(np.logaddexp(0.0, one + other) - np.logaddexp(one, other))


def _improbable(log_odds: float) -> float:
    """Probability that something of these log odds is not so."""
    return float(0.5 - 0.5 * np.tanh(0.5 * log_odds))


def _as_marked(
    odds: Planes, shape: Shape, ways: list[tuple[Array, float]], marked: Marked
) -> tuple[int, float]:
    """Which of two ways goes on from the marked pose, and its log odds."""
    first = max(marked.frame - AROUND, 0)
    part = slice(first, marked.frame + AROUND + 1)
    here = replace(marked, frame=marked.frame - first)
    worth = [like - climb(odds[part], shape, path[part], here).cost / MARGIN for path, like in ways]
    better = int(np.argmax(worth))
    return better, worth[better] - worth[1 - better]


def _shown(shape: Shape, q: Array, stage: Stage, hips: Array, units: Array) -> NDArray[np.bool_]:
    """(T, J) whether most of the axis of the link that ends at a joint stands out; of the base the trunk."""
    links = len(shape.figure.links)
    link, along = np.repeat(np.arange(links), len(ALONG)), np.tile(ALONG, links)
    places = surface(skeleton(shape.figure, q), link, along, np.zeros(len(link)))
    out = stage.at(stage.odds, hips, units, places, NOTHING) > NOTHING
    out = out.reshape(len(q), links, len(ALONG)).mean(-1) > MOSTLY
    return np.concatenate([out[:, [shape.trunk]], out], axis=1)


def _seen(score: Array) -> NDArray[np.bool_]:
    """(T,) whether the figure stands out from the scene; nowhere if it does not on the whole."""
    return (score > LEAST) & (np.median(score) > LEAST)
