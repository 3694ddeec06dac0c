"""The inner loop of registration, compiled: templates laid on a picture, link by link.

For every pose and link it gathers what Gauss-Newton needs of the link's points in the link's own coordinates:
a point u along the link and v across it moves by a slide along or across, a stretch, a turn and a growth
(`kinematics.spm.motions`), so the gradient (g_u, g_v) of a channel there enters as

    f = [g_u, g_v, u g_u, u g_v - v g_u, u g_u + v g_v]

and sum w f f', sum w f r over the link's points are all that the chain rule needs.
"""

from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Pose = tuple[Array, Array, Array, float]  # start, direction (L, 2), length (L,), size
WAYS = 5  # in which a link moves as a whole


class Points(NamedTuple):
    """P template points, those of link l at first[l]:first[l + 1].

    first : (L + 1,); along, across, weight : (P,); colours : (P, 3); known : (P,)
    """

    first: NDArray[np.intp]
    along: Array
    across: Array
    weight: Array
    colours: Single
    known: NDArray[np.bool_]


class Shape(NamedTuple):
    """What of the links hides others: layer, width and taper (L,)."""

    layer: NDArray[np.intp]
    width: Array
    taper: Array


class Lens(NamedTuple):
    """Body coordinates to pixels of a level's planes: origin + axes * point."""

    origin_x: float
    origin_y: float
    axis_x: float
    axis_y: float


class Noise(NamedTuple):
    """variance of a channel; scale (squared, in its units) of the robust weight, inf for plain squares; mean
    match at which a link is out of sight and in full sight; how few points have no offset of light of their
    own; whether nearer links hide farther ones, and how far beyond their outline, leg lengths."""

    variance: float
    scale: float
    out_of_sight: float
    in_sight: float
    fewest: int
    layered: bool
    margin: float


class Laid(NamedTuple):
    """H poses laid on a picture.

    moments  : (H, L, 5, 5) sum of weight * match * f f'
    pull     : (H, L, 5) sum of weight * match * f residual
    mean     : (H,) mean over the visible points of half the robust squared residual, in units of the noise
    match    : (H, P) robust weight, 0 where not visible
    residual : (H, P, 3) grey levels, offsets of light taken off, 0 where not visible
    offset   : (H, L, 3) grey levels
    inside   : (H, P) whether the point lies in the frame
    """

    moments: Array
    pull: Array
    mean: Array
    match: Array
    residual: Single
    offset: Array
    inside: NDArray[np.bool_]


def lay(
    planes: Single,
    lens: Lens,
    start: Array,
    direction: Array,
    length: Array,
    size: Array,
    points: Points,
    shape: Shape,
    noise: Noise,
) -> Laid:
    """Lay the templates on one level at H poses: start, direction (H, L, 2), length (H, L), size (H,)."""
    (H, L), P = length.shape, len(points.along)
    laid = Laid(
        moments=np.zeros((H, L, WAYS, WAYS)),
        pull=np.zeros((H, L, WAYS)),
        mean=np.zeros(H),
        match=np.zeros((H, P)),
        residual=np.zeros((H, P, 3), np.float32),
        offset=np.zeros((H, L, 3)),
        inside=np.zeros((H, P), np.bool_),
    )
    # Plain tuples, and nothing returned: to take a named one or to give back an array compiled code runs
    # Python, where an interrupt crashes it.
    bones = start, direction, length, size
    _fill(planes, bones, tuple(lens), tuple(points), tuple(shape), tuple(noise), tuple(laid))
    return laid


@numba.njit(cache=True)
def _fill(
    planes: Single,
    bones: tuple[Array, Array, Array, Array],
    of_lens: tuple[Any, ...],
    of_points: tuple[Any, ...],
    of_shape: tuple[Any, ...],
    of_noise: tuple[Any, ...],
    laid: tuple[Any, ...],
) -> None:
    start, direction, length, size = bones
    lens, points, shape, noise = Lens(*of_lens), Points(*of_points), Shape(*of_shape), Noise(*of_noise)
    moments, pull, mean, match, residual, offset, inside = laid
    (H, L), P = length.shape, len(points.along)
    slope = np.empty((P, 3, 2), np.float32)
    heap = np.empty(P, np.float32)
    for h in range(H):
        total, count = 0.0, 0.0
        for i in range(L):
            first, end = points.first[i], points.first[i + 1]
            pose = start[h], direction[h], length[h], size[h]
            seen = _look(planes, lens, pose, points, shape, noise, i, slope, residual[h], match[h], inside[h])
            if noise.layered and seen >= noise.fewest:
                for c in range(3):
                    offset[h, i, c] = _take_off_median(residual[h], match[h], heap, first, end, c)
            weight, matched, rho = _doubt(points.weight, residual[h], match[h], noise, first, end)
            total += rho
            count += weight
            if noise.layered and weight > 0.0:
                fair = (matched / weight - noise.out_of_sight) / (noise.in_sight - noise.out_of_sight)
                match[h, first:end] *= min(max(fair, 0.0), 1.0)
            u, v = points.along * length[h, i], points.across * size[h]
            _gather(points.weight, u, v, residual[h], match[h], slope, first, end, moments[h, i], pull[h, i])
        mean[h] = total / max(count, 1e-9)


@numba.njit(cache=True)
def _look(
    planes: Single,
    lens: Lens,
    pose: Pose,
    points: Points,
    shape: Shape,
    noise: Noise,
    link: int,
    slope: Single,
    residual: Single,
    match: Array,
    inside: NDArray[np.bool_],
) -> int:
    """Residuals and slopes of one link's points; match is 1 where visible. Returns how many are."""
    start, direction, length, size = pose
    rows, columns = planes.shape[0], planes.shape[1]
    dx, dy = direction[link, 0], direction[link, 1]
    half_x, half_y = np.float32(0.5 * lens.axis_x), np.float32(0.5 * lens.axis_y)
    seen = 0
    for p in range(points.first[link], points.first[link + 1]):
        u, v = points.along[p] * length[link], size * points.across[p]
        body_x = start[link, 0] + u * dx - v * dy
        body_y = start[link, 1] + u * dy + v * dx
        x = lens.origin_x + lens.axis_x * body_x
        y = lens.origin_y + lens.axis_y * body_y
        inside[p] = 0 <= x <= columns - 1 and 0 <= y <= rows - 1
        if not inside[p] or not points.known[p]:
            continue
        if noise.layered and _hidden(body_x, body_y, pose, shape, link, noise.margin):
            continue
        match[p] = 1.0
        seen += 1
        # Beyond its edge a picture goes on as it ends.
        i, j = min(int(y), rows - 2), min(int(x), columns - 2)
        above, below = max(i - 1, 0), min(i + 2, rows - 1)
        before, after = max(j - 1, 0), min(j + 2, columns - 1)
        fx, fy = np.float32(x - j), np.float32(y - i)
        gx, gy = np.float32(1) - fx, np.float32(1) - fy
        for c in range(3):
            a, b = planes[i, j, c], planes[i, j + 1, c]
            d, e = planes[i + 1, j, c], planes[i + 1, j + 1, c]
            residual[p, c] = gy * (gx * a + fx * b) + fy * (gx * d + fx * e) - points.colours[p, c]
            # Central differences at the four neighbours, mixed as their values are.
            right = gy * (gx * (b - planes[i, before, c]) + fx * (planes[i, after, c] - a))
            right += fy * (gx * (e - planes[i + 1, before, c]) + fx * (planes[i + 1, after, c] - d))
            down = gx * (gy * (d - planes[above, j, c]) + fy * (planes[below, j, c] - a))
            down += fx * (gy * (e - planes[above, j + 1, c]) + fy * (planes[below, j + 1, c] - b))
            slope[p, c, 0] = right * half_x * dx + down * half_y * dy
            slope[p, c, 1] = down * half_y * dx - right * half_x * dy
    return seen


@numba.njit(cache=True)
def _hidden(x: float, y: float, pose: Pose, shape: Shape, link: int, margin: float) -> bool:
    """Whether a link nearer to the camera lies over a body point of this one."""
    start, direction, length, size = pose
    for j in range(len(length)):
        if shape.layer[j] <= shape.layer[link]:
            continue
        away_x, away_y = x - start[j, 0], y - start[j, 1]
        along = away_x * direction[j, 0] + away_y * direction[j, 1]
        if -margin < along < length[j] + margin:
            across = away_y * direction[j, 0] - away_x * direction[j, 1]
            taper = 1.0 + (shape.taper[j] - 1.0) * min(max(along / length[j], 0.0), 1.0)
            if abs(across) < 0.5 * size * shape.width[j] * taper + margin:
                return True
    return False


@numba.njit(cache=True)
def _take_off_median(residual: Single, match: Array, heap: Single, first: int, end: int, c: int) -> float:
    """One channel's residuals of the visible points less their median, which is returned."""
    n = 0
    for p in range(first, end):
        if match[p] > 0.0:
            heap[n] = residual[p, c]
            n += 1
    middle = _select(heap, n, n // 2)
    for p in range(first, end):
        if match[p] > 0.0:
            residual[p, c] -= middle
    return float(middle)


@numba.njit(cache=True)
def _select(values: Single, n: int, k: int) -> float:
    """The k-th smallest of the first n values, whose order is lost (Hoare 1961)."""
    low, high = 0, n - 1
    while low < high:
        pivot = values[k]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if j < k:
            low = i
        if k < i:
            high = j
    return float(values[k])


@numba.njit(cache=True)
def _doubt(
    weight: Array, residual: Single, match: Array, noise: Noise, first: int, end: int
) -> tuple[float, float, float]:
    """Robust weights into match; sums of weight, weight * match and weight * rho / 2."""
    sum_weight, sum_match, sum_rho = 0.0, 0.0, 0.0
    for p in range(first, end):
        if match[p] == 0.0:
            continue
        square = 0.0
        for c in range(3):
            square += residual[p, c] * residual[p, c]
        square /= 3.0 * noise.variance
        rho = square
        if noise.scale < np.inf:
            match[p] = 1.0 / (1.0 + square / noise.scale)
            rho = noise.scale * np.log1p(square / noise.scale)
        sum_weight += weight[p]
        sum_match += weight[p] * match[p]
        sum_rho += 0.5 * weight[p] * rho
    return sum_weight, sum_match, sum_rho


@numba.njit(cache=True)
def _gather(
    weight: Array,
    u: Array,
    v: Array,
    residual: Single,
    match: Array,
    slope: Single,
    first: int,
    end: int,
    moments: Array,
    pull: Array,
) -> None:
    """Sums of w f f' into moments (5, 5) and of w f r into pull (5,)."""
    f = np.empty(WAYS)
    for p in range(first, end):
        if match[p] == 0.0:
            continue
        w = weight[p] * match[p]
        for c in range(3):
            f[0], f[1] = slope[p, c, 0], slope[p, c, 1]
            f[2] = u[p] * f[0]
            f[3] = u[p] * f[1] - v[p] * f[0]
            f[4] = f[2] + v[p] * f[1]
            for i in range(WAYS):
                pull[i] += w * f[i] * residual[p, c]
                for j in range(i + 1):
                    moments[i, j] += w * f[i] * f[j]
    for i in range(WAYS):
        for j in range(i):
            moments[j, i] = moments[i, j]
