"""The phase and the gait cycle that every frame of a film shows: the best path over phase and phase speed.

Silhouettes of the half cycles at several small shifts are compared with the log odds around the hip, as one
matrix product a frame. With the legs' names exchanged a pose has the same silhouette, so the other half cycle
looks the same; only the marked pose distinguishes the two. Viterbi runs through every cycle separately,
forwards in time and, for walking backwards, also in reverse; the best of all is taken.
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from kinematics.figure import Array
from tracker.outline.cycles import COUNTED, NECK, PHASES, Cycles, at_phases, poses
from tracker.outline.shape import Grid, Shape, arms_worth
from tracker.outline.stage import WEIGHT, Stage
from tracker.outline.viterbi import best_phases

DENSITY = 16.0  # places in a leg length
GRID = Grid((-1.25, 1.1875), DENSITY, (38, 41))
COLUMNS_OFF = np.arange(-4, 5, 2)  # shifts of the hip that are tried, places
ROWS_OFF = np.arange(-3, 4)
SPREAD = (0.12, 0.08)  # standard deviation of the shift along and up, leg lengths
LEANS = np.radians([0.0, 30.0])  # leans that are tried, beyond the cycle's own
LEANING = float(np.radians(15.0))  # standard deviation of a lean beyond the cycle's own
FASTEST, SLOWEST = 0.37, 2.5  # range of stride times, seconds of film
SPEEDS = 16  # phase speeds in this range; in slow motion, which goes on beyond it, more
LONG = 2.5  # longest stride of most people, leg lengths; who goes less far in the slowest is in slow motion,
SLOW_MOTION = 8.0  # with stride times up to this, seconds of film
FINE = 3  # steps from one phase to the next, at 30 frames a second
RARE = 0.3  # cost of a rare kind of stride, nats a frame
CHANGE = 1.5  # cost of a change to the next phase speed, nats
TRAVEL = 1.0  # least travel over the scene that shows how fast somebody walks, and which way, leg lengths
SLIP = 1.0  # standard deviation of a step in phase about the phase speed, fine steps
DIFFERS = float(np.radians(12.0))  # scale of the Student t of marked angles about a cycle's
FREEDOM = 4.0  # its degrees of freedom; few, as people who start or stop are in no phase of a cycle


@dataclass(frozen=True)
class Phases:
    """The gait cycle and phase of every frame.

    cycle  : kind of stride
    way    : +1, or -1 for a stride that runs backwards in time
    phase  : (T,) 0 to PHASES
    shift  : (T, 2) of the hip, ahead and up, leg lengths
    lean   : (T,) of the trunk, forward beyond the cycle's, radians
    """

    cycle: int
    way: int
    phase: Array
    shift: Array
    lean: Array


def phases(
    stage: Stage, shape: Shape, cycles: Cycles, hips: Array, units: Array, marked: Array, frame: int
) -> Phases:
    """The best phase of the best cycle for every frame.

    Args:
        hips, units: as in `Stage.around`.
        marked: (8,) angles of COLUMNS in the marked pose; NaN for unknown ones.
        frame: the marked frame.
    """
    score, shift, lean = _compared(stage, shape, cycles, hips, units, float(np.nan_to_num(marked[NECK])))
    named = likeness(np.nan_to_num(cycles.pose - marked))
    fine = max(FINE, int(np.ceil(FINE * stage.rate)))
    travel = stage.facing * stage.travel(hips, units)
    ways = (1, -1) if abs(travel) < TRAVEL else (1,) if travel > 0.0 else (-1,)
    periods = _periods(travel, len(stage) / stage.fps) * stage.fps
    found = []
    for cycle in range(len(cycles.pose)):
        whole = np.tile(score[:, cycle], 2)
        whole[frame] += stage.often * named[cycle]
        finer = np.ascontiguousarray(at_phases(whole.T, np.arange(PHASES * fine) / fine).T)
        for way in ways:
            value, path = best_phases(finer, way * PHASES * fine / periods, CHANGE, SLIP)
            found.append((value - len(stage) * RARE * float(cycles.rare[cycle]), cycle, way, path))
    _, cycle, way, path = max(found, key=lambda each: each[0])
    phase = path[:, 1] / fine
    half = np.rint(phase).astype(int) % (PHASES // 2)
    here = np.arange(len(stage)), cycle, half
    return Phases(cycle, way, phase, shift[here], lean[here])


def likeness(off: Array) -> Array:
    """(...) log likelihood of marked angles that are (..., 8) radians off a cycle's, nats."""
    square = (off[..., COUNTED] ** 2).sum(-1)
    return np.asarray(-0.5 * (FREEDOM + len(COUNTED)) * np.log1p(square / (FREEDOM * DIFFERS**2)))


def _periods(travel: float, seconds: float) -> Array:
    """(S,) possible stride times of who travels so many leg lengths in a time, seconds."""
    usual = np.geomspace(FASTEST, SLOWEST, SPEEDS)
    if abs(travel) < TRAVEL:
        return usual
    longest = min(LONG * seconds / abs(travel), SLOW_MOTION)
    slower = SLOWEST * (usual[1] / usual[0]) ** np.arange(1, SPEEDS)
    return np.concatenate([usual, slower[slower <= longest]])


def _compared(
    stage: Stage, shape: Shape, cycles: Cycles, hips: Array, units: Array, neck: float
) -> tuple[Array, Array, Array]:
    """(T, C, PHASES / 2) score of each half cycle's silhouettes, nats; the best shift (.., 2) and lean."""
    q = poses(shape.figure, cycles.halves(neck, leans=LEANS))
    body, arms = shape.painted(q.reshape(-1, q.shape[-1]), GRID)
    masks = np.stack([body, arms], axis=1).reshape(len(body), -1)
    used = np.flatnonzero(masks.any(0))
    masks = np.ascontiguousarray(masks[:, used])
    layer, row, column = np.unravel_index(used, (2, *GRID.shape))
    (h, w), edge = GRID.shape, (int(COLUMNS_OFF.max()), int(ROWS_OFF.max()))
    corner = GRID.corner[0] - edge[0] / DENSITY, GRID.corner[1] + edge[1] / DENSITY
    around = Grid(corner, DENSITY, (h + 2 * edge[1], w + 2 * edge[0]))
    wide = stage.around(hips, units, around)
    shifts = np.array([(x, -y) for y in ROWS_OFF for x in COLUMNS_OFF]) / DENSITY
    rare = 0.5 * ((shifts / SPREAD) ** 2).sum(1)
    score = np.empty((len(stage), len(masks)))
    shift = np.empty((len(stage), len(masks), 2))
    for t, odds in enumerate(wide):
        windows = sliding_window_view(np.stack([odds, arms_worth(odds)]), GRID.shape, axis=(1, 2))
        seen = windows[layer, :, ::2, row, column].reshape(len(used), -1)  # every other shift, as COLUMNS_OFF
        sums = masks @ seen * (WEIGHT / DENSITY**2) - rare
        best = sums.argmax(1)
        score[t], shift[t] = sums[np.arange(len(sums)), best], shifts[best]
    kinds = len(stage), *q.shape[:3]
    score = score.reshape(kinds) - 0.5 * ((LEANS / LEANING) ** 2)[:, None, None]
    leans = score.argmax(1)
    shift = np.take_along_axis(shift.reshape(*kinds, 2), leans[:, None, :, :, None], axis=1)[:, 0]
    return score.max(1), shift, LEANS[leans]
