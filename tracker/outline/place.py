"""Place and size of a walking figure in every frame of a film: the best path of its mean silhouettes.

Log odds are summed under mean silhouettes of a few phases and sizes everywhere in a frame, coarsely. Viterbi
over size, row and column then finds the path over the scene through the marked place for which the sum, less
the costs of changes of place and size, is largest.
"""

from collections.abc import Iterable, Iterator

import cv2
import numpy as np

from kinematics.figure import SCALE, Array, Ints
from kinematics.recover import Start
from tracker.outline.cycles import Cycles, poses
from tracker.outline.kernels import Kernels
from tracker.outline.shape import Grid, Shape
from tracker.outline.smooth import smooth
from tracker.outline.stage import WEIGHT, Stage, blurred
from tracker.outline.viterbi import best_path
from tracker.picture.pyramid import Planes
from tracker.survey.evidence import NOTHING, UNITS

DENSITY = 8.0  # places in a leg length
SIZES_OFF = np.arange(-2, 3)  # sizes that are tried, steps from the marked one
SIZES = np.log(1.12) * SIZES_OFF  # their logs relative to it
EVERY = 10  # every such phase of a cycle has a silhouette
STEP = 0.6  # cost of a step of one place along, or of half a place up or down, nats; at 30 frames a second
RESIZE, RESIZE_FOUND = 3.0, 8.0  # cost of a change to the next size, nats, with a marked frame, without marks
FASTEST = 15.0  # speed with which a longest step keeps up, leg lengths a second,
REACH, FARTHEST = 5, 24  # and the least and the largest longest step, places a frame
HELD = 12.0  # cost of a path one place off the marked place, nats; four times as much for one size
HELD_FOUND = 0.3  # the same for a start without marks
SMOOTH = 1.5  # frames over which the path's place is smoothed, at 30 a second
SMOOTH_SIZE, SMOOTH_FOUND = 30.0, 10.0  # the same for its size, with a marked frame, without marks
FAR = 40.0  # places beyond which the cost no longer grows
GRID = Grid((-1.25, 1.125), DENSITY, (19, 21))
HIP = (9, 10)  # row and column of the hip in it


def walk(
    stage: Stage, shape: Shape, cycles: Cycles, start: Start, frame: int, found: Array | None = None
) -> tuple[Array, Array]:
    """The path of a figure's hip.

    Args:
        start: pose in `frame`; if none of it is known, it was found without marks and is approximate.
        found: (T, 2) pixels near which the search for people found the hip, NaN where it found none; None to
            begin from `start` alone.

    Returns:
        (T, 2) the hip, pixels of the film in each frame, and (T,) leg lengths in pixels.
    """
    zoom = stage.zoom
    unit, marked = start.view.unit * float(zoom[frame]), bool(start.known.any())
    size, corners = extent(stage, DENSITY / unit)
    hips = np.full((len(stage), 2), np.nan) if found is None else found.copy()
    hips[frame] = start.view.origin
    odds = maps(stage, DENSITY / unit, size, corners)
    # Without marks uncovered foreground has a cost too, like covered background; it determines the size.
    weighed = odds if marked else (each + np.maximum(each, 0.0) for each in odds)
    sums = _sums(weighed, size, _silhouettes(shape, cycles, stage.facing))
    held = _held(DENSITY / unit * stage.in_scene(hips) - corners, size, frame, HELD if marked else HELD_FOUND)
    scores = (score - cost for score, cost in zip(sums, held, strict=True))
    # At a low rate a step may be longer, and a second's way costs as much.
    step, resize = min(stage.rate, 1.0) * STEP, stage.often * (RESIZE if marked else RESIZE_FOUND)
    reach = min(max(round(DENSITY * FASTEST / stage.fps), REACH), FARTHEST)
    path = best_path(scores, corners, step, resize, reach)
    places = smooth((path[:, [2, 1]] + corners).astype(np.float64), stage.rate * SMOOTH)
    larger = smooth(SIZES[path[:, 0]], stage.rate * (SMOOTH_SIZE if marked else SMOOTH_FOUND))
    larger -= larger[frame] if marked else 0.0
    return stage.in_frames(places * unit / DENSITY), unit * np.exp(larger) / zoom


def _held(hips: Array, extent: tuple[int, int], frame: int, cost: float) -> Iterator[Planes | float]:
    """Costs (S, h, w) of places away from each frame's hip (T, 2), and of other sizes in `frame`, nats."""
    rows, columns = np.mgrid[: extent[0], : extent[1]]
    for t, (x, y) in enumerate(hips):
        if np.isfinite(x):
            away = np.minimum(np.hypot(columns - x, rows - y), FAR) ** 2
            sizes = 4.0 * np.abs(SIZES_OFF) if t == frame else 0.0 * SIZES_OFF
            yield (cost * (away + sizes[:, None, None])).astype(np.float32)
        else:
            yield 0.0


def extent(stage: Stage, by: float) -> tuple[tuple[int, int], Ints]:
    """Rows and columns of a coarse map of any frame, `by` places a pixel, with camera motion removed.

    The second result is (T, 2) column and row of each one's corner in the scene.
    """
    h, w = stage.odds.shape[1:]
    film = stage.up @ np.array([[-0.5, w - 0.5, -0.5, w - 0.5], [-0.5, -0.5, h - 0.5, h - 0.5], [1.0] * 4])
    edges = (stage.places @ film)[:, :2] * by
    low, high = (np.floor(edges.min(2)) - 2.0).astype(np.intp), np.ceil(edges.max(2)) + 2.0
    width, height = (high - low).max(0).astype(int).tolist()
    return (height, width), low


def to_map(by: float, corner: Ints) -> Array:
    """(3, 3) map from the scene to such a map whose corner has this column and row (2,)."""
    left, top = corner.tolist()
    return np.array([[by, 0.0, -left], [0.0, by, -top], [0.0, 0.0, 1.0]])


def maps(stage: Stage, by: float, size: tuple[int, int], corners: Ints) -> Iterator[Planes]:
    """(h, w) coarse map of each frame's log odds in turn, with camera motion removed, as `extent` has it."""
    pixels = round(1.0 / (stage.up[0, 0] * by))
    for odds, place, corner in zip(stage.odds, stage.places, corners, strict=True):
        way = to_map(by, corner) @ place @ stage.up
        cut = cv2.warpAffine(blurred(odds, pixels), way[:2], size[::-1], borderValue=NOTHING)
        yield (cut.astype(np.float32) - NOTHING) / UNITS


def _silhouettes(shape: Shape, cycles: Cycles, facing: int) -> Planes:
    """(S, P, *GRID.shape) mean silhouettes of some phases for each size."""
    q = np.repeat(poses(shape.figure, cycles.usual.halves(0.0, EVERY)), len(SIZES), axis=0)
    q[..., shape.figure.index(SCALE)] = SIZES[:, None, None]
    body, _ = shape.painted(q.reshape(-1, q.shape[-1]), GRID)
    return np.asarray(body.reshape(*q.shape[:3], *GRID.shape).mean(1)[..., ::facing])


def _sums(maps: Iterable[Planes], size: tuple[int, int], silhouettes: Planes) -> Iterator[Planes]:
    """(S, h, w) of each map the best silhouette's sum with its hip at every place, for each size, nats."""
    S, P, h, w = silhouettes.shape
    kernels = Kernels.of(WEIGHT / DENSITY**2 * silhouettes.reshape(-1, h, w), HIP, size)
    for odds in maps:
        yield kernels.sums(odds).reshape(S, P, *size).max(1)
