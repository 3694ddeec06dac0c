"""The inner loop of the outline: log odds under a soft silhouette, and their derivatives as links move.

A bar placed by a pose is BAR numbers, leg lengths: x and y of the link's start; x and y of its direction;
where the bar's axis begins and ends along it; the half width at its beginning and how much wider it is a leg
length on; half the width of its soft edge. A place u along it and v across lies inside by

    s = h(w) - |(u - w, v)|,   w = u clipped to the axis,

and is covered to the degree m = SURE times a smooth step of s over the soft edge.

numba checks only this file before it takes an older compilation from its cache, so all that is compiled
together is here. Called functions are inlined: a separately compiled copy differs in the last bits, and would
be used in the process that compiles it but not in those that take it from the cache.
"""

import numpy as np

from kinematics.figure import Array
from tracker.compiled import compiled, part
from tracker.picture.pyramid import Planes

BAR = 9
SURE = 0.98  # degree deep within a bar; at 1 a link under another would have no influence

COMPILED = compiled(fastmath=True, error_model="numpy")
INLINED = part(fastmath=True, error_model="numpy", forceinline=True)


@COMPILED
def silhouettes(odds: Planes, arms: Planes, corner: Array, step: float, bars: Array, motion: Array) -> Array:
    """The log odds under the outlines of T frames, and their derivatives as each bar moves.

    With S = 1 - prod (1 - m) over the links' bars and A that of the arms' zone, the sum over places of
    R S + arms A (1 - S).

    Args:
        odds: (T, h, w) R on a grid of body coordinates, y up: row i lies at corner_y - i step.
        arms: (T, h, w) value of R where arms may be.
        corner: (2,) body coordinates of the grid's first place.
        step: distance from one place to the next, leg lengths.
        bars: (T, L + 1, BAR) of the links and, last, of the arms' zone.
        motion: (T, L + 1, 5) is overwritten: derivative by each motion of `kinematics.spm.motions`, per leg
            length, radian or log unit, in units of R times leg lengths squared.

    Returns:
        (T,) the sums, R times leg lengths squared.
    """
    T, h, w = odds.shape
    L = bars.shape[1] - 1
    total = np.zeros(T)
    clear, beside, pull = np.empty((h, w)), np.empty((h, w)), np.empty((h, w))
    for t in range(T):
        i0, i1, j0, j1 = _window(odds.shape[1:], corner, step, bars[t, L])
        for link in range(L):
            a0, a1, b0, b1 = _window(odds.shape[1:], corner, step, bars[t, link])
            i0, i1, j0, j1 = min(i0, a0), max(i1, a1), min(j0, b0), max(j1, b1)
        # Outside all bars there is nothing to sum.
        clear[i0:i1, j0:j1] = 1.0
        beside[i0:i1, j0:j1] = 1.0
        for link in range(L):
            _cover(clear, corner, step, bars[t, link])
        _cover(beside, corner, step, bars[t, L])
        for i in range(i0, i1):
            for j in range(j0, j1):
                arm = (1.0 - beside[i, j]) * arms[t, i, j]
                total[t] += odds[t, i, j] - clear[i, j] * (odds[t, i, j] - arm)
                pull[i, j] = (odds[t, i, j] - arm) * clear[i, j]
                beside[i, j] = clear[i, j] * arms[t, i, j]
        motion[t] = 0.0
        for link in range(L):
            _move(pull, corner, step, bars[t, link], motion[t, link], True)
        _move(beside, corner, step, bars[t, L], motion[t, L], False)
        total[t] *= step * step
        for link in range(L + 1):
            for way in range(motion.shape[2]):
                motion[t, link, way] *= step * step
    return total


@COMPILED
def painted(shape: tuple[int, int], corner: Array, step: float, bars: Array) -> Planes:
    """(T, h, w) silhouettes of bars (T, L, BAR) on a grid as in `silhouettes`."""
    T, L, _ = bars.shape
    found = np.empty((T, shape[0], shape[1]), np.float32)
    clear = np.empty(shape)
    for t in range(T):
        clear[:] = 1.0
        for link in range(L):
            _cover(clear, corner, step, bars[t, link])
        for i in range(shape[0]):
            for j in range(shape[1]):
                found[t, i, j] = 1.0 - clear[i, j]
    return found


@INLINED
def _cover(clear: Array, corner: Array, step: float, bar: Array) -> None:
    """Multiply `clear` (h, w) by 1 - m of one bar."""
    i0, i1, j0, j1 = _window(clear.shape, corner, step, bar)
    for i in range(i0, i1):
        # Within a row, indexed from 0, the processor handles several places at a time.
        row, left = clear[i, j0:j1], corner[0] + j0 * step
        for k in range(len(row)):
            _, _, _, _, edge = _within(left + np.int32(k) * step, corner[1] - i * step, bar)
            edge = min(max(edge, -1.0), 1.0)
            row[k] *= 1.0 - SURE * (0.5 + 0.25 * edge * (3.0 - edge * edge))


@INLINED
def _move(pull: Array, corner: Array, step: float, bar: Array, motion: Array, shared: bool) -> None:
    """Add the derivatives by the motions of one bar to `motion` (5,).

    The motions are along the link, across it, length (log), turn, size (log); `pull` (h, w) is the derivative
    of the sum by m, times 1 - m if `shared`.
    """
    i0, i1, j0, j1 = _window(pull.shape, corner, step, bar)
    slope, soft = bar[7], bar[8]
    along, across, longer, turned, larger = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(i0, i1):
        row, left = pull[i, j0:j1], corner[0] + j0 * step
        for k in range(len(row)):
            u, v, nearest, far, edge = _within(left + np.int32(k) * step, corner[1] - i * step, bar)
            over = u - nearest
            edge = min(max(edge, -1.0), 1.0)
            weight = row[k] * SURE * 0.75 * (1.0 - edge * edge) / soft
            if shared:
                weight /= 1.0 - SURE * (0.5 + 0.25 * edge * (3.0 - edge * edge))
            far = max(far, 1e-9)
            # The derivatives are of s at a fixed place, while the bar moves.
            by_u = slope if over == 0.0 else -over / far
            by_v = -v / far
            along -= weight * by_u
            across -= weight * by_v
            # With the length the ends of the axis move by their share, and the taper becomes flatter.
            longer += weight * (-slope * u if over == 0.0 else nearest * over / far)
            turned -= weight * (u * by_v - v * by_u)
            # The soft edge grows with the size too, so s over its width changes as if the place came nearer.
            larger -= weight * (u * by_u + v * by_v)
    for way, change in enumerate((along, across, longer, turned, larger)):
        motion[way] += change


@part(fastmath=True, error_model="numpy", inline="always")
def _within(x: float, y: float, bar: Array) -> tuple[float, float, float, float, float]:
    """A place in a bar's coordinates: u, v, w, its distance from the axis, and s over the soft edge."""
    start_x, start_y, along_x, along_y, first, last, half, slope, soft = bar
    x, y = x - start_x, y - start_y
    u, v = x * along_x + y * along_y, y * along_x - x * along_y
    nearest = min(max(u, first), last)
    far = np.sqrt((u - nearest) ** 2 + v * v)
    return u, v, nearest, far, (half + slope * (nearest - first) - far) / soft


@INLINED
def _window(shape: tuple[int, int], corner: Array, step: float, bar: Array) -> tuple[int, int, int, int]:
    """Rows i0 .. i1 - 1 and columns j0 .. j1 - 1 that a bar may touch."""
    start_x, start_y, along_x, along_y, first, last, half, slope, soft = bar
    reach = max(half, half + slope * (last - first)) + soft
    ax, ay = start_x + first * along_x, start_y + first * along_y
    bx, by = start_x + last * along_x, start_y + last * along_y
    j0 = int(np.floor((min(ax, bx) - reach - corner[0]) / step))
    j1 = int(np.ceil((max(ax, bx) + reach - corner[0]) / step)) + 1
    i0 = int(np.floor((corner[1] - max(ay, by) - reach) / step))
    i1 = int(np.ceil((corner[1] - min(ay, by) + reach) / step)) + 1
    return (*_clipped(i0, i1, 0, shape[0]), *_clipped(j0, j1, 0, shape[1]))


@part()
def _clipped(begin: int, end: int, least: int, most: int) -> tuple[int, int]:
    """The part of begin .. end - 1 within least .. most - 1; two equal ends if it is empty."""
    begin = min(max(begin, least), most)
    return begin, max(min(end, most), begin)
