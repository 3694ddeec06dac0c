"""A person found in a film: how they go, which way they face, and the frame to start from."""

from dataclasses import dataclass, replace
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import NDArray

from kinematics.figure import Array, Figure
from kinematics.figure_file import load_figure
from kinematics.recover import Start
from kinematics.spm import View
from tracker.outline.bodies import Path
from tracker.outline.climb import GRID
from tracker.outline.cycles import Cycles
from tracker.outline.fit import Outline, fitted
from tracker.outline.shape import Shape
from tracker.outline.stage import Stage

SEEN = {"torso": 0.7, "head": 0.35}  # leg lengths; captured hip joints lie higher, the neck's base lower
LARGER = (1.0, 1.25)  # times as large as the mean body is found best, somebody may be
BEYOND = 1.0  # seconds before and after a path in which who went along it may be seen as well
AROUND = 25  # frames either way of the best one that tell which way a person faces
FEW = 15  # rounds of climbing that tell it
AHEAD = 0.04  # nats times square leg lengths a frame by which walking ahead is the likelier beforehand
ALIKE = 0.1  # log lengths by which trunk and legs differ at most there from what they mostly are
EXPLAINED = 0.8  # of the median log odds under the outline has a frame to start from
NEARLY = 0.9  # of the farthest that the ankles come apart in such a frame, they are in that to start from
LINES = ("hip", "neck", "head_top"), ("hip", "near_knee", "near_ankle"), ("hip", "far_knee", "far_ankle")
GOES = 0.5  # leg lengths over the scene from which it has a direction
SAME = 0.5  # leg lengths between the hips of what is one person found twice
NEAR = 1.5  # the same of a path that may be theirs
EDGE = 0.02  # shares of the picture within which no joint of it may lie


@dataclass(frozen=True)
class Person:
    """Somebody who walks through a film.

    first   : frame; the outline is of this and those after
    frame   : to start from
    facing  : +1 right, -1 left
    direction : +1 goes right, -1 left, 0 neither
    turned  : by how much the other facing explains the picture worse, nats times square leg lengths a frame;
        infinite where the facing was given
    outline : in every frame from the first on
    """

    figure: Figure
    first: int
    frame: int
    facing: int
    direction: int
    turned: float
    outline: Outline

    @property
    def last(self) -> int:
        return self.first + len(self.outline.q) - 1

    def later(self, frames: int) -> Self:
        """The person in a film that begins so many frames earlier."""
        return replace(self, first=self.first + frames, frame=self.frame + frames)

    def same(self, other: "Person") -> bool:
        """Whether two of one film are one: where both are seen they are mostly in one place."""
        return self._away(other.first, other.outline.hips) < SAME

    def near(self, path: Path) -> bool:
        """Whether who went along a path may be this one."""
        return self._away(path.first, path.hips) < NEAR

    def _away(self, first: int, hips: Array) -> float:
        """Median distance from hips (n, 2) from frame `first` on, leg lengths; inf where none is shared."""
        start, stop = max(self.first, first), min(self.last + 1, first + len(hips))
        if start >= stop:
            return np.inf
        own = slice(start - self.first, stop - self.first)
        away = np.hypot(*(self.outline.hips[own] - hips[start - first : stop - first]).T)
        return float(np.median(away / self.outline.units[own]))

    @property
    def spread(self) -> float:
        """Leg lengths by which its joints may be off in the frame to start from."""
        return float(self.outline.spread[self.frame - self.first])

    @property
    def exchanged(self) -> Self:
        """The same person with near and far leg exchanged."""
        outline = self.outline
        twins = self.figure.joint_twins
        other = replace(
            outline,
            joints=outline.joints[:, twins],
            shown=outline.shown[:, twins],
            q=outline.q[:, self.figure.exchanged],
            named=-outline.named,
        )
        return replace(self, outline=other)

    @property
    def joints(self) -> Array:
        """(J, 2) pixels in the frame to start from."""
        return np.asarray(self.outline.joints[self.frame - self.first])


def seen_figure() -> Figure:
    """The walking figure in the proportions that people are marked in on films."""
    figure = load_figure()
    return figure.with_lengths([SEEN.get(link.name, link.length) for link in figure.links])


def person(
    stage: Stage, figure: Figure, path: Path, cycles: Cycles, facing: int | None = None, alone: bool = True
) -> Person | None:
    """Who went along a path; None who is never in sight as a whole.

    Args:
        stage: the film.
        facing: +1 right, -1 left, None to see it.
        alone: whether nobody else goes through the film, to whom the outline may go over beyond the path.
    """
    best = int(np.argmax(path.score))
    ways = (1, -1) if facing is None else (facing,)
    within = stage.part(slice(path.first, path.last + 1))
    facing, larger, margin = _fits(within, figure, path, ways, cycles)
    beyond = round(BEYOND * stage.fps)
    first = max(path.first - beyond, 0)
    faced = replace(stage.part(slice(first, path.last + beyond + 1)), facing=facing)
    start = _start(figure, path, best, facing, larger)
    outline = fitted(faced, start, path.first + best - first, cycles)
    inner = outline.around(slice(path.first - first, path.last + 1 - first))
    faced, first = faced.part(inner), first + inner.start
    outline = outline.part(inner)
    sure = slice(None) if alone else slice(path.first - first, path.last + 1 - first)
    frame = _clearest(faced, outline, figure, sure)
    if frame is None:
        return None
    return Person(
        figure=figure,
        first=first,
        frame=first + frame,
        facing=facing,
        direction=_direction(faced, outline),
        turned=margin / float(np.median(outline.units)) ** 2,
        outline=outline,
    )


def _fits(
    part: Stage, figure: Figure, path: Path, ways: tuple[int, ...], cycles: Cycles
) -> tuple[int, float, float]:
    """Which way somebody faces, how much larger than found, and by how much another facing fits worse."""
    best = int(np.argmax(path.score))
    near = slice(max(best - AROUND, 0), best + AROUND + 1)
    trials = {}
    for facing, larger in product(ways, LARGER):
        faced, start = replace(part.part(near), facing=facing), _start(figure, path, best, facing, larger)
        outline = fitted(faced, start, best - near.start, cycles, FEW)
        # The same for whatever size is tried, or the largest would be the likeliest.
        ahead = AHEAD * (outline.way > 0) * float(np.median(path.units)) ** 2
        trials[facing, larger] = _explained(faced, outline, figure) + ahead
    better, size = max(trials, key=lambda trial: trials[trial])
    other = max((trials[trial] for trial in trials if trial[0] != better), default=-np.inf)
    return better, size, trials[better, size] - other


def _start(figure: Figure, path: Path, t: int, facing: int, larger: float) -> Start:
    """Somebody on the path, of whose pose nothing is known."""
    x, y = path.hips[t].tolist()
    D = len(figure.freedoms)
    view = View(origin=(x, y), unit=larger * float(np.median(path.units)), facing=facing)
    return Start(figure, view, np.zeros(D), np.zeros(D, bool))


def _explained(stage: Stage, outline: Outline, figure: Figure) -> float:
    """Log odds under the outline less those of what stands out around it, a frame, times square pixels."""
    odds = stage.around(outline.hips, outline.units, GRID)
    body, arms = Shape.of(figure).painted(outline.q, GRID)
    worth = odds * body - np.maximum(odds, 0.0) * (1.0 - body - arms)
    return float((worth.sum((1, 2)) * outline.units**2).mean() / GRID.density**2)


def _direction(stage: Stage, outline: Outline) -> int:
    """Direction of travel over the scene: 1 to the right, -1 to the left, 0 for neither."""
    x = stage.in_scene(outline.hips)[[0, -1], 0]
    return int(np.sign(x[1] - x[0])) if abs(x[1] - x[0]) > GOES * np.median(outline.units) else 0


def _clearest(stage: Stage, outline: Outline, figure: Figure, sure: slice) -> int | None:
    """The frame that shows the figure best among those with the ankles about as far apart as they come.

    If it can be one with limbs as long as they mostly are.

    Args:
        sure: frames to be taken first.
    """
    size = np.array(stage.odds.shape[:0:-1]) * np.diag(stage.up)[:2]
    shown = np.all((outline.joints > EDGE * size) & (outline.joints < (1.0 - EDGE) * size), axis=(1, 2))
    shown &= outline.score > EXPLAINED * np.median(outline.score)
    if shown[sure].any():
        shown &= np.isin(np.arange(len(shown)), np.arange(len(shown))[sure])
    ankles = [figure.joints.index(name) for name in ("near_ankle", "far_ankle")]
    apart = np.abs(np.diff(outline.joints[:, ankles, 0], axis=1))[:, 0] / outline.units
    if not shown.any():
        return None
    shown &= apart >= NEARLY * apart[shown].max()
    if (alike := shown & _as_long(outline, figure)).any():
        shown = alike
    return int(np.where(shown, outline.score, -np.inf).argmax())


def _as_long(outline: Outline, figure: Figure) -> NDArray[np.bool_]:
    """(T,) whether trunk and legs are about as long as they mostly are: not one of them partly unseen."""
    at = outline.joints[:, [[figure.joints.index(name) for name in line] for line in LINES]]
    length = np.log(np.hypot(*np.moveaxis(np.diff(at, axis=2), -1, 0)).sum(-1))
    return np.asarray(np.abs(length - np.median(length, axis=0)).max(1) < ALIKE)
