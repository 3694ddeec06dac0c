"""The chain rule of a pose, compiled: the links that it places, and its normal equations from theirs.

It equals `kinematics.spm.skeleton` and `kinematics.spm.motions`, for loops that place a few poses some
hundred times a second: with M_l the motion of link l by the pose, and m_l and p_l its sums of weight f f' and
of weight f residual over the points measured on it,

    information = sum_l M_l' m_l M_l,    gradient = sum_l M_l' p_l.

The searches that use them are compiled as well: Levenberg-Marquardt for templates, Gauss-Newton for points.
"""

from typing import Any

import numpy as np

from dynamics.gaussian import Array, Gaussian, Ints
from kinematics.figure import Layout
from kinematics.spm import Skeleton
from tracker.compiled import compiled, part
from tracker.registration.records import Climbs, Laying, Weights

Parts = tuple[Any, ...]  # plain tuples as arguments, and no results, as in `tracker.registration.kernel`

LEAST = 1e-9  # added to the diagonal of a system
LONGEST = 0.5  # step in leg lengths, radians or log units, far beyond the range of the linearisation
# Of Levenberg-Marquardt:
LIGHTER = 0.3  # factor on the damping after a step that lowered the cost
HEAVIER, LEAST_HEAVY = 10.0, 1e-2  # factor after a step that did not, and the least damping then
HEAVIEST = 10.0  # damping beyond which a climb ends
SMALL_GAIN = 1e-2  # of a step that ends it, nats
SMALL_STEP = 2e-3  # that ends it, leg lengths: a fifth of a pixel of a leg of a hundred
# Of the search for points:
FREEDOM = 4.0  # degrees of freedom of the Student t of their errors
STEPS, SMALL = 20, 1e-4  # largest number of steps, and the size of one that ends the search

COMPILED = compiled(error_model="numpy")
PART = part(error_model="numpy")


def laid_out(tree: Layout, q: Array) -> Skeleton:
    """The links for poses q (H, D), as by `kinematics.spm.skeleton`."""
    H, L = len(q), len(tree.rest)
    bones = Skeleton(np.empty((H, L, 2)), np.empty((H, L, 2)), np.empty((H, L)), np.empty(H))
    _lay_out(tuple(tree), np.ascontiguousarray(q), tuple(bones))
    return bones


def weighed(tree: Layout, fit: Laying, weights: Weights) -> tuple[Array, Array, Array]:
    """E (H,), its Gauss-Newton matrix (H, D, D) and its derivative (H, D) by the pose."""
    H, D = fit[0].shape
    found = np.empty(H), np.empty((H, D, D)), np.empty((H, D))
    q, start, direction, length, _, *links = fit
    _weigh(tuple(tree), q, (start, direction, length), tuple(links), tuple(weights), found)
    return found


def descend(tree: Layout, fit: Laying, weights: Weights, priors: tuple[Array, Array], climbs: Climbs) -> None:
    """Accept the tried poses that are better, and place the links for the poses to try next.

    Args:
        fit: has 2 H rows, see `Climbs`.
        priors: means (H, D) and precisions (H, D, D) that the climbs include.
    """
    _descend(tuple(tree), fit, tuple(weights), priors, tuple(climbs))


def settled(
    tree: Layout, priors: Gaussian, joint: Ints, place: Array, spread: float
) -> tuple[Array, Array, Array, Array]:
    """Search from each of H priors' means for a mode of its posterior given points, for each of W namings.

    The steps are undamped Gauss-Newton, each point with the weight that a Student t gives it at the pose
    (Lange, Little and Taylor, 1989).

    Args:
        priors: mean (H, D), cov (H, D, D).
        joint: (W, J) the joint of each point under each naming: 0 the base, i + 1 the tip of link i.
        place: (J, 2) body coordinates.
        spread: scale of the points' errors, leg lengths.

    Returns:
        The modes (W, H, D); there the information (W, H, D, D) of the points' likelihood, the gradient (W, H,
        D) of minus its log, and the vectors (W, H, J, 2) from the points to their joints, leg lengths.
    """
    (W, J), (H, D) = joint.shape, priors.mean.shape
    q = np.repeat(priors.mean[None], W, axis=0)
    found = q, np.empty((W, H, D, D)), np.empty((W, H, D)), np.empty((W, H, J, 2))
    about = np.ascontiguousarray(priors.mean), np.ascontiguousarray(np.linalg.inv(priors.cov))
    _settle(tuple(tree), about, (joint, place), spread, found)
    return found


@PART
def _solve(systems: Parts, steps: Array) -> None:
    """Solve damped systems by Cholesky factors; writes into `steps`."""
    information, slope, damping = systems
    H, D = slope.shape
    root = np.empty((D, D))
    for h in range(H):
        x = steps[h]
        for i in range(D):
            x[i] = -slope[h, i]
            for j in range(i + 1):
                total = information[h, i, j]
                if i == j:
                    # A link seen end-on or hidden leaves its freedoms without information, hence the damping.
                    total += damping[h] * total + LEAST
                for k in range(j):
                    total -= root[i, k] * root[j, k]
                root[i, j] = np.sqrt(max(total, LEAST)) if i == j else total / root[j, j]
            for k in range(i):
                x[i] -= root[i, k] * x[k]
            x[i] /= root[i, i]
        for i in range(D - 1, -1, -1):
            for k in range(i + 1, D):
                x[i] -= root[k, i] * x[k]
            x[i] /= root[i, i]
        share = LONGEST / max(_most(x), LONGEST)
        for i in range(D):
            x[i] *= share


@PART
def _most(step: Array) -> float:
    """The largest magnitude of a step (D,)."""
    most = 0.0
    for k in range(len(step)):
        most = max(most, abs(step[k]))
    return most


@COMPILED
def _weigh(of_tree: Parts, q: Array, bones: Parts, links: Parts, weights: Parts, found: Parts) -> None:
    """Write the objective E of every pose and its derivatives into `found`."""
    moments, pull, lost = links
    per_lost, per_pull, low, high, stiffness = weights
    cost, information, gradient = found
    information[:] = 0.0
    gradient[:] = 0.0
    _sum_up(of_tree, bones, (moments, pull), (information, gradient))
    for h in range(len(q)):
        cost[h] = per_lost * lost[h]
        for k in range(q.shape[1]):
            gradient[h, k] *= per_pull
            for j in range(q.shape[1]):
                information[h, k, j] *= per_pull
            excess = max(q[h, k] - high[k], 0.0) + min(q[h, k] - low[k], 0.0)
            if excess != 0.0:
                cost[h] += 0.5 * stiffness * excess * excess
                gradient[h, k] += stiffness * excess
                information[h, k, k] += stiffness


@PART
def _lower(of_tree: Parts, fit: Parts, row: int, weights: Parts, prior: Parts, found: Parts) -> None:
    """Write the cost of one row of a climb, E and the prior, and its derivatives into found (1, ...)."""
    q, start, direction, length, _, moments, pull, lost = fit
    mean, precision = prior
    cost, information, gradient = found
    one = slice(row, row + 1)
    bones, links = (start[one], direction[one], length[one]), (moments[one], pull[one], lost[one])
    _weigh(of_tree, q[one], bones, links, weights, found)
    for a in range(len(mean)):
        leans = 0.0
        for b in range(len(mean)):
            leans += precision[a, b] * (q[row, b] - mean[b])
            information[0, a, b] += precision[a, b]
        gradient[0, a] += leans
        cost[0] += 0.5 * (q[row, a] - mean[a]) * leans


@COMPILED
def _descend(of_tree: Parts, fit: Parts, weights: Parts, priors: Parts, climbs: Parts) -> None:
    """One round of Levenberg-Marquardt for each unfinished climb."""
    q, start, direction, length, size = fit[:5]
    mean, precision = priors
    own, on, cost, damping = climbs
    H, D = mean.shape
    slope, step, damped = np.empty((1, D)), np.empty((1, D)), np.empty(1)
    bent, there = np.empty((1, D, D)), np.empty(1)
    for h in range(H):
        if not on[h]:
            continue
        row = own[h] ^ 1
        _lower(of_tree, fit, row, weights, (mean[h], precision[h]), (there, bent, slope))
        gain, first = cost[h] - there[0], cost[h] == np.inf
        if gain > 0.0:
            for k in range(D):
                step[0, k] = q[row, k] - q[own[h], k]
            moved = _most(step[0])
            on[h] = first or (gain >= SMALL_GAIN and moved >= SMALL_STEP)
            damping[h] *= 1.0 if first else LIGHTER
            own[h], cost[h] = row, there[0]
        else:
            damping[h] = max(HEAVIER * damping[h], LEAST_HEAVY)
            on[h] = damping[h] <= HEAVIEST
            _lower(of_tree, fit, own[h], weights, (mean[h], precision[h]), (there, bent, slope))
        if on[h]:
            row, damped[0] = own[h] ^ 1, damping[h]
            _solve((bent, slope, damped), step)
            for k in range(D):
                q[row, k] = q[own[h], k] + step[0, k]
            one = slice(row, row + 1)
            _lay_out(of_tree, q[one], (start[one], direction[one], length[one], size[one]))


@COMPILED
def _settle(of_tree: Parts, priors: Parts, points: Parts, spread: float, found: Parts) -> None:
    """Gauss-Newton steps for every naming and prior in turn."""
    mean, precision = priors
    joint, place = points
    q, information, gradient, away = found
    H, D = mean.shape
    bent, slope, step, undamped = np.empty((1, D, D)), np.empty((1, D)), np.empty((1, D)), np.zeros(1)
    for w in range(len(joint)):
        for h in range(H):
            pose, own = q[w, h : h + 1], (joint[w : w + 1], place)
            there = information[w, h : h + 1], gradient[w, h : h + 1], away[w, h : h + 1]
            for _ in range(STEPS):
                _linearise(of_tree, pose, own, spread, there)
                for a in range(D):
                    slope[0, a] = gradient[w, h, a]
                    for b in range(D):
                        slope[0, a] += precision[h, a, b] * (pose[0, b] - mean[h, b])
                        bent[0, a, b] = information[w, h, a, b] + precision[h, a, b]
                _solve((bent, slope, undamped), step)
                for a in range(D):
                    pose[0, a] += step[0, a]
                if _most(step[0]) < SMALL:
                    break
            _linearise(of_tree, pose, own, spread, there)


@PART
def _linearise(of_tree: Parts, q: Array, points: Parts, spread: float, found: Parts) -> None:
    """Write information, gradient and distances of the points at one pose (1, D) into `found`."""
    joint, place = points
    information, gradient, away = found
    L = len(Layout(*of_tree).rest)
    start, direction, length, size = np.empty((1, L, 2)), np.empty((1, L, 2)), np.empty((1, L)), np.empty(1)
    moments, pull, f = np.zeros((1, L, 5, 5)), np.zeros((1, L, 5)), np.zeros((2, 5))
    _lay_out(of_tree, q, (start, direction, length, size))
    f[0, 0] = f[1, 1] = 1.0
    for k in range(joint.shape[1]):
        i = max(joint[0, k] - 1, 0)
        u = length[0, i] if joint[0, k] > 0 else 0.0  # the base is where the first link starts
        f[0, 2] = f[0, 4] = f[1, 3] = u
        dx, dy = direction[0, i, 0], direction[0, i, 1]
        x, y = start[0, i, 0] + u * dx - place[k, 0], start[0, i, 1] + u * dy - place[k, 1]
        away[0, k, 0], away[0, k, 1] = x, y
        squares = (x**2 + y**2) / spread**2
        w = (FREEDOM + 2.0) / (FREEDOM + squares) / spread**2
        along, across = x * dx + y * dy, y * dx - x * dy
        for r in range(5):
            pull[0, i, r] += w * (f[0, r] * along + f[1, r] * across)
            for s in range(5):
                moments[0, i, r, s] += w * (f[0, r] * f[0, s] + f[1, r] * f[1, s])
    information[:] = 0.0
    gradient[:] = 0.0
    _sum_up(of_tree, (start, direction, length), (moments, pull), (information, gradient))


@COMPILED
def _lay_out(of_tree: Parts, q: Array, bones: Parts) -> None:
    """Write start, direction, length and size of the links into `bones`."""
    tree = Layout(*of_tree)
    start, direction, length, size = bones
    L = len(tree.rest)
    for h in range(len(q)):
        size[h] = np.exp(q[h, tree.scale])
        for i in range(L):
            long = tree.length[i] * size[h]
            length[h, i] = long * np.exp(q[h, tree.stretch[i]]) if tree.breathes[i] else long
            angle = 0.0
            for j in range(i + 1):
                angle += tree.chain[i, j] * (tree.rest[j] + q[h, tree.angle[j]] * tree.sense[j])
            direction[h, i, 0], direction[h, i, 1] = np.cos(angle), np.sin(angle)
        for i in range(L):
            for x in range(2):
                start[h, i, x] = q[h, x]
                for j in range(i):
                    start[h, i, x] += tree.reach[i, j] * length[h, j] * direction[h, j, x]


@PART
def _sum_up(of_tree: Parts, bones: Parts, links: Parts, pose: Parts) -> None:
    """Add the links' sums up to the pose's information and gradient."""
    tree = Layout(*of_tree)
    start, direction, length = bones
    moments, pull = links
    information, gradient = pose
    L, D = len(tree.rest), gradient.shape[1]
    M, mM = np.empty((5, D)), np.empty((5, D))
    moving = np.empty(D, np.intp)
    for h in range(len(gradient)):
        for i in range(L):
            n = _moved(tree, start[h], direction[h], length[h], i, M, moving)
            for a in moving[:n]:
                for r in range(5):
                    mM[r, a] = 0.0
                    for s in range(5):
                        mM[r, a] += moments[h, i, r, s] * M[s, a]
                    gradient[h, a] += M[r, a] * pull[h, i, r]
            for a in moving[:n]:
                for b in moving[:n]:
                    for r in range(5):
                        information[h, a, b] += M[r, a] * mM[r, b]


@PART
def _moved(
    tree: Layout, start: Array, direction: Array, length: Array, i: int, M: Array, moving: Ints
) -> int:
    """Write link i's motion by the pose into M (5, D), the n freedoms that move it into `moving`; give n."""
    dx, dy = direction[i, 0], direction[i, 1]
    M[:, :] = 0.0
    M[0, 0], M[1, 0] = dx, -dy
    M[0, 1], M[1, 1] = dy, dx
    moving[0], moving[1], moving[2] = 0, 1, tree.scale
    n = 3
    x, y = start[i, 0] - start[0, 0], start[i, 1] - start[0, 1]
    M[0, tree.scale], M[1, tree.scale], M[4, tree.scale] = x * dx + y * dy, y * dx - x * dy, 1.0
    for j in range(i + 1):
        if tree.turns[j] and tree.chain[i, j] != 0.0:
            a, sense = tree.angle[j], tree.chain[i, j] * tree.sense[j]
            x, y = start[i, 0] - start[j, 0], start[i, 1] - start[j, 1]
            M[0, a], M[1, a], M[3, a] = -sense * (y * dx - x * dy), sense * (x * dx + y * dy), sense
            moving[n], n = a, n + 1
        if tree.breathes[j] and (i == j or tree.reach[i, j] != 0.0):
            a, long = tree.stretch[j], tree.reach[i, j] * length[j]
            along = direction[j, 0] * dx + direction[j, 1] * dy
            across = direction[j, 1] * dx - direction[j, 0] * dy
            M[0, a], M[1, a] = long * along, long * across
            if i == j:
                M[2, a] = 1.0
            moving[n], n = a, n + 1
    return n
