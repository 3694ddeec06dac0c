"""A person found in a film: outline, direction of travel, facing and start frame."""

from dataclasses import dataclass, replace
from itertools import product
from typing import Self

import numpy as np

from kinematics.figure import Array, Figure, Flags
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
LARGER = (1.0, 1.25)  # sizes that are tried, as factors on the size at which the mean body fits best
BEYOND = 1.0  # seconds before and after a path in which its person is searched for too
AROUND = 45  # frames, at 30 a second, before and after the best one that decide which way a person faces
FEW = 15  # rounds of optimisation for that
AHEAD = 0.04  # prior advantage of walking forwards, nats times square leg lengths a frame
ALIKE = 0.1  # largest deviation of trunk and legs in a start frame from their medians, log lengths
EXPLAINED = 0.8  # least log odds under the outline in a start frame as a share of their median
NEARLY = 0.9  # least distance of the ankles in a start frame as a share of the largest in such frames
LINES = ("hip", "neck", "head_top"), ("hip", "near_knee", "near_ankle"), ("hip", "far_knee", "far_ankle")
GOES = 0.5  # least travel over the scene that gives a direction, leg lengths
SAME = 0.5  # largest distance between the hips of one person found twice, leg lengths
NEAR = 1.5  # the same for a path that may be the person's
EDGE = 0.02  # margin of the picture in which no joint of a start may lie, shares of its size


@dataclass(frozen=True)
class Person:
    """A person who walks through a film.

    first   : first frame of the outline
    frame   : start frame
    facing  : +1 right, -1 left
    direction : of travel, +1 right, -1 left, 0 neither
    turned  : advantage over the other facing in explaining the picture, nats times square leg lengths a
        frame; negative where that explains it better than one that was given
    outline : in every frame from the first on
    given   : whether the facing was given
    """

    figure: Figure
    first: int
    frame: int
    facing: int
    direction: int
    turned: float
    outline: Outline
    given: bool = False

    @property
    def last(self) -> int:
        return self.first + len(self.outline.q) - 1

    def in_film(self, first: int, every: int) -> Self:
        """The person in the film of whose frames every `every`-th one from `first` on was searched."""
        begin, frame = (first + every * t for t in (self.first, self.frame))
        return replace(self, first=begin, frame=frame, outline=self.outline.finer(every))

    def same(self, other: "Person") -> bool:
        """Whether two people of a film are the same: in common frames they are mostly in one place, and they
        do not go opposite ways, as before and after a turn."""
        return self._away(other.first, other.outline.hips) < SAME and self.direction * other.direction >= 0

    def near(self, path: Path) -> bool:
        """Whether the path may be this person's."""
        return self._away(path.first, path.hips) < NEAR

    def _away(self, first: int, hips: Array) -> float:
        """Median distance from hips (n, 2) from frame `first` on, leg lengths; inf without common frames."""
        start, stop = max(self.first, first), min(self.last + 1, first + len(hips))
        if start >= stop:
            return np.inf
        own = slice(start - self.first, stop - self.first)
        away = np.hypot(*(self.outline.hips[own] - hips[start - first : stop - first]).T)
        return float(np.median(away / self.outline.units[own]))

    @property
    def spread(self) -> float:
        """Standard deviation of its joints in the start frame, leg lengths."""
        return float(self.outline.spread[self.frame - self.first])

    @property
    def exchanged(self) -> Self:
        """The same person with near and far leg exchanged."""
        return replace(self, outline=self.outline.exchanged(self.figure))

    @property
    def joints(self) -> Array:
        """(J, 2) pixels of its joints in the start frame."""
        return np.asarray(self.outline.joints[self.frame - self.first])


def seen_figure() -> Figure:
    """The walking figure with the proportions that marks on films have."""
    figure = load_figure()
    return figure.with_lengths([SEEN.get(link.name, link.length) for link in figure.links])


def person(
    stage: Stage, figure: Figure, path: Path, cycles: Cycles, facing: int | None = None, alone: bool = True
) -> Person | None:
    """The person on a path; None if never seen as a whole.

    Args:
        stage: the film.
        facing: +1 right, -1 left, None to find it.
        alone: whether there is nobody else in the film to whom the outline could jump beyond the path.
    """
    best = int(np.argmax(path.score))
    within, given = stage.part(slice(path.first, path.last + 1)), facing is not None
    facing, larger, margin = _fits(within, figure, path, facing, cycles.usual)
    beyond = round(BEYOND * stage.fps)
    first = max(path.first - beyond, 0)
    faced = replace(stage.part(slice(first, path.last + beyond + 1)), facing=facing)
    start = _start(figure, path, best, facing, larger)
    outline = fitted(faced, start, path.first + best - first, cycles, found=path.hips_in(first, len(faced)))
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
        given=given,
    )


def _fits(
    part: Stage, figure: Figure, path: Path, facing: int | None, cycles: Cycles
) -> tuple[int, float, float]:
    """The facing of a person, the one given if any, the factor on the size of the path, and the advantage
    over the other facing."""
    best = int(np.argmax(path.score))
    around = round(part.often * AROUND)
    near = slice(max(best - around, 0), best + around + 1)
    trials = {}
    for way, larger in product((1, -1), LARGER):
        faced, start = replace(part.part(near), facing=way), _start(figure, path, best, way, larger)
        hips = path.hips_in(path.first + near.start, len(faced))
        outline = fitted(faced, start, best - near.start, cycles, FEW, hips)
        # In pixels, the same for every size that is tried; else the largest size would win.
        ahead = AHEAD * (outline.way > 0) * float(np.median(path.units)) ** 2
        trials[way, larger] = _explained(faced, outline, figure) + ahead
    better, size = max(trials, key=lambda trial: (facing in (None, trial[0]), trials[trial]))
    other = max(worth for (way, _), worth in trials.items() if way != better)
    return better, size, trials[better, size] - other


def _start(figure: Figure, path: Path, t: int, facing: int, larger: float) -> Start:
    """The start of a person on the path, whose pose is unknown."""
    x, y = path.hips[t].tolist()
    D = len(figure.freedoms)
    view = View(origin=(x, y), unit=larger * float(np.median(path.units)), facing=facing)
    return Start(figure, view, np.zeros(D), np.zeros(D, bool))


def _explained(stage: Stage, outline: Outline, figure: Figure) -> float:
    """Log odds under the outline less those of the foreground around it, a frame, times square pixels."""
    odds = stage.around(outline.hips, outline.units, GRID)
    body, arms = Shape.of(figure).painted(outline.q, GRID)
    worth = odds * body - np.maximum(odds, 0.0) * (1.0 - body - arms)
    return float((worth.sum((1, 2)) * outline.units**2).mean() / GRID.density**2)


def _direction(stage: Stage, outline: Outline) -> int:
    """Direction of travel over the scene: 1 to the right, -1 to the left, 0 for neither."""
    travel = stage.travel(outline.hips, outline.units)
    return int(np.sign(travel)) if abs(travel) > GOES else 0


def _clearest(stage: Stage, outline: Outline, figure: Figure, sure: slice) -> int | None:
    """The frame that shows the figure best among those with the ankles about as far apart as they come.

    Preferred are frames that are `sure`, those in which every link stands out from the scene, and those in
    which the limbs have about their usual length.
    """
    size = np.array(stage.odds.shape[:0:-1]) * np.diag(stage.up)[:2]
    shown = np.all((outline.joints > EDGE * size) & (outline.joints < (1.0 - EDGE) * size), axis=(1, 2))
    usual = np.median(outline.score)
    shown &= outline.score > usual - (1.0 - EXPLAINED) * abs(usual)
    if shown[sure].any():
        shown &= np.isin(np.arange(len(shown)), np.arange(len(shown))[sure])
    ankles = [figure.joints.index(name) for name in ("near_ankle", "far_ankle")]
    apart = np.abs(np.diff(outline.joints[:, ankles, 0], axis=1))[:, 0] / outline.units
    if not shown.any():
        return None
    if (whole := shown & outline.shown.all(1)).any():
        shown = whole
    shown &= apart >= NEARLY * apart[shown].max()
    if (alike := shown & _as_long(outline, figure)).any():
        shown = alike
    return int(np.where(shown, outline.score, -np.inf).argmax())


def _as_long(outline: Outline, figure: Figure) -> Flags:
    """(T,) whether trunk and legs are about as long as in most frames, so that none is partly unseen."""
    at = outline.joints[:, [[figure.joints.index(name) for name in line] for line in LINES]]
    length = np.log(np.hypot(*np.moveaxis(np.diff(at, axis=2), -1, 0)).sum(-1))
    return np.asarray(np.abs(length - np.median(length, axis=0)).max(1) < ALIKE)
