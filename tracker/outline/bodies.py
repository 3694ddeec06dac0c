"""Finding walkers without marks: paths of bodies that stand out from the scene.

Every small map of log odds R is correlated with the mean body of the gait, at many sizes. With m the mean
silhouette, zero where arms may be, and o the places close around it,

    S = WEIGHT (sum R m - AROUND sum max(R, 0) o),

per square leg length: foreground inside is evidence for a body, foreground around it against. Viterbi runs
through the best places of every frame. A path may begin and end anywhere; its score is the sum of S less BASE
a frame, times its size, less the costs of its steps and changes of size. The best path is taken, its places
are removed, and the search is repeated.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from kinematics.figure import Array, Ints
from tracker.often import USUAL
from tracker.outline.cycles import Cycles, poses
from tracker.outline.shape import Grid, Shape
from tracker.outline.stage import WEIGHT, Stage
from tracker.picture.pyramid import Planes
from tracker.survey.evidence import NOTHING, UNITS

DENSITY = 8.0  # places in a leg length
GRID = Grid((-1.375, 1.25), DENSITY, (21, 23))
HIP = (10, 11)  # row and column of the hip in it
SMALLEST, LARGEST, RATIO = 1.0 / 14.0, 0.55, 1.18  # leg lengths, shares of the picture's height; their steps
SHORTEST = 14.0  # least length of a leg in a small picture, pixels
EVERY = 4  # every such phase of a cycle is part of the mean body
OFTEN = 15.0  # frames a second that are searched for everybody
OFTEN_ABOUT = 7.5  # the same about a person of known size
HALVED = 3.0  # ratio of widths from which a map is halved before it is resized
PLACES = 4  # best places kept for each size in a frame
NUDGES = np.array([[0, 0], [0, 1], [0, -1], [1, 0], [-1, 0]])  # their shifts that are tried, rows and columns
LEANS = np.radians([0.0, 25.0])  # leans of the trunk that are tried, beyond the cycles'
AROUND = 0.8  # weight of foreground around a body relative to that inside
BASE = 8.0  # score of a frame without a body, nats
STEP = 0.6  # cost of an eighth of a leg in a thirtieth of a second, nats
RESIZE = 3.0  # cost of a change to the next size, nats
FAR = 1.0  # longest step, leg lengths
LEAST = 60.0  # least score of a path over all frames, at 30 a second, nats
ABOUT = (0.45, 1.35)  # range of sizes searched for a person of known size, as factors
APART = 1.4  # least distance between two people, leg lengths of the one found first


@dataclass(frozen=True)
class Path:
    """The path of a body.

    first : its first frame; hips, units and score are of this and the following frames
    hips  : (n, 2) pixels of the film in each frame
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
        """Total score of the path as one of a person, nats times leg lengths."""
        return float(((self.score - BASE) * self.units).sum())

    def hips_in(self, first: int, count: int) -> Array:
        """(count, 2) the hips in so many frames from `first` on, NaN where the path does not reach."""
        hips = np.full((count, 2), np.nan)
        begin, end = max(self.first, first), min(self.last + 1, first + count)
        hips[begin - first : end - first] = self.hips[begin - self.first : end - self.first]
        return hips

    def part(self, frames: slice) -> "Path":
        """The path reduced to some of its frames."""
        first = self.first + (frames.start or 0)
        return Path(first, self.hips[frames], self.units[frames], self.score[frames])


def paths(stage: Stage, shape: Shape, cycles: Cycles, about: float | None = None) -> list[Path]:
    """All people in the film, the surest first.

    Args:
        about: leg length of the person searched for in pixels of the film, None for everybody. People smaller
            than SMALLEST are not found.
    """
    units, often = _units(stage), OFTEN
    if about is not None:
        units, often = units[(units > ABOUT[0] * about) & (units < ABOUT[1] * about)], OFTEN_ABOUT
    if not len(units):
        return []
    bodies, every = _Bodies.of(shape, cycles), max(round(stage.fps / often), 1)
    small = np.outer(DENSITY * stage.up[0, 0] / units, stage.odds.shape[1:])
    shapes = np.maximum(np.rint(small), 1.0).astype(int).tolist()
    places = [_places(stage, t, shapes, bodies) for t in range(0, len(stage), every)]
    found = []
    zoom = stage.zoom[::every]
    while (path := _best(places, units, zoom, stage.fps / every, stage.often * LEAST / every)) is not None:
        first, picked = path
        seen = np.stack([places[i][k] for i, k in enumerate(picked, first)])
        seen[:, 2] = units[seen[:, 2].astype(int)]
        found.append(_path(stage, first * every, every, seen))
        for i, (*here, unit, _) in enumerate(seen, first):
            free = np.hypot(*(places[i][:, :2] - here).T) > APART * unit * zoom[i]
            places[i] = places[i][free]
    return found


def _path(stage: Stage, first: int, every: int, seen: Array) -> Path:
    """The path from places in the scene, sizes and scores (n, 4) in each `every`-th frame from `first` on."""
    last = first + (len(seen) - 1) * every
    last = len(stage) - 1 if last + every >= len(stage) else last
    times = np.arange(first, last + 1)
    x, y, size, score = (np.interp(times, first + every * np.arange(len(seen)), each) for each in seen.T)
    hips = stage.part(slice(first, last + 1)).in_frames(np.column_stack([x, y]))
    return Path(first, hips, size, score)


def _units(stage: Stage) -> Array:
    """(S,) leg lengths that are searched, pixels of the film."""
    pixel = stage.up[0, 0]
    height = stage.odds.shape[1] * pixel
    least = max(SMALLEST * height, SHORTEST * pixel)
    count = int(np.log(LARGEST * height / least) / np.log(RATIO)) + 1
    return np.asarray(least * RATIO ** np.arange(count))


@dataclass(frozen=True)
class _Bodies:
    """Silhouettes of the gait, and of the places around them.

    mean  : (2, h, w) means of all silhouettes, inside and around
    masks : (2 h w, n) all silhouettes, inside above around, in both facings
    """

    mean: Planes
    masks: Planes

    @classmethod
    def of(cls, shape: Shape, cycles: Cycles) -> "_Bodies":
        q = poses(shape.figure, cycles.usual.halves(0.0, EVERY, leans=LEANS))
        body, arms = shape.painted(q.reshape(-1, q.shape[-1]), GRID)
        body, arms = (np.concatenate([each, each[..., ::-1]]) for each in (body, arms))
        inside, around = (WEIGHT / DENSITY**2 * each for each in (body, AROUND * (1.0 - body - arms)))
        masks = np.concatenate([inside.reshape(len(body), -1), -around.reshape(len(body), -1)], axis=1)
        mean = np.stack([inside.mean(0), around.mean(0)])
        return cls(mean, np.ascontiguousarray(masks.T, dtype=np.float32))

    def at(self, odds: Planes) -> tuple[Ints, Ints, Array]:
        """Rows and columns of the best places of a map, and the best silhouette's sum there, nats."""
        both = odds, np.maximum(odds, 0.0)
        inside, around = (
            cv2.filter2D(part, -1, mean, anchor=HIP[::-1], borderType=cv2.BORDER_CONSTANT)
            for part, mean in zip(both, self.mean, strict=True)
        )
        total = inside - around
        rows, columns = np.nonzero((total == cv2.dilate(total, np.ones((5, 5)))) & (inside > 0.0))
        order = np.argsort(-total[rows, columns])[:PLACES]
        rows, columns = rows[order][:, None] + NUDGES[:, 0], columns[order][:, None] + NUDGES[:, 1]
        parts = np.concatenate([_around(each, rows, columns) for each in both], axis=-1)
        score = (parts.reshape(-1, len(self.masks)) @ self.masks).max(-1).reshape(rows.shape)
        each, best = np.arange(len(score)), score.argmax(1)
        return rows[each, best], columns[each, best], score[each, best].astype(np.float64)


def _places(stage: Stage, t: int, shapes: list[list[int]], bodies: _Bodies) -> Array:
    """(n, 4) the best places of every size in a frame: pixels of the first frame, number of the size, nats.

    `shapes` are those of maps with DENSITY places in a leg length.
    """
    h, w = stage.odds.shape[1:]
    image = stage.odds[t]
    found = []
    for s, shape in enumerate(shapes):
        # Halving first is fast.
        while image.shape[1] > HALVED * shape[1]:
            half = image.shape[1] // 2, image.shape[0] // 2
            image = np.asarray(cv2.resize(image, half, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        small = cv2.resize(image, shape[::-1], interpolation=cv2.INTER_AREA)
        rows, columns, sums = bodies.at((small.astype(np.float32) - NOTHING) / UNITS)
        x = (np.stack([columns, rows], axis=1) + 0.5) * [w / small.shape[1], h / small.shape[0]] - 0.5
        film = x * np.diag(stage.up)[:2] + stage.up[:2, 2]
        scene = film @ stage.places[t, :2, :2].T + stage.places[t, :2, 2]
        found.append(np.column_stack([scene, np.full(len(sums), s), sums]))
    return np.concatenate(found)


def _around(odds: Planes, rows: Ints, columns: Ints) -> Planes:
    """(..., h w) values of a map on GRID around hips at these places (...)."""
    h, w = GRID.shape
    # As hips may lie one place outside.
    wide = cv2.copyMakeBorder(odds, HIP[0] + 1, h, HIP[1] + 1, w, cv2.BORDER_CONSTANT, value=0.0)
    inner = np.arange(h)[:, None] * wide.shape[1] + np.arange(w)
    corner = (rows + 1) * wide.shape[1] + columns + 1
    return np.asarray(wide.take(corner[..., None] + inner.ravel()))


def _best(
    places: list[Array], units: Array, zoom: Array, fps: float, least: float
) -> tuple[int, list[int]] | None:
    """First frame of the best path, and its place in each frame; None if no path scores `least`."""
    step = STEP * DENSITY * fps / USUAL
    worth = units / np.sqrt(units[0] * units[-1])
    value: list[Array] = []
    before: list[Ints] = []
    for t, here in enumerate(places):
        size = here[:, 2].astype(int)
        gain = (here[:, 3] - BASE) * worth[size]
        come = np.zeros(len(gain))
        back = np.full(len(gain), -1)
        if t > 0 and len(value[-1]):
            last = places[t - 1]
            unit = zoom[t] * np.maximum(units[size][:, None], units[last[:, 2].astype(int)])
            x, y, resized, _ = np.moveaxis(here[:, None] - last, -1, 0)
            cost = step * (away := np.hypot(x, y) / unit) + RESIZE * np.abs(resized)
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
