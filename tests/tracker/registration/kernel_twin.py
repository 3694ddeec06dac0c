"""Templates laid on a picture by the kernel and by a slow twin of it, which must agree."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad
from scipy.ndimage import map_coordinates

from kinematics.spm import View, covering, skeleton, surface
from tracker.registration.kernel import lay, room
from tracker.registration.records import Laid, Noise, Picture, Points

WIDTH, HEIGHT = 120, 110
VIEW = View(origin=(58.0, 52.0), unit=42.0, facing=1)
ROBUST = Noise(
    variance=64.0,
    light=20.0,
    scale=4.0,
    out_of_sight=3.2,
    in_sight=1.4,
    fewest=6,
    layered=True,
    margin=0.02,
    covered=0.1,
    alike=0.8,
)
PLAIN = ROBUST._replace(scale=np.inf, layered=False, margin=0.0, covered=0.0, alike=-np.inf)
ANYTHING = np.ones((1, 1), np.float32)
NOTHING = np.zeros((1, 1, 3), np.float32)  # a picture still to be put in
NOWHERE = Picture(NOTHING, 0.0, 0.0, 1.0, 1.0, ANYTHING, ANYTHING, 1.0, 1 << 30, 0.0, 0.0, 1)

# Residuals and slopes are kept in float32: 6e-8 of 255 grey levels, of which differences are taken.
SINGLE = {"rtol": 2e-6, "atol": 1e-4}


def scattered(figure, rng, counts=40):
    """Points on every link and around it, some unknown; `counts` a link, or one for each."""
    L = len(figure.links)
    counts = np.broadcast_to(counts, L)
    P = counts.sum()
    return Points(
        first=np.r_[0, np.cumsum(counts)].astype(np.intp),
        along=rng.uniform(-0.1, 1.1, P),
        across=rng.uniform(-0.15, 0.15, P),
        weight=np.where(rng.random(P) < 0.6, 1.0, rng.uniform(0.2, 1.0, P)),
        colours=rng.normal(128.0, 12.0, (P, 3)).astype(np.float32),
        known=rng.random(P) < 0.9,
        light=np.zeros(3),
    )


def link_of(points):
    return np.repeat(np.arange(len(points.first) - 1), np.diff(points.first))


def noise_picture(rng, spread=10.0):
    return rng.normal(128.0, spread, (HEIGHT, WIDTH, 3)).astype(np.float32)


def noise_scenery(rng):
    """How much a picture differs from what lies behind; the level is a part of it at half the resolution."""
    step, (x, y), pixel = 7, (3.5, 5.5), 2
    size = -(-int(pixel * HEIGHT + y) // step), -(-int(pixel * WIDTH + x) // step)
    differs, around = rng.uniform(0.0, 3.0, (2, *size)).astype(np.float32)
    return NOWHERE._replace(differs=differs, around=around, step=step, corner_x=x, corner_y=y, pixel=pixel)


def laid(figure, q, points, planes, noise, view=VIEW, behind=NOWHERE) -> Laid:
    """The kernel at poses q (H, D)."""
    (x, y), (axis_x, axis_y) = view.origin, view.axes
    picture = behind._replace(planes=planes, origin_x=x, origin_y=y, axis_x=axis_x, axis_y=axis_y)
    bones = skeleton(figure, q)
    found = room(bones.length.shape, len(points.along))
    lay(picture, bones, points, figure.layout, noise, np.arange(len(q)), found)
    return found


def between(plane, x, y):
    """Bilinear values of (h, w) at pixels, by scipy."""
    return map_coordinates(plane, np.array([y, x]), order=1, mode="nearest")


def differences(plane):
    """Half of right less left and of below less above; beyond its edge a picture goes on as it ends."""
    wide = np.pad(plane, 1, mode="edge")
    return 0.5 * (wide[1:-1, 2:] - wide[1:-1, :-2]), 0.5 * (wide[2:, 1:-1] - wide[:-2, 1:-1])


def share_in_sight(loss, noise):
    """Of a link of this mean loss: all up to one limit, nothing from the other on."""
    return np.interp(loss, [noise.in_sight, noise.out_of_sight], [1.0, 0.0])


def fade(loss, noise):
    """What a link costs whose share in sight is the derivative by its mean loss."""
    return quad(share_in_sight, 0.0, loss, (noise,), points=[noise.in_sight, noise.out_of_sight])[0]


def twin(figure, q, points, planes, noise, view=VIEW, behind=NOWHERE) -> Laid:
    """The same at one pose q (D,), by numpy and loops over links and points."""
    link, bones, P = link_of(points), skeleton(figure, q), len(points.along)
    body = surface(bones, link, points.along, points.across)
    x, y = view.to_pixels(body).T
    rows, columns = planes.shape[:2]
    inside = (x >= 0) & (x <= columns - 1) & (y >= 0) & (y <= rows - 1)
    visible = inside & points.known
    if noise.layered:
        visible &= ~covering(figure, bones, body, link, noise.margin)

    residual, slope = np.zeros((P, 3)), np.zeros((P, 3, 2))
    for c in range(3):
        plane = planes[..., c].astype(float)
        residual[:, c] = between(plane, x, y) - points.colours[:, c]
        right, down = (between(part, x, y) for part in differences(plane))
        by_body = np.stack([right, down], axis=-1) * view.axes
        slope[:, c, 0] = (by_body * bones.direction[link]).sum(axis=-1)
        slope[:, c, 1] = (by_body * bones.normal[link]).sum(axis=-1)
    residual[~visible] = 0.0

    inner = points.known & (points.weight == 1.0)
    differing, around = np.full(P, behind.unknown), np.full(P, np.inf)
    for p in np.flatnonzero(inner & visible):
        row = int(np.floor(y[p] * behind.pixel + behind.corner_y + 0.5)) // behind.step
        column = int(np.floor(x[p] * behind.pixel + behind.corner_x + 0.5)) // behind.step
        differing[p] = behind.differs[row, column]
        around[p] = behind.around[row, column]

    L, cost = len(figure.links), 0.0
    bare = np.zeros(L)
    offset, match = np.zeros((L, 3)), visible.astype(float)
    moments, pull = np.zeros((L, 5, 5)), np.zeros((L, 5))
    loss, covered = np.zeros(P), np.zeros(P)
    for i in range(L):
        own = np.flatnonzero(visible & (link == i))
        if noise.layered and len(own) >= noise.fewest:
            middle = np.sort(residual[own], axis=0)[len(own) // 2]
            offset[i] = np.clip(middle, points.light - noise.light, points.light + noise.light)
        elif noise.layered:
            offset[i] = points.light
        residual[own] -= offset[i]
        square = (residual[own] ** 2).sum(axis=1) / (3.0 * noise.variance)
        loss[own] = 0.5 * square
        if np.isfinite(noise.scale):
            match[own] = 1.0 / (1.0 + square / noise.scale)
            loss[own] = 0.5 * noise.scale * np.log(1.0 + square / noise.scale)
        within = own[points.weight[own] == 1.0]
        scene = within[differing[within] < noise.alike]
        bare[i] = (loss[scene] - differing[scene]).sum() / max(len(within), 1)
        for p in own[(around[own] < behind.unknown) & (noise.covered > 0.0)]:
            # The figure's likelihood of three channels mixed with the scene's.
            shown, scene = -3.0 * loss[p], np.log(noise.covered) - 3.0 * around[p]
            either = np.logaddexp(shown, scene)
            covered[p] = np.exp(scene - either)
            match[p] *= 1.0 - covered[p]
            loss[p] = (np.log1p(noise.covered) - either) / 3.0
        w = points.weight[own]
        if noise.layered and len(own):
            cost += w.sum() * fade(np.average(loss[own], weights=w), noise)
            match[own] *= share_in_sight(np.average(loss[own], weights=w), noise)
        else:
            cost += w @ loss[own]
        cost -= w @ differing[own]
        for p in own:
            u, v = points.along[p] * bones.length[i], points.across[p] * bones.size
            for c in range(3):
                g_u, g_v = slope[p, c]
                f = np.array([g_u, g_v, u * g_u, u * g_v - v * g_u, u * g_u + v * g_v])
                moments[i] += points.weight[p] * match[p] * np.outer(f, f)
                pull[i] += points.weight[p] * match[p] * f * residual[p, c]
    mean = np.average(loss[visible], weights=points.weight[visible]) if visible.any() else 0.0
    return Laid(
        moments=moments,
        pull=pull,
        cost=cost,
        bare=bare,
        mean=mean,
        shown=(1.0 - covered[inner & visible]).sum() / max(inner.sum(), 1),
        match=match,
        offset=offset,
        inside=inside,
    )


def check(figure, poses, points, planes, noise, view=VIEW, behind=NOWHERE):
    """The kernel at all poses at once is the twin at each; returns what the kernel found."""
    found = laid(figure, poses, points, planes, noise, view, behind)
    for h, q in enumerate(poses):
        want = twin(figure, q, points, planes, noise, view, behind)
        assert_array_equal(found.inside[h], want.inside)
        assert_array_equal(found.match[h] > 0, want.match > 0)
        for name in ("cost", "bare", "mean", "shown", "match", "offset"):
            assert_allclose(getattr(found, name)[h], getattr(want, name), **SINGLE, err_msg=name)
        for name in ("moments", "pull"):
            value, close = getattr(want, name), getattr(found, name)[h]
            # Sums over 40 points of products of such numbers, some of which cancel.
            assert_allclose(close, value, rtol=1e-5, atol=1e-5 * np.abs(value).max(), err_msg=name)
    return found
