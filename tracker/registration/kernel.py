"""The inner loop of registration, compiled: templates compared with a picture, link by link.

For every pose and link it sums the Gauss-Newton terms of the link's points in the link's own coordinates:
a point u along the link and v across it moves by a slide along or across, a stretch, a turn and a growth
(`kinematics.spm.motions`), so the gradient (g_u, g_v) of a channel there enters as

    f = [g_u, g_v, u g_u, u g_v - v g_u, u g_u + v g_v]

and the chain rule needs only sum w f f' and sum w f r over the link's points.
"""

from typing import Any

import numpy as np

from dynamics.gaussian import Array, Flags, Ints
from kinematics.figure import Layout
from kinematics.spm import Skeleton
from tracker.compiled import compiled, part
from tracker.registration.records import Laid, Noise, Picture, Points, Row, Single

Pose = tuple[Array, Array, Array, float]  # start, direction (L, 2), length (L,), size
WAYS = 5  # motions of a link as a whole
TOGETHER = 16  # robust weights, each above 1e-19, whose product stays above 1e-308

# All in one file: numba's cache does not notice changes in other files.
COMPILED = compiled(error_model="numpy", fastmath={"contract"})
PART = part(error_model="numpy", fastmath={"contract"})
# Sums may be reordered, so that a processor adds several points at a time.
ANY_ORDER = part(error_model="numpy", fastmath={"reassoc", "contract", "nsz", "arcp", "nnan"})


def room(links: tuple[int, ...], P: int) -> Laid:
    """Empty results for H poses of L links (H, L) and P points."""
    H, L = links
    return Laid(
        moments=np.empty((H, L, WAYS, WAYS)),
        pull=np.empty((H, L, WAYS)),
        cost=np.empty(H),
        bare=np.zeros((H, L)),
        mean=np.empty(H),
        shown=np.empty(H),
        match=np.empty((H, P)),
        offset=np.empty((H, L, 3)),
        inside=np.empty((H, P), np.bool_),
    )


def lay(
    picture: Picture, bones: Skeleton, points: Points, tree: Layout, noise: Noise, rows: Ints, laid: Laid
) -> None:
    """Compare the templates with one level at some of H poses, and fill these rows of `laid`."""
    # Plain tuples as arguments and no results: for named tuples and returned arrays compiled code calls
    # Python, where an interrupt crashes it.
    _fill(tuple(picture), tuple(bones), tuple(points), tuple(tree), tuple(noise), rows, tuple(laid))


@COMPILED
def _fill(
    of_picture: tuple[Any, ...],
    bones: tuple[Any, ...],
    of_points: tuple[Any, ...],
    of_tree: tuple[Any, ...],
    of_noise: tuple[Any, ...],
    rows: Ints,
    of_laid: tuple[Any, ...],
) -> None:
    start, direction, length, size = bones
    picture, points, tree = Picture(*of_picture), Points(*of_points), Layout(*of_tree)
    noise, laid = Noise(*of_noise), Laid(*of_laid)
    L = length.shape[1]
    within, most = 0.0, points.first[L] - points.first[L - 1]
    for p in range(len(points.known)):
        within += 1.0 if points.known[p] and points.weight[p] == 1.0 else 0.0
    for i in range(L - 1):
        most = max(most, points.first[i + 1] - points.first[i])
    row = _empty_row(most)
    for h in rows:
        laid.moments[h], laid.pull[h], laid.offset[h], laid.match[h], laid.cost[h] = 0.0, 0.0, 0.0, 0.0, 0.0
        total, count, clear = 0.0, 0.0, 0.0
        pose = start[h], direction[h], length[h], size[h]
        for i in range(L):
            n = _look(picture, pose, points, tree, noise, i, row, laid.inside[h])
            if noise.layered and n >= noise.fewest:
                for c in range(3):
                    low, high = points.light[c] - noise.light, points.light[c] + noise.light
                    laid.offset[h, i, c] = _take_off(row.residual[c, :n], low, high)
            elif noise.layered:
                for c in range(3):
                    laid.offset[h, i, c] = points.light[c]
                    row.residual[c, :n] -= np.float32(points.light[c])
            weight, loss = _doubt(row, n, noise)
            if noise.covered > 0.0:
                loss -= _uncover(row, n, noise)
            total += loss
            count += weight
            fair = 1.0
            if noise.layered and weight > 0.0:
                mean, fair = _faded(loss / weight, noise)
                loss = weight * mean
            laid.cost[h] += loss
            laid.bare[h, i] = _bare(row, n, noise)
            for k in range(n):
                laid.cost[h] -= row.place[2, k] * row.differs[k]
                clear += row.clear[k]
                laid.match[h, row.point[k]] = fair * row.match[k]
            if fair > 0.0:
                _gather(row, n, fair, laid.moments[h, i], laid.pull[h, i])
        laid.mean[h], laid.shown[h] = total / max(count, 1e-9), clear / max(within, 1e-9)


@PART
def _faded(loss: float, noise: Noise) -> tuple[float, float]:
    """Cost of a link from the mean loss of its points, and the derivative.

    A link that matches too badly counts as out of sight: matching worse costs no more.
    """
    full, none = noise.in_sight, noise.out_of_sight
    if loss <= full:
        return loss, 1.0
    left = max(none - loss, 0.0)
    return 0.5 * (full + none) - 0.5 * left * left / (none - full), left / (none - full)


@PART
def _bare(row: Row, n: int, noise: Noise) -> float:
    """How much better the scene explains a link than the template does where the scene is shown: the mean
    over its inner points, in units of rho / 2."""
    inner, better = 0.0, 0.0
    for k in range(n):
        if row.place[2, k] == 1.0:
            inner += 1.0
            if row.differs[k] < noise.alike:
                better += 0.5 * noise.scale * np.log1p(row.excess[k]) - row.differs[k]
    return better / max(inner, 1.0)


@PART
def _empty_row(most: int) -> Row:
    """Empty row for at most so many points of one link."""
    return Row(
        np.empty(most, np.intp),
        np.empty((3, most)),
        np.empty((3, most), np.float32),
        np.empty((3, most), np.float32),
        np.empty((3, most), np.float32),
        np.empty(most),
        np.empty(most),
        np.empty(most),
        np.empty(most),
        np.empty(most),
    )


@PART
def _look(
    picture: Picture,
    pose: Pose,
    points: Points,
    tree: Layout,
    noise: Noise,
    link: int,
    row: Row,
    inside: Flags,
) -> int:
    """Write the comparison at one link's visible points into the row; returns their number."""
    planes = picture.planes
    start, direction, length, size = pose
    rows, columns = planes.shape[0], planes.shape[1]
    ox, oy, ax, ay = picture.origin_x, picture.origin_y, picture.axis_x, picture.axis_y
    sx, sy, dx, dy = start[link, 0], start[link, 1], direction[link, 0], direction[link, 1]
    long = length[link]
    xu, yu = np.float32(0.5 * ax * dx), np.float32(0.5 * ay * dy)
    xv, yv = np.float32(-0.5 * ax * dy), np.float32(0.5 * ay * dx)
    first, end = points.first[link], points.first[link + 1]
    nearer = np.empty(len(length), np.intp)
    number = _may_hide(pose, points, tree, link, noise.margin, nearer) if noise.layered else 0
    n = 0
    for p in range(first, end):
        u, v = points.along[p] * long, size * points.across[p]
        body_x = sx + u * dx - v * dy
        body_y = sy + u * dy + v * dx
        x = ox + ax * body_x
        y = oy + ay * body_y
        inside[p] = 0 <= x <= columns - 1 and 0 <= y <= rows - 1
        if not inside[p] or not points.known[p]:
            continue
        if _hidden(body_x, body_y, pose, tree, nearer[:number], noise.margin):
            continue
        w = points.weight[p]
        row.around[n], row.differs[n], row.clear[n] = np.inf, picture.unknown, 0.0
        if w == 1.0:
            r = int(y * picture.pixel + picture.corner_y + 0.5) // picture.step
            s = int(x * picture.pixel + picture.corner_x + 0.5) // picture.step
            row.differs[n], row.clear[n] = picture.differs[r, s], 1.0
            if picture.around[r, s] < picture.unknown:
                row.around[n] = picture.around[r, s]
        # Beyond its edge a picture is continued by its border.
        i, j = min(int(y), rows - 2), min(int(x), columns - 2)
        above, below = max(i - 1, 0), min(i + 2, rows - 1)
        before, after = max(j - 1, 0), min(j + 2, columns - 1)
        fx, fy = np.float32(x - j), np.float32(y - i)
        gx, gy = np.float32(1) - fx, np.float32(1) - fy
        row.point[n] = p
        row.place[0, n], row.place[1, n], row.place[2, n] = u, v, w
        for c in range(3):
            a, b = planes[i, j, c], planes[i, j + 1, c]
            d, e = planes[i + 1, j, c], planes[i + 1, j + 1, c]
            row.residual[c, n] = gy * (gx * a + fx * b) + fy * (gx * d + fx * e) - points.colours[p, c]
            # Central differences at the four neighbours, interpolated like their values.
            right = gy * (gx * (b - planes[i, before, c]) + fx * (planes[i, after, c] - a))
            right += fy * (gx * (e - planes[i + 1, before, c]) + fx * (planes[i + 1, after, c] - d))
            down = gx * (gy * (d - planes[above, j, c]) + fy * (planes[below, j, c] - a))
            down += fx * (gy * (e - planes[above, j + 1, c]) + fy * (planes[below, j + 1, c] - b))
            row.along[c, n] = right * xu + down * yu
            row.across[c, n] = right * xv + down * yv
        n += 1
    return n


@PART
def _may_hide(pose: Pose, points: Points, tree: Layout, link: int, margin: float, found: Ints) -> int:
    """Write the n nearer links that reach into a circle around a link's points into `found`; returns n."""
    start, direction, length, size = pose
    least, most, wide = 0.0, 0.0, 0.0
    for p in range(points.first[link], points.first[link + 1]):
        least, most = min(least, points.along[p]), max(most, points.along[p])
        wide = max(wide, abs(points.across[p]))
    middle = 0.5 * (least + most) * length[link]
    radius = np.hypot(0.5 * (most - least) * length[link], size * wide)
    x = start[link, 0] + middle * direction[link, 0]
    y = start[link, 1] + middle * direction[link, 1]
    n = 0
    for j in range(len(length)):
        if tree.layer[j] > tree.layer[link]:
            away_x, away_y = x - start[j, 0], y - start[j, 1]
            along = away_x * direction[j, 0] + away_y * direction[j, 1]
            across = away_y * direction[j, 0] - away_x * direction[j, 1]
            near = radius + margin
            half = 0.5 * size * tree.width[j] * max(1.0, tree.taper[j])
            if -near < along < length[j] + near and abs(across) < half + near:
                found[n] = j
                n += 1
    return n


@PART
def _hidden(x: float, y: float, pose: Pose, tree: Layout, nearer: Ints, margin: float) -> bool:
    """Whether one of these nearer links covers a point in body coordinates."""
    start, direction, length, size = pose
    for j in nearer:
        away_x, away_y = x - start[j, 0], y - start[j, 1]
        along = away_x * direction[j, 0] + away_y * direction[j, 1]
        if -margin < along < length[j] + margin:
            across = away_y * direction[j, 0] - away_x * direction[j, 1]
            taper = 1.0 + (tree.taper[j] - 1.0) * min(max(along / length[j], 0.0), 1.0)
            if abs(across) < 0.5 * size * tree.width[j] * taper + margin:
                return True
    return False


@ANY_ORDER
def _take_off(residual: Single, low: float, high: float) -> float:
    """Subtract from the residuals their median, clipped to limits, which is returned."""
    middle = min(max(float(_middle(residual, np.float32(low), np.float32(high))), low), high)
    less = np.float32(middle)
    for k in range(len(residual)):
        residual[k] -= less
    return middle


@ANY_ORDER
def _middle(values: Single, low: np.float32, high: np.float32) -> np.float32:
    """The (n // 2)-th smallest of n values, clipped to limits.

    Found by bisection: counting processes many values at a time, a selection mispredicts its branches.
    """
    k = len(values) // 2
    if _below(values, low) > k:
        return low
    if _below(values, high) <= k:
        return high
    while True:  # it lies in [low, high)
        middle = np.float32(0.5) * (low + high)
        if middle <= low or middle >= high:
            return low
        number = _below(values, middle)
        if number == k:
            break
        if number > k:
            high = middle
        else:
            low = middle
    least = high
    for k in range(len(values)):
        least = min(least, values[k] if values[k] >= middle else high)
    return least


@ANY_ORDER
def _below(values: Single, limit: np.float32) -> np.int32:
    number = np.int32(0)
    for k in range(len(values)):
        number += np.int32(values[k] < limit)
    return number


@ANY_ORDER
def _doubt(row: Row, n: int, noise: Noise) -> tuple[float, float]:
    """Write robust weights into `match`; returns the sums of weight and of weight * rho / 2."""
    weight, match, excess = row.place[2, :n], row.match[:n], row.excess[:n]
    r0, r1, r2 = row.residual[0, :n], row.residual[1, :n], row.residual[2, :n]
    robust = noise.scale < np.inf
    scale = 3.0 * noise.variance * (noise.scale if robust else 1.0)
    sum_weight, sum_rho = 0.0, 0.0
    for k in range(n):
        a, b, c = np.float64(r0[k]), np.float64(r1[k]), np.float64(r2[k])
        e = (a * a + b * b + c * c) / scale
        excess[k] = e
        match[k] = 1.0 / (1.0 + e) if robust else 1.0
        sum_weight += weight[k]
    if not robust:
        for k in range(n):
            sum_rho += weight[k] * excess[k]
        return sum_weight, 0.5 * sum_rho
    k = 0
    while k < n:
        # One logarithm for the product of many weights.
        w, product, end = weight[k], 1.0, min(k + TOGETHER, n)
        while k < end and weight[k] == w:
            product *= match[k]
            k += 1
        sum_rho -= w * np.log(product)
    return sum_weight, 0.5 * noise.scale * sum_rho


@PART
def _uncover(row: Row, n: int, noise: Noise) -> float:
    """Lower the weight of points that show the scene as without the figure: something nearer may cover them.

    The likelihood of each is a mixture of the figure's and the scene's; `match` and `clear` are multiplied by
    the figure's share. Returns the decrease of the sum of weight * rho / 2.
    """
    less, before, prior = 0.0, np.log1p(noise.covered), np.log(noise.covered)
    for k in range(n):
        if row.around[k] < np.inf:
            # Both rho / 2 and the scene's loss are means over three channels.
            rho = 0.5 * noise.scale * np.log1p(row.excess[k])
            log_odds = prior + 3.0 * (rho - row.around[k])
            rarer = np.exp(-abs(log_odds))
            share = (rarer if log_odds > 0.0 else 1.0) / (1.0 + rarer)
            less += row.place[2, k] * (max(log_odds, 0.0) + np.log1p(rarer) - before) / 3.0
            row.match[k] *= share
            row.clear[k] *= share
    return less


@ANY_ORDER
def _gather(row: Row, n: int, fair: float, moments: Array, pull: Array) -> None:
    """Add w f f' to moments (5, 5) and w f r to pull (5,) over the points, with weights times `fair`."""
    us, vs, weight, match = row.place[0, :n], row.place[1, :n], row.place[2, :n], row.match[:n]
    for c in range(3):
        along, across, residual = row.along[c, :n], row.across[c, :n], row.residual[c, :n]
        m00, m10, m11, m20, m21, m22, m30, m31 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        m32, m33, m40, m41, m42, m43, m44 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        p0, p1, p2, p3, p4 = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(n):
            u, v, w = us[k], vs[k], fair * weight[k] * match[k]
            a, b, r = np.float64(along[k]), np.float64(across[k]), w * residual[k]
            c2, c3, c4 = u * a, u * b - v * a, u * a + v * b
            p0 += a * r
            p1 += b * r
            p2 += c2 * r
            p3 += c3 * r
            p4 += c4 * r
            wa, wb, w2, w3 = w * a, w * b, w * c2, w * c3
            m00 += wa * a
            m10 += wa * b
            m20 += wa * c2
            m30 += wa * c3
            m40 += wa * c4
            m11 += wb * b
            m21 += wb * c2
            m31 += wb * c3
            m41 += wb * c4
            m22 += w2 * c2
            m32 += w2 * c3
            m42 += w2 * c4
            m33 += w3 * c3
            m43 += w3 * c4
            m44 += w * c4 * c4
        for i, value in enumerate((p0, p1, p2, p3, p4)):
            pull[i] += value
        rows = (m00, m10, m20, m30, m40), (m10, m11, m21, m31, m41), (m20, m21, m22, m32, m42)
        for i, row_of in enumerate((*rows, (m30, m31, m32, m33, m43), (m40, m41, m42, m43, m44))):
            for j, value in enumerate(row_of):
                moments[i, j] += value
