"""Who walks through a film: paths of bodies that stand out from the scene, found without a mark.

Every small map of log odds R is correlated with the mean body of the gait, at many sizes. With m the mean
silhouette, zero where arms may be, and o the places close around it,

    S = WEIGHT (sum R m - AROUND sum max(R, 0) o),

per square leg length: what stands out inside speaks for a body, what stands out around it against. Viterbi
goes through the best places of every frame. A path may begin and end anywhere; it is worth the sum of S less
BASE a frame, times its size, and less what its steps and changes of size cost. The best path is taken, its
places are struck out, and so on.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kinematics.figure import Array
from tracker.outline.cycles import Cycles, poses
from tracker.outline.kernels import Kernels
from tracker.outline.shape import Grid, Shape
from tracker.outline.stage import WEIGHT, Stage
from tracker.picture.pyramid import Planes
from tracker.survey.evidence import NOTHING, UNITS

DENSITY = 8.0  # places in a leg length
GRID = Grid((-1.375, 1.25), DENSITY, (21, 23))
HIP = (10, 11)  # row and column of the hip in it
SMALLEST, LARGEST, RATIO = 1.0 / 14.0, 0.55, 1.18  # leg lengths, shares of the picture's height
SHORTEST = 14.0  # pixels of a small picture in a leg that is seen at all
EVERY = 4  # so manieth phase of a cycle is part of the mean body
OFTEN = 15.0  # frames a second are looked at
HALVED = 3.0  # times as wide as it is wanted, a map is halved first
PLACES = 4  # best ones of a size in a frame
NUDGES = np.array([[0, 0], [0, 1], [0, -1], [1, 0], [-1, 0]])  # rows and columns by which these are shifted
LEANS = np.radians([0.0, 25.0])  # of the trunk beyond the cycles'
AROUND = 0.8  # what stands out around a body costs so much of what it earns inside
BASE = 8.0  # nats a frame that a body must be better than nothing
STEP = 0.6  # nats for an eighth of a leg in a thirtieth of a second
RESIZE = 3.0  # nats for a change to the next size
FAR = 1.0  # leg lengths in a step at most
LEAST = 60.0  # nats of a path
ABOUT = (0.45, 1.35)  # of how large somebody is, as how large they may be found
APART = 1.4  # leg lengths of the one found first between two people


@dataclass(frozen=True)
class Path:
    """Where a body was seen.

    first : its first frame; hips, units and score are of this and those after
    hips  : (n, 2) the film's pixels of each frame
    units : (n,) pixels in a leg length
    score : (n,) nats
    """

    first: int
    hips: Array
    units: Array
    score: Array

    @property
    def last(self) -> int:
        return self.first + len(self.hips) - 1

    @property
    def worth(self) -> float:
        """Score of the whole path as that of a person, nats times leg lengths."""
        return float(((self.score - BASE) * self.units).sum())

    def part(self, frames: slice) -> "Path":
        """The path in some of its frames."""
        first = self.first + (frames.start or 0)
        return Path(first, self.hips[frames], self.units[frames], self.score[frames])


@dataclass(frozen=True)
class Places:
    """Where a frame may show a body.

    scene : (n, 2) pixels of the first frame
    size  : (n,) position among the sizes
    score : (n,) nats
    """

    scene: Array
    size: NDArray[np.intp]
    score: Array


def paths(stage: Stage, shape: Shape, cycles: Cycles, about: float | None = None) -> list[Path]:
    """Everybody who is seen, the surest first.

    Args:
        about: the film's pixels in a leg length of who is looked for, None for everybody. Nobody is seen who
            is smaller than SMALLEST.
    """
    units, every = _units(stage), max(round(stage.fps / OFTEN), 1)
    if about is not None:
        units = units[(units > ABOUT[0] * about) & (units < ABOUT[1] * about)]
    if not len(units):
        return []
    bodies = _Bodies.of(shape, cycles)
    sizes = [bodies.of_size(stage, unit) for unit in units.tolist()]
    places = [_places(stage, t, sizes, bodies) for t in range(0, len(stage), every)]
    found = []
    while (path := _best(places, units, stage.fps / every, LEAST / every)) is not None:
        first, picked = path
        scene = np.stack([places[i].scene[k] for i, k in enumerate(picked, first)])
        size = units[[places[i].size[k] for i, k in enumerate(picked, first)]]
        score = np.array([places[i].score[k] for i, k in enumerate(picked, first)])
        found.append(_path(stage, first * every, every, np.column_stack([scene, size, score])))
        for i, (here, unit) in enumerate(zip(scene, size, strict=True), first):
            free = np.hypot(*(places[i].scene - here).T) > APART * unit
            places[i] = Places(places[i].scene[free], places[i].size[free], places[i].score[free])
    return found


def _path(stage: Stage, first: int, every: int, seen: Array) -> Path:
    """The path of places in the scene, sizes and scores (n, 4), seen from a frame on in every so manieth."""
    last = first + (len(seen) - 1) * every
    last = len(stage) - 1 if last + every >= len(stage) else last
    times = np.arange(first, last + 1)
    x, y, size, score = (np.interp(times, first + every * np.arange(len(seen)), each) for each in seen.T)
    hips = stage.part(slice(first, last + 1)).in_frames(np.column_stack([x, y]))
    return Path(first, hips, size, score)


def _units(stage: Stage) -> Array:
    """(S,) leg lengths that are looked for, the film's pixels."""
    pixel = stage.up[0, 0]
    height = stage.odds.shape[1] * pixel
    least = max(SMALLEST * height, SHORTEST * pixel)
    count = int(np.log(LARGEST * height / least) / np.log(RATIO)) + 1
    return np.asarray(least * RATIO ** np.arange(count))


@dataclass(frozen=True)
class _Bodies:
    """Silhouettes of the gait, and the places around them.

    mean  : (2, h, w) the mean of all, inside and around
    masks : (2 h w, n) all of them, inside over around, both facings
    """

    mean: Planes
    masks: Planes

    @classmethod
    def of(cls, shape: Shape, cycles: Cycles) -> "_Bodies":
        q = poses(shape.figure, cycles.halves(0.0, EVERY, leans=LEANS))
        body, arms = shape.painted(q.reshape(-1, q.shape[-1]), GRID)
        body, arms = (np.concatenate([each, each[..., ::-1]]) for each in (body, arms))
        inside, around = (WEIGHT / DENSITY**2 * each for each in (body, AROUND * (1.0 - body - arms)))
        masks = np.concatenate([inside.reshape(len(body), -1), -around.reshape(len(body), -1)], axis=1)
        mean = np.stack([inside.mean(0), around.mean(0)])
        return cls(mean, np.ascontiguousarray(masks.T, dtype=np.float32))

    def of_size(self, stage: Stage, unit: float) -> tuple[Kernels, Kernels]:
        """The mean body with so many of the film's pixels in a leg length, and what lies around it.

        They are for maps with DENSITY places in a leg length.
        """
        by = unit / stage.up[0, 0] / DENSITY
        h, w = (max(round(n / by), 1) for n in stage.odds.shape[1:])
        inside, around = (Kernels.of(each[None], HIP, (h, w)) for each in self.mean)
        return inside, around

    def at(
        self, odds: Planes, means: tuple[Kernels, Kernels]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
        """Rows and columns of the best places of a map, and the best silhouette's sum there, nats."""
        both = odds, np.maximum(odds, 0.0)
        inside, around = (mean.sums(part)[0] for mean, part in zip(means, both, strict=True))
        sums = inside - around
        rows, columns = np.nonzero((sums == cv2.dilate(sums, np.ones((5, 5)))) & (inside > 0.0))
        order = np.argsort(-sums[rows, columns])[:PLACES]
        rows, columns = rows[order][:, None] + NUDGES[:, 0], columns[order][:, None] + NUDGES[:, 1]
        parts = np.concatenate([_around(each, rows, columns) for each in both], axis=-1)
        score = (parts.reshape(-1, len(self.masks)) @ self.masks).max(-1).reshape(rows.shape)
        each, best = np.arange(len(score)), score.argmax(1)
        return rows[each, best], columns[each, best], score[each, best].astype(np.float64)


def _places(stage: Stage, t: int, sizes: list[tuple[Kernels, Kernels]], bodies: _Bodies) -> Places:
    """The best places of every size in a frame."""
    h, w = stage.odds.shape[1:]
    image = stage.odds[t]
    scene, size, score = [], [], []
    for s, means in enumerate(sizes):
        shape = means[0].shape
        # By halves first, which is fast.
        while image.shape[1] > HALVED * shape[1]:
            half = image.shape[1] // 2, image.shape[0] // 2
            image = np.asarray(cv2.resize(image, half, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        small = cv2.resize(image, shape[::-1], interpolation=cv2.INTER_AREA)
        rows, columns, sums = bodies.at((small.astype(np.float32) - NOTHING) / UNITS, means)
        x = (np.stack([columns, rows], axis=1) + 0.5) * [w / small.shape[1], h / small.shape[0]] - 0.5
        film = x * stage.up[0, 0] + stage.up[:2, 2]
        scene.append(film @ stage.places[t, :2, :2].T + stage.places[t, :2, 2])
        size.append(np.full(len(sums), s))
        score.append(sums)
    return Places(np.concatenate(scene), np.concatenate(size), np.concatenate(score))


def _around(odds: Planes, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Planes:
    """(..., h w) what a map shows on GRID around hips at these places (...)."""
    h, w = GRID.shape
    # As hips may lie one place outside.
    wide = cv2.copyMakeBorder(odds, HIP[0] + 1, h, HIP[1] + 1, w, cv2.BORDER_CONSTANT, value=0.0)
    inner = np.arange(h)[:, None] * wide.shape[1] + np.arange(w)
    corner = (rows + 1) * wide.shape[1] + columns + 1
    return np.asarray(wide.take(corner[..., None] + inner.ravel()))


def _best(places: list[Places], units: Array, fps: float, least: float) -> tuple[int, list[int]] | None:
    """The first frame of the best path, and its place in each; None where no path is worth `least`."""
    step = STEP * DENSITY * fps / 30.0
    worth = units / np.sqrt(units[0] * units[-1])
    value: list[Array] = []
    before: list[NDArray[np.intp]] = []
    for t, here in enumerate(places):
        gain = (here.score - BASE) * worth[here.size]
        come = np.zeros(len(gain))
        back = np.full(len(gain), -1)
        if t > 0 and len(value[-1]):
            last = places[t - 1]
            unit = np.maximum(units[here.size][:, None], units[last.size][None])
            away = np.hypot(*np.moveaxis(here.scene[:, None] - last.scene[None], -1, 0)) / unit
            cost = step * away + RESIZE * np.abs(here.size[:, None] - last.size[None])
            reached = np.where(away <= FAR, value[-1] - cost, -np.inf)
            best = reached.argmax(1)
            top = reached[np.arange(len(gain)), best]
            come, back = np.maximum(top, 0.0), np.where(top > 0.0, best, -1)
        value.append(gain + come)
        before.append(back)
    ends = [each.max(initial=-np.inf) for each in value]
    t = int(np.argmax(ends))
    if ends[t] < least:
        return None
    picked = [int(value[t].argmax())]
    while before[t][picked[-1]] >= 0:
        picked.append(int(before[t][picked[-1]]))
        t -= 1
    return t, picked[::-1]
