"""The inner loop of the outline: log odds under a soft silhouette, and how they change as links move.

numba checks this file alone before it takes an older compilation from its cache, so all that is compiled
together stands here.
"""

import numba
import numpy as np

from kinematics.figure import Array
from tracker.picture.pyramid import Planes

SOFT = 0.04  # half width of an outline's edge, leg lengths
SURE = 0.98  # of a point deep within a link, or a link under another would be felt no more


@numba.njit(cache=True, fastmath=True, error_model="numpy")
def silhouettes(
    odds: Planes,
    arms: Planes,
    corner: Array,
    step: float,
    start: Array,
    direction: Array,
    length: Array,
    size: Array,
    bars: Array,
    zone: Array,
    trunk: int,
    motion: Array,
) -> Array:
    """Of T frames, the log odds under the outline and how they change as each link moves.

    Args:
        odds: (T, h, w) R on a grid of body coordinates, y up: row i lies at corner_y - i step.
        arms: (T, h, w) what R is worth where arms may be.
        corner: (T, 2) body coordinates of the grid's first place.
        step: leg lengths from one place to the next.
        start, direction, length, size: (T, L, 2), (T, L, 2), (T, L), (T,) of `kinematics.spm.Skeleton`.
        bars: (L, 4) first, last, start, tip of `tracker.outline.shape.Bar`.
        zone: (4,) the same of the arms' zone, on the link `trunk`.
        motion: (T, L, 5) is overwritten: change with each motion of `kinematics.spm.motions`, per leg length,
            radian or log unit, in units of R times leg lengths squared.

    Returns:
        (T,) sums of R times the silhouette, plus what the arms' zone is worth beside it, leg lengths squared.
    """
    T, h, w = odds.shape
    L = len(bars)
    total = np.zeros(T)
    clear = np.empty((h, w))  # product of 1 - m
    pull = np.empty((h, w))
    area = step * step
    for t in range(T):
        clear[:] = 1.0
        for link in range(L):
            _cover(clear, corner[t], step, start[t, link], direction[t, link], length[t, link], size[t], bars[link])
        # d total / d S = R - A arms, d total / d A = (1 - S) arms; A first, as an extra layer.
        pull[:] = 1.0
        _cover(
            pull, corner[t], step, start[t, trunk], direction[t, trunk], length[t, trunk], size[t], zone
        )
        score = 0.0
        for i in range(h):
            for j in range(w):
                score += (1.0 - clear[i, j]) * odds[t, i, j] + clear[i, j] * (1.0 - pull[i, j]) * arms[t, i, j]
        total[t] = score * area
        motion[t] = 0.0
        for i in range(h):
            for j in range(w):
                pull[i, j] = area * (odds[t, i, j] - (1.0 - pull[i, j]) * arms[t, i, j]) * clear[i, j]
        for link in range(L):
            _move(
                pull,
                corner[t],
                step,
                start[t, link],
                direction[t, link],
                length[t, link],
                size[t],
                bars[link],
                motion[t, link],
                True,
            )
        for i in range(h):
            for j in range(w):
                pull[i, j] = area * clear[i, j] * arms[t, i, j]
        _move(
            pull,
            corner[t],
            step,
            start[t, trunk],
            direction[t, trunk],
            length[t, trunk],
            size[t],
            zone,
            motion[t, trunk],
            False,
        )
    return total


@numba.njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def _window(corner, step, start, direction, length, size, bar, h, w):  # type: ignore[no-untyped-def]
    """Rows i0 .. i1 - 1 and columns j0 .. j1 - 1 that a bar may touch."""
    reach = size * (max(bar[2], bar[3]) + SOFT)
    ax = start[0] + bar[0] * length * direction[0]
    ay = start[1] + bar[0] * length * direction[1]
    bx = start[0] + bar[1] * length * direction[0]
    by = start[1] + bar[1] * length * direction[1]
    j0 = max(int(np.floor((min(ax, bx) - reach - corner[0]) / step)), 0)
    j1 = min(int(np.ceil((max(ax, bx) + reach - corner[0]) / step)) + 1, w)
    i0 = max(int(np.floor((corner[1] - max(ay, by) - reach) / step)), 0)
    i1 = min(int(np.ceil((corner[1] - min(ay, by) + reach) / step)) + 1, h)
    return i0, i1, j0, j1


@numba.njit(cache=True, fastmath=True, error_model="numpy")
def _cover(clear, corner, step, start, direction, length, size, bar):  # type: ignore[no-untyped-def]
    """Multiply `clear` by 1 - m of one bar."""
    h, w = clear.shape
    i0, i1, j0, j1 = _window(corner, step, start, direction, length, size, bar, h, w)
    first, last = bar[0] * length, bar[1] * length
    slope = size * (bar[3] - bar[2]) / (last - first)
    for i in range(i0, i1):
        y = corner[1] - i * step - start[1]
        for j in range(j0, j1):
            x = corner[0] + j * step - start[0]
            u = x * direction[0] + y * direction[1]
            v = y * direction[0] - x * direction[1]
            along = min(max(u, first), last)
            over = u - along
            inside = size * bar[2] + slope * (along - first) - np.sqrt(over * over + v * v)
            edge = inside / (size * SOFT)
            if edge > -1.0:
                if edge < 1.0:
                    m = SURE * (0.5 + 0.25 * edge * (3.0 - edge * edge))
                else:
                    m = SURE
                clear[i, j] *= 1.0 - m


@numba.njit(cache=True, fastmath=True, error_model="numpy")
def _move(pull, corner, step, start, direction, length, size, bar, motion, shared):  # type: ignore[no-untyped-def]
    """Add to `motion` (5,) what the motions of one bar change: slide, cross, lengthen (log), turn, grow (log).

    Args:
        pull: (h, w) what a unit of 1 - prod (1 - m), or of m itself, is worth, times prod (1 - m) if shared.
    """
    h, w = pull.shape
    i0, i1, j0, j1 = _window(corner, step, start, direction, length, size, bar, h, w)
    first, last = bar[0] * length, bar[1] * length
    slope = size * (bar[3] - bar[2]) / (last - first)
    soft = size * SOFT
    for i in range(i0, i1):
        y = corner[1] - i * step - start[1]
        for j in range(j0, j1):
            x = corner[0] + j * step - start[0]
            u = x * direction[0] + y * direction[1]
            v = y * direction[0] - x * direction[1]
            along = min(max(u, first), last)
            over = u - along
            far = np.sqrt(over * over + v * v)
            edge = (size * bar[2] + slope * (along - first) - far) / soft
            if -1.0 < edge < 1.0:
                m = SURE * (0.5 + 0.25 * edge * (3.0 - edge * edge))
                weight = pull[i, j] * SURE * 0.75 * (1.0 - edge * edge) / soft
                if shared:
                    weight /= 1.0 - m
                far = max(far, 1e-9)
                # d inside / d u and d v at a fixed place; the link's own motion moves the place against it.
                by_u = slope if first < u < last else -over / far
                by_v = -v / far
                motion[0] -= weight * by_u
                motion[1] -= weight * by_v
                motion[3] -= weight * (u * by_v - v * by_u)
                # Lengthened by dl, the axis' ends move by their share of it and the taper stretches.
                if first < u < last:
                    motion[2] -= weight * slope * u
                elif u <= first:
                    motion[2] += weight * first * over / far
                else:
                    motion[2] += weight * last * over / far
                # Everything but the soft edge's own width keeps its proportion.
                motion[4] -= weight * (u * by_u + v * by_v)


@numba.njit(cache=True, fastmath=True, error_model="numpy")
def painted(
    shape: tuple[int, int],
    corner: Array,
    step: float,
    start: Array,
    direction: Array,
    length: Array,
    size: Array,
    bars: Array,
) -> Planes:
    """(T, h, w) silhouettes of T poses; arguments as of `silhouettes`."""
    T = len(start)
    found = np.empty((T, shape[0], shape[1]), np.float32)
    clear = np.empty(shape)
    for t in range(T):
        clear[:] = 1.0
        for link in range(len(bars)):
            _cover(clear, corner, step, start[t, link], direction[t, link], length[t, link], size[t], bars[link])
        found[t] = 1.0 - clear
    return found

