"""The outline of a marked figure fitted to every frame of a surveyed film."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from kinematics.figure import SCALE, Array, Figure, Flags
from kinematics.recover import Start
from kinematics.spm import View, joints, skeleton, surface
from tracker.outline.climb import GRID, ROUNDS, Marked, climb
from tracker.outline.cycles import NECK, TRUNK, Cycles, at_phases, columns_of, poses
from tracker.outline.doubt import spread
from tracker.outline.near import nearness
from tracker.outline.phase import Phases, likeness, phases
from tracker.outline.place import walk
from tracker.outline.shape import Shape
from tracker.outline.smooth import finer, smooth
from tracker.outline.stage import Stage
from tracker.outline.swing import swing
from tracker.picture.pyramid import Planes
from tracker.survey.evidence import NOTHING

LEAST = 0.1  # least log odds under the outline, nats times square leg lengths; 0.8 to 1.9 in full sight
# Numbers of frames are those at 30 a second.
SMOOTH = 1.0  # frames over which the path's small shifts are smoothed
LASTING = 0.2  # seconds over which the difference between the marked pose and its cycle decays
AROUND = 6  # frames before and after the marked one that decide which leg is near
ALONG = np.linspace(0.1, 0.9, 9)  # places on the axis of a link, shares of its length
MOSTLY = 0.65  # share of them that must stand out for a link to stand out
RIGHTLY = 2.2  # prior log odds that marks name the legs correctly
NEARER = 2.0  # log odds of a naming for a standard error of the picture's evidence
AGAINST = 3.5  # prior log odds that somebody's arms swing against the legs
MARGIN = 10.0  # divisor of differences between fits, since errors of neighbouring pixels are correlated
ROWS = ("q", "hips", "units", "joints", "score", "shown", "spread")  # what an outline has of every frame
SMOOTH_LEAN = 3.0  # frames over which the path's lean is smoothed


@dataclass(frozen=True)
class Outline:
    """A figure fitted to its outline.

    q      : (T, D) poses, with the root relative to `hips`
    hips   : (T, 2) pixels of each frame
    units  : (T,) pixels in a leg length
    joints : (T, J, 2) pixels of each frame, as `figure.joints` names them
    score  : (T,) log odds under the outline, nats times leg lengths squared
    shown  : (T, J) whether the link that ends at a joint stands out from the scene
    spread : (T,) standard deviation of its joints, leg lengths
    gait   : "walk" or "run"
    way    : +1, or -1 for a stride that runs backwards in time
    named  : log odds that the legs are named correctly
    misnamed : probability that the start marks name them wrongly
    """

    q: Array
    hips: Array
    units: Array
    joints: Array
    score: Array
    shown: Flags
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
    def seen(self) -> Flags:
        """(T,) whether the figure stands out from the scene; false throughout if it mostly does not."""
        return _seen(self.score)

    def around(self, inner: slice) -> slice:
        """The frames of `inner`, extended both ways up to the first frame in which the figure is not seen."""
        unseen = np.flatnonzero(self.score < LEAST)
        before, after = unseen[unseen < inner.start], unseen[unseen >= inner.stop]
        return slice(int(before.max(initial=-1)) + 1, int(after.min(initial=len(self.score))))

    def part(self, frames: slice) -> Self:
        """The outline reduced to some of the frames."""
        return replace(self, **{name: getattr(self, name)[frames] for name in ROWS})

    def exchanged(self, figure: Figure) -> Self:
        """The same outline with the figure's near and far leg exchanged."""
        twins = figure.joint_twins
        return replace(
            self,
            q=self.q[:, figure.exchanged],
            joints=self.joints[:, twins],
            shown=self.shown[:, twins],
            named=-self.named,
        )

    def start(self, figure: Figure, facing: int, t: int) -> Start:
        """The pose in row t as one to start from, all of it known."""
        q, unit = self.q[t].copy(), float(self.units[t])
        x, y = (self.hips[t] + unit * np.array([facing, -1.0]) * q[:2]).tolist()
        view = View(origin=(x, y), unit=unit * float(np.exp(q[figure.index(SCALE)])), facing=facing)
        q[:2] = q[figure.index(SCALE)] = 0.0
        return Start(figure, view, q, np.ones(len(q), bool))

    def finer(self, every: int) -> Self:
        """The outline at `every` times the frame rate; what lies between unlike frames is not shown."""
        rows = {name: finer(getattr(self, name), every) for name in ROWS}
        return replace(self, **rows | {"shown": rows["shown"] == 1.0})


def fitted(
    stage: Stage, start: Start, frame: int, cycles: Cycles, rounds: int = ROUNDS, found: Array | None = None
) -> Outline:
    """Fit the outline of a figure to every frame.

    Args:
        stage: the film, with the figure's facing.
        start: pose in `frame`; if none of it is known it gives only the place and the approximate size.
        rounds: largest number of optimisation steps.
        found: (T, 2) the hip of somebody who was found, as in `walk`.
    """
    figure, shape, columns = start.figure, Shape.of(start.figure), columns_of(start.figure)
    hips, units, phase = _gait(stage, start, frame, cycles, found)
    axes = units[:, None] * np.array([stage.facing, -1.0])
    angles = at_phases(cycles.pose[phase.cycle], phase.phase)
    angles[:, TRUNK] += smooth(phase.lean, stage.rate * SMOOTH_LEAN)
    angles[:, NECK] = start.q[columns[NECK]]
    q = start.q.copy()
    q[:2] = (np.asarray(start.view.origin) - hips[frame]) / axes[frame]
    q[figure.index(SCALE)] = np.log(start.view.unit / units[frame])
    odds = stage.around(hips, units, GRID)
    path, marks = poses(figure, angles), Marked(frame, q, start.known)
    ways = [through(figure, way, marks, stage.fps) for way in (path, path[:, figure.exchanged])]
    often = stage.often
    better, margin = _as_marked(odds, shape, ways, marks, often) if start.known.any() else (0, 0.0)
    best, score, _ = climb(odds, shape, ways[better][0], marks, rounds, often)
    looks = _nearer(shape, best, stage, hips, units, _seen(score))
    named = looks + agreeing(margin, RIGHTLY)
    if named < 0.0 and margin < RIGHTLY and start.known.any():
        best, score, _ = climb(odds, shape, ways[1 - better][0], marks, rounds, often)
    elif named < 0.0:  # nothing is marked, or the fit follows the marks and these name the legs wrongly
        best = best[:, figure.exchanged]
    pixels = hips[:, None] + joints(figure, best) * axes[:, None]
    shown = _shown(shape, best, stage, hips, units)
    off = spread(shape, best, odds, GRID)
    gait, misnamed = cycles.gait(phase.cycle), _improbable(RIGHTLY + agreeing(margin, looks))
    return Outline(best, hips, units, pixels, score, shown, off, gait, phase.way, abs(named), misnamed)


def _gait(
    stage: Stage, start: Start, frame: int, cycles: Cycles, found: Array | None
) -> tuple[Array, Array, Phases]:
    """Hip (T, 2), leg length in pixels (T,) and phase in every frame."""
    shape, columns = Shape.of(start.figure), columns_of(start.figure)
    hips, units = walk(stage, shape, cycles, start, frame, found)
    marked = np.where(start.known[columns], start.q[columns], np.nan)
    seen = phases(stage, shape, cycles, hips, units, marked, frame)
    scene = stage.in_scene(hips + units[:, None] * np.array([stage.facing, -1.0]) * seen.shift)
    hips = stage.in_frames(smooth(scene, stage.rate * SMOOTH))
    return hips, units, seen


def through(figure: Figure, path: Array, marked: Marked, fps: float) -> tuple[Array, float]:
    """The path (T, D) drawn to the marked angles, with an influence that decays with time from their frame.

    People differ from a mean cycle for a while, above all when they start walking. The second result is the
    log likelihood of the marked angles under the cycle, nats.
    """
    columns = columns_of(figure)
    off = np.where(marked.known, marked.q - path[marked.frame], 0.0)[columns]
    away = np.abs(np.arange(len(path)) - marked.frame) / fps
    drawn = path.copy()
    drawn[:, columns] += np.exp(-away / LASTING)[:, None] * off
    return drawn, float(likeness(off))


def agreeing(one: float, other: float) -> float:
    """Log odds that two statements are both true or both false, from the log odds that each is true."""
    return float(np.logaddexp(0.0, one + other) - np.logaddexp(one, other))


def _nearer(shape: Shape, q: Array, stage: Stage, hips: Array, units: Array, seen: Flags) -> float:
    """Log odds that the leg named near is in front, as legs that overlap and the arms show it."""
    legs, arms = (tell(shape, q, stage, hips, units, seen) for tell in (nearness, swing))
    return NEARER * legs + agreeing(NEARER * arms, AGAINST)


def _improbable(log_odds: float) -> float:
    """Probability that a statement with these log odds is false."""
    return float(0.5 - 0.5 * np.tanh(0.5 * log_odds))


def _as_marked(
    odds: Planes, shape: Shape, ways: list[tuple[Array, float]], marked: Marked, often: float
) -> tuple[int, float]:
    """Which of two namings continues the marked pose, and its log odds."""
    around = round(often * AROUND)
    first = max(marked.frame - around, 0)
    part = slice(first, marked.frame + around + 1)
    here = replace(marked, frame=marked.frame - first)
    costs = [climb(odds[part], shape, path[part], here, often=often)[2] for path, _ in ways]
    worth = [like - cost / (often * MARGIN) for cost, (_, like) in zip(costs, ways, strict=True)]
    better = int(np.argmax(worth))
    return better, worth[better] - worth[1 - better]


def _shown(shape: Shape, q: Array, stage: Stage, hips: Array, units: Array) -> Flags:
    """(T, J) whether most of the axis of the link that ends at a joint (the base: the trunk) stands out."""
    links = len(shape.figure.links)
    link, along = np.repeat(np.arange(links), len(ALONG)), np.tile(ALONG, links)
    places = surface(skeleton(shape.figure, q), link, along, np.zeros(len(link)))
    out = stage.at(stage.odds, hips, units, places, NOTHING) > NOTHING
    out = out.reshape(len(q), links, len(ALONG)).mean(-1) > MOSTLY
    return np.concatenate([out[:, [shape.trunk]], out], axis=1)


def _seen(score: Array) -> Flags:
    """(T,) whether the figure stands out from the scene; false throughout if it mostly does not."""
    return (score > LEAST) & (np.median(score) > LEAST)
