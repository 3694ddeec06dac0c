"""Best paths through places and sizes, and through phases and phase speeds (Viterbi 1967).

Every possible step is tried in turn for all values at once, which are contiguous, so that a processor handles
several at a time. `tracker.outline.rasters` says why all compiled code is in one file.
"""

from collections.abc import Iterable
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from kinematics.figure import Array, Ints
from tracker.compiled import compiled, part
from tracker.picture.pyramid import Planes

Steps = NDArray[np.uint8] | NDArray[np.uint16]
WAYS = 3  # one size down, none, one up


def best_path(scores: Iterable[Planes], corners: Ints, step: float, resize: float, reach: int) -> Ints:
    """The path over the scene of the largest sum of `scores`, less the costs of its steps.

    What lies beyond the edge of a frame's scores counts as the place at the edge. Of a frame only a byte for
    each place and size is kept, up to a reach of 5.

    Args:
        scores: (S, h, w) nats, of each frame in turn.
        corners: (T, 2) first column and row of each frame's scores in the scene.
        step: cost of a step of one column, nats; it grows with the square. A row counts as two columns.
        resize: cost of one size up or down, nats.
        reach: longest step in columns; in rows half of it.

    Returns:
        (T, 3) size, row and column in each frame's scores.
    """
    frames = iter(scores)
    first = next(frames)
    _, h, w = first.shape
    across, columns = reach // 2, 2 * reach + 1
    moves = np.diff(corners, axis=0, prepend=corners[:1])
    numbers = np.min_scalar_type(WAYS * columns * (2 * across + 1) - 1)
    before = np.empty((len(corners), *first.shape), numbers)
    value = np.zeros(first.shape)
    for score, (right, down), kept in zip(chain([first], frames), moves, before, strict=True):
        if right or down:
            rows, places = np.clip(np.arange(h) + down, 0, h - 1), np.clip(np.arange(w) + right, 0, w - 1)
            value = value.take(rows, 1).take(places, 2)
        value = _onward(value, score, kept, step, resize, reach)
    path = np.empty((len(corners), 3), np.intp)
    s, y, x = map(int, np.unravel_index(value.argmax(), value.shape))
    for t in range(len(corners) - 1, -1, -1):
        path[t] = s, y, x
        back, (right, down) = int(before[t, s, y, x]), moves[t]
        s += back % WAYS - 1
        x = min(max(x + back // WAYS % columns - reach + right, 0), w - 1)
        y = min(max(y + back // (WAYS * columns) - across + down, 0), h - 1)
    return path


@compiled()
def _onward(value: Array, score: Planes, before: Steps, step: float, resize: float, reach: int) -> Array:
    """The values (S, h, w) a frame later; `before` gets the best step's number: size, columns and rows."""
    S, h, w = score.shape
    across, columns = reach // 2, 2 * reach + 1
    W = w + reach
    N = h * W
    # The rows of a map are concatenated, with impossible values between them and at both ends.
    wide = np.full((S, h, W), -np.inf)
    wide[:, :, :w] = value
    last = wide.reshape(S, N)
    start = np.zeros(N, np.int32)
    sized, resized = np.full(N + 2 * reach, -np.inf), np.zeros(N + 2 * reach, np.int32)
    moved, column = np.full(N + 2 * across * W, -np.inf), np.zeros(N + 2 * across * W, np.int32)
    inner, inside = slice(reach, reach + N), slice(across * W, across * W + N)
    now, number = np.full((S, N), -np.inf), np.zeros(N, np.int32)
    for s in range(S):
        sized[inner] = -np.inf
        for other in range(max(s - 1, 0), min(s + 2, S)):
            cost = resize * abs(other - s)
            _carry(sized[inner], resized[inner], last[other], start, cost, other - s + 1)
        moved[inside] = -np.inf
        for far in range(-reach, reach + 1):
            there = slice(reach + far, reach + far + N)
            steps = WAYS * (far + reach)
            _carry(moved[inside], column[inside], sized[there], resized[there], step * far**2, steps)
        for far in range(-across, across + 1):
            there = slice((across + far) * W, (across + far) * W + N)
            steps = WAYS * columns * (far + across)
            _carry(now[s], number, moved[there], column[there], 4.0 * step * far**2, steps)
        before[s] = number.reshape(h, W)[:, :w]
    return now.reshape(S, h, W)[:, :, :w] + score


@compiled()
def best_phases(score: Array, speeds: Array, change: float, slip: float) -> tuple[float, Ints]:
    """The path of the largest sum of `score`, less the costs of its steps.

    A step is the speed after it, rounded, or one more or less.

    Args:
        score: (T, P) nats of every phase; phases are cyclic.
        speeds: (S,) phases a frame.
        change: cost of the next speed up or down, nats.
        slip: standard deviation of a step about its speed, phases.

    Returns:
        The sum, and (T, 2) speed and phase.
    """
    T, P = score.shape
    S = len(speeds)
    value = np.zeros((S, P)) + score[0]
    before = np.empty((T, S, P), np.int32)  # speed and phase, as one number
    twice, phase = np.empty(2 * P), (np.arange(2 * P) % P).astype(np.int32)
    for t in range(1, T):
        now = np.full((S, P), -np.inf)
        for other in range(S):
            twice[:P] = twice[P:] = value[other]
            for s in range(max(other - 1, 0), min(other + 2, S)):
                for off in range(-1, 2):
                    step = int(np.rint(speeds[s])) + off
                    cost = 0.5 * ((speeds[s] - step) / slip) ** 2 + (change if other != s else 0.0)
                    here = slice(-step % P, -step % P + P)
                    _carry(now[s], before[t, s], twice[here], phase[here], cost, other * P)
        value = now + score[t]
    path = np.empty((T, 2), np.intp)
    place = value.argmax()
    for t in range(T - 1, -1, -1):
        path[t, 0], path[t, 1] = place // P, place % P
        place = before[t, path[t, 0], path[t, 1]]
    return value.max(), path


@part()
def _carry(
    value: Array, number: NDArray[np.int32], old: Array, old_number: NDArray[np.int32], cost: float, add: int
) -> None:
    """Where an old value less the cost is better, take it, and its number plus `add`."""
    more = np.int32(add)
    for i in range(len(value)):
        found = old[i] - cost
        better = found > value[i]
        value[i] = found if better else value[i]
        number[i] = old_number[i] + more if better else number[i]
