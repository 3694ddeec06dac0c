"""Templates laid on a picture: against a slow twin, point by point, and what counts for nothing."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad
from scipy.ndimage import map_coordinates

from kinematics.spm import View, covering, joints, motions, skeleton, surface
from tests.kinematics.figures import HORSE, WALKER, random_pose, upright
from tests.oracles import central_difference
from tracker.picture.pyramid import pyramid
from tracker.registration.kernel import lay, room
from tracker.registration.records import Laid, Noise, Picture, Points, Shape

ROOT = Path(__file__).parents[3]
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
)
PLAIN = ROBUST._replace(scale=np.inf, layered=False, margin=0.0, covered=0.0)
ANYTHING = np.ones((1, 1), np.float32)
NOTHING = np.zeros((1, 1, 3), np.float32)  # a picture still to be put in
NOWHERE = Picture(NOTHING, 0.0, 0.0, 1.0, 1.0, ANYTHING, ANYTHING, 1.0, 1 << 30, 0, 0)

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


def noise_scenery(rng, step=7, corner=(3, 5)):
    """How much a picture differs from what lies behind, of which the level is the part from a corner on."""
    size = -(-(HEIGHT + corner[1]) // step), -(-(WIDTH + corner[0]) // step)
    differs, around = rng.uniform(0.0, 3.0, (2, *size)).astype(np.float32)
    x, y = corner
    return NOWHERE._replace(differs=differs, around=around, step=step, corner_x=x, corner_y=y)


def laid(figure, q, points, planes, noise, view=VIEW, behind=NOWHERE) -> Laid:
    """The kernel at poses q (H, D)."""
    layout, (x, y), (axis_x, axis_y) = figure.layout, view.origin, view.axes
    shape = Shape(layout.layer, layout.width, layout.taper)
    picture = behind._replace(planes=planes, origin_x=x, origin_y=y, axis_x=axis_x, axis_y=axis_y)
    bones = skeleton(figure, q)
    found = room(bones.length.shape, len(points.along))
    lay(picture, bones, points, shape, noise, np.arange(len(q)), found)
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


def twin(figure, q, points, planes, noise, view=VIEW, behind=NOWHERE) -> tuple[Laid, np.ndarray]:
    """The same at one pose q (D,), by numpy and loops over links and points, and the residuals (P, 3)."""
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
        row = int(np.floor(y[p] + behind.corner_y + 0.5)) // behind.step
        column = int(np.floor(x[p] + behind.corner_x + 0.5)) // behind.step
        differing[p] = behind.differs[row, column]
        around[p] = behind.around[row, column]

    L, cost = len(figure.links), 0.0
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
    found = Laid(
        moments=moments,
        pull=pull,
        cost=cost,
        mean=mean,
        shown=(1.0 - covered[inner & visible]).sum() / max(inner.sum(), 1),
        match=match,
        offset=offset,
        inside=inside,
    )
    return found, residual


def check(figure, poses, points, planes, noise, view=VIEW, behind=NOWHERE):
    """The kernel at all poses at once is the twin at each; returns what the kernel found."""
    found = laid(figure, poses, points, planes, noise, view, behind)
    for h, q in enumerate(poses):
        want, _ = twin(figure, q, points, planes, noise, view, behind)
        assert_array_equal(found.inside[h], want.inside)
        assert_array_equal(found.match[h] > 0, want.match > 0)
        for name in ("cost", "mean", "shown", "match", "offset"):
            assert_allclose(getattr(found, name)[h], getattr(want, name), **SINGLE, err_msg=name)
        for name in ("moments", "pull"):
            value, close = getattr(want, name), getattr(found, name)[h]
            # Sums over 40 points of products of such numbers, some of which cancel.
            assert_allclose(close, value, rtol=1e-5, atol=1e-5 * np.abs(value).max(), err_msg=name)
    return found


@pytest.mark.parametrize("facing", [1, -1], ids=["right", "left"])
@pytest.mark.parametrize("noise", [ROBUST, PLAIN], ids=["robust", "plain"])
@pytest.mark.parametrize("figure", [WALKER, HORSE], ids=lambda figure: figure.name)
def test_what_is_laid_is_what_a_walk_from_point_to_point_finds(figure, noise, facing, rng):
    points, planes = scattered(figure, rng), noise_picture(rng)
    # A common light this far off is kept to on some links and channels, and come near to on others.
    points = points._replace(light=np.array([-30.0, 18.0, 23.0]))
    poses = np.array([random_pose(figure, rng, size=0.1) for _ in range(6)])
    poses[4, 0] += 1.4 - joints(figure, poses[4])[:, 0].mean()  # its middle on the picture's edge
    view = replace(VIEW, facing=facing)
    found = check(figure, poses, points, planes, noise, view, noise_scenery(rng))
    assert 0.2 < found.inside[4].mean() < 0.9
    hidden = found.inside & points.known & (found.match == 0)
    assert hidden.any() == noise.layered
    followed = np.abs(found.offset - points.light) < 0.999 * noise.light
    assert 0.2 < followed.mean() < 0.8 or not noise.layered


def test_what_matches_nothing_at_all_costs_no_more_than_the_scene_that_may_cover_it(rng):
    points, planes, behind = scattered(WALKER, rng), noise_picture(rng), noise_scenery(rng)
    noise = ROBUST._replace(variance=1e-3, scale=1e6)
    found = check(WALKER, upright(WALKER)[None], points, planes, noise, behind=behind)
    assert np.isfinite(found.cost).all()


def test_poses_at_once_are_those_one_at_a_time_to_the_last_bit(rng):
    points, planes = scattered(WALKER, rng), noise_picture(rng)
    poses = np.array([random_pose(WALKER, rng, size=0.2) for _ in range(5)])
    poses[2, :2] += 50.0
    behind = noise_scenery(rng)
    together = laid(WALKER, poses, points, planes, ROBUST, behind=behind)
    for h in range(5):
        alone = laid(WALKER, poses[h : h + 1], points, planes, ROBUST, behind=behind)
        for one, all_of_them in zip(alone, together, strict=True):
            assert_array_equal(one[0], all_of_them[h])


@pytest.mark.parametrize("noise", [ROBUST, PLAIN], ids=["robust", "plain"])
def test_the_outermost_pixels_of_a_picture_are_read_like_all_others(noise, rng):
    points = scattered(WALKER, rng, counts=60)
    for corner in [(0.0, 0.0), (WIDTH - 1.0, 0.0), (0.0, HEIGHT - 1.0), (WIDTH - 1.0, HEIGHT - 1.0)]:
        # A tiny figure at a corner: its links lie within a few pixels.
        view = View(origin=corner, unit=4.0, facing=1)
        poses = np.array([random_pose(WALKER, rng, size=0.3) for _ in range(4)])
        found = check(WALKER, poses, points, noise_picture(rng), noise, view, noise_scenery(rng))
        x, y = np.moveaxis(
            view.to_pixels(surface(skeleton(WALKER, poses), link_of(points), *points[1:3])), -1, 0
        )
        edge = (np.minimum(x, WIDTH - 1 - x) < 1) | (np.minimum(y, HEIGHT - 1 - y) < 1)
        assert (edge & (found.match > 0)).sum() > 10


@pytest.mark.parametrize("shape", [(4, 4), (4, 90), (90, 4)])
def test_a_picture_of_four_pixels_a_side_is_read(shape, rng):
    planes = rng.normal(128.0, 10.0, (*shape, 3)).astype(np.float32)
    view = View(origin=(shape[1] / 2, shape[0] / 2), unit=5.0, facing=-1)
    poses = np.array([random_pose(WALKER, rng, size=0.2) for _ in range(3)])
    found = check(WALKER, poses, scattered(WALKER, rng), planes, ROBUST, view)
    assert found.match.any()


@pytest.mark.parametrize(
    ("width", "taper", "hip"), [(1.4, 0.1, 1.4), (0.2, 6.0, 0.45)], ids=["at its start", "at its tip"]
)
def test_a_link_hides_what_its_broader_end_reaches(width, taper, hip, rng):
    i, far = WALKER.link_of("near_knee"), WALKER.link_of("far_ankle")
    links = list(WALKER.links)
    links[i] = replace(links[i], width=width, taper=taper)
    figure = replace(WALKER, links=tuple(links))
    points = scattered(figure, rng)
    mine = link_of(points) == far
    # About the far knee, which the thigh covers with its broader end alone.
    points = points._replace(
        along=np.where(mine, 0.02, points.along), across=np.where(mine, 0.0, points.across)
    )
    found = check(figure, upright(figure, hip_far=hip)[None], points, noise_picture(rng), ROBUST)
    assert found.inside[0, mine].all()
    assert not found.match[0, mine].any()


@pytest.mark.parametrize("light", [0.0, -30.0])
def test_links_of_few_points_and_of_none_have_the_common_light(light, rng):
    counts = [0, 1, 5, 6, 7, 40, 0, 2]
    points = scattered(WALKER, rng, counts)
    points = points._replace(known=np.ones(len(points.known), bool), across=0.2 * points.across)
    points = points._replace(along=rng.uniform(0.5, 1.0, len(points.along)))
    # Legs apart and nothing near the hip, so that every point is in sight.
    q = upright(WALKER, hip_near=0.7, hip_far=-0.7)
    points = points._replace(light=np.full(3, light))
    found = check(WALKER, q[None], points, noise_picture(rng) + 9.0, ROBUST)
    many = np.array(counts) >= ROBUST.fewest
    assert_array_equal((found.offset[0] != light).any(axis=1), many)
    assert not found.moments[0, [0, 6]].any()
    assert not found.pull[0, [0, 6]].any()


@pytest.mark.parametrize("visible", [6, 7, 8, 9, 30, 31])
def test_the_light_of_a_link_is_the_upper_middle_of_its_residuals(visible, rng):
    points = scattered(WALKER, rng, [40] + [0] * 7)
    points = points._replace(known=rng.permutation(40) < visible, along=0.9 * rng.random(40))
    # Few colours, so that many residuals tie.
    points = points._replace(colours=rng.integers(120, 124, (40, 3)).astype(np.float32))
    planes = np.full((HEIGHT, WIDTH, 3), 128.0, np.float32)
    found = laid(WALKER, upright(WALKER)[None], points, planes, ROBUST)
    for c in range(3):
        ranked = sorted(128.0 - points.colours[points.known, c])
        assert found.offset[0, 0, c] == ranked[visible // 2]


def test_points_out_of_the_picture_or_unknown_or_hidden_count_for_nothing(rng):
    points, planes = scattered(WALKER, rng), noise_picture(rng)
    q = upright(WALKER, root_x=1.3, hip_near=0.2, hip_far=-0.1, torso=0.6)
    behind, noise = noise_scenery(rng), ROBUST._replace(in_sight=np.inf)  # every link is
    before = laid(WALKER, q[None], points, planes, noise, behind=behind)
    idle = before.match[0] == 0
    assert 0.3 < idle.mean() < 0.9
    # How many are known within the outline is what `shown` is a share of.
    of_no_outline = (points.weight < 1.0) | ~points.known
    other = points._replace(
        colours=np.where(idle[:, None], np.float32(1e4), points.colours),
        weight=np.where(idle & of_no_outline, 77.0, points.weight),
    )
    after = laid(WALKER, q[None], other, planes, noise, behind=behind)
    for one, two in zip(before, after, strict=True):
        assert_array_equal(one, two)


def test_a_figure_wholly_out_of_the_picture_comes_to_nothing(rng):
    found = laid(
        WALKER, upright(WALKER, root_x=90.0)[None], scattered(WALKER, rng), noise_picture(rng), ROBUST
    )
    for part in found:
        assert not part.any()


@pytest.mark.parametrize("light", [-60.0, 25.0])
def test_light_that_falls_on_a_link_within_limits_changes_nothing_but_its_offset(light, rng):
    points, planes = scattered(WALKER, rng), noise_picture(rng)
    q = random_pose(WALKER, rng, size=0.1)[None]
    wide = ROBUST._replace(light=abs(light) + 20.0)
    dark, lit = (laid(WALKER, q, points, picture, wide) for picture in (planes, planes + np.float32(light)))
    assert_allclose(lit.offset, dark.offset + light, atol=1e-4)
    for name in ("mean", "match"):
        assert_allclose(getattr(lit, name), getattr(dark, name), **SINGLE)
    blind = [laid(WALKER, q, points, picture, PLAIN).mean for picture in (planes, planes + np.float32(light))]
    assert blind[1] > 1.5 * blind[0]


@pytest.mark.parametrize("light", [-60.0, 45.0])
def test_light_beyond_the_limits_stays_in_the_residuals(light, rng):
    points = scattered(WALKER, rng)
    points = points._replace(colours=np.full_like(points.colours, 128.0))
    common = np.array([-8.0, 3.0, 7.0])
    planes = np.full((HEIGHT, WIDTH, 3), 128.0 + light, np.float32)
    noise = ROBUST._replace(in_sight=np.inf)  # every link is
    found = laid(WALKER, upright(WALKER)[None], points._replace(light=common), planes, noise)
    taken = common + np.sign(light) * ROBUST.light
    seen = found.match[0] > 0
    many = [(seen & (link_of(points) == i)).sum() >= ROBUST.fewest for i in range(len(WALKER.links))]
    assert_allclose(found.offset[0][many], np.tile(taken, (sum(many), 1)), atol=1e-5)
    clear = seen & np.array(many)[link_of(points)]
    square = ((light - taken) ** 2).sum() / (3.0 * ROBUST.variance)
    assert clear.any()
    assert_allclose(found.match[0, clear], 1.0 / (1.0 + square / ROBUST.scale), rtol=1e-5)


def test_what_lies_behind_is_what_it_is_where_the_visible_points_of_the_outline_fall(rng):
    points, q = scattered(WALKER, rng), upright(WALKER, hip_near=0.5, hip_far=-0.5)
    planes = noise_picture(rng)
    knee = VIEW.to_pixels(joints(WALKER, q))[WALKER.joints.index("near_knee")]
    differs = np.zeros((HEIGHT, WIDTH), np.float32)
    differs[int(knee[1]) :] = 2.0  # legs below the knee alone
    noise = ROBUST._replace(covered=0.0, in_sight=np.inf)  # every link is
    behind = NOWHERE._replace(differs=0.0 * differs, around=differs, step=1)
    plain = laid(WALKER, q[None], points, planes, noise, behind=behind)
    found = laid(WALKER, q[None], points, planes, noise, behind=behind._replace(differs=differs))
    body = surface(skeleton(WALKER, q), link_of(points), points.along, points.across)
    below = np.floor(VIEW.to_pixels(body)[:, 1] + 0.5) >= int(knee[1])
    counted = (found.match[0] > 0) & (points.weight == 1.0)
    assert (counted & below).sum() > 20
    assert plain.cost[0] - found.cost[0] == pytest.approx(2.0 * (counted & below).sum())
    assert found.shown[0] == pytest.approx(counted.sum() / (points.known & (points.weight == 1.0)).sum())


def test_the_share_that_is_shown_falls_as_links_are_hidden_or_leave_the_picture(rng):
    points, planes = scattered(WALKER, rng), noise_picture(rng)
    poses = [upright(WALKER, hip_near=0.7, hip_far=-0.7), upright(WALKER), upright(WALKER, root_x=1.6)]
    apart, together, leaving = laid(WALKER, np.array(poses), points, planes, ROBUST).shown
    assert apart > together + 0.05
    assert together > leaving + 0.2
    # Nothing hides anything.
    assert laid(WALKER, poses[1][None], points, planes, PLAIN).shown[0] == 1.0


def test_a_link_that_matches_too_badly_is_out_of_sight_and_pulls_at_nothing(rng):
    points, planes = scattered(WALKER, rng), noise_picture(rng, spread=1.0)
    thigh = link_of(points) == WALKER.link_of("near_knee")
    colours = np.where(thigh[:, None], points.colours + rng.normal(0.0, 150.0, points.colours.shape), 128.0)
    points = points._replace(colours=colours.astype(np.float32))
    found = check(WALKER, upright(WALKER, hip_far=-0.8)[None], points, planes, ROBUST)
    i = WALKER.link_of("near_knee")
    assert not found.match[0, thigh].any()
    assert not found.moments[0, i].any()
    assert found.moments[0, WALKER.link_of("near_ankle")].any()
    assert found.mean[0] > 0.5  # it is still paid for


@pytest.mark.parametrize("facing", [1, -1], ids=["right", "left"])
def test_pull_and_moments_are_those_of_the_differenced_residuals(facing, rng):
    picture = rng.integers(0, 256, (HEIGHT, WIDTH, 3)).astype(np.uint8)
    (level,) = pyramid(picture, (0, 0, WIDTH, HEIGHT), [4.0], colour=True)
    points, view = scattered(WALKER, rng), replace(VIEW, facing=facing)
    q = upright(WALKER, torso=0.2, hip_near=0.5, knee_near=0.3, hip_far=-0.4, knee_far=0.2)

    def residual(q):
        return twin(WALKER, q, points, level.planes, PLAIN, view)[1].ravel()

    found = laid(WALKER, q[None], points, level.planes, PLAIN, view)
    assert found.inside.all()
    M = motions(WALKER, skeleton(WALKER, q))
    # Steps of 0.005: 0.2 px and less; rounding of float32 over step is 1e-5 / 1e-2.
    J, r, W = central_difference(residual, q, step=5e-3), residual(q), np.repeat(points.weight, 3)[:, None]
    # Differences over two pixels take (1/4)^2 / 6 = 1 % off the slope of waves blurred by 4 px, some more off
    # the steep ones that weigh most, and twice that off squares. What pulls cancels.
    pull = np.einsum("lw,lwd->d", found.pull[0], M)
    assert_allclose(pull, J.T @ (W[:, 0] * r), atol=0.02 * (np.abs(J).T @ (W[:, 0] * np.abs(r))).max())
    information = np.einsum("lwd,lwv,lve->de", M, found.moments[0], M)
    want = J.T @ (W * J)
    assert_allclose(information, want, atol=0.05 * want.max())
    assert (np.diag(want) > 0.0).all()


INTERRUPTED = """
import signal
import numpy as np
from tests.tracker.registration.test_kernel import ROBUST, WALKER, laid, noise_picture, scattered, upright

def stop(*_):
    raise KeyboardInterrupt

rng, q = np.random.default_rng(0), upright(WALKER)[None]
points, planes = scattered(WALKER, rng, counts=3), noise_picture(rng)
laid(WALKER, q, points, planes, ROBUST)
signal.signal(signal.SIGALRM, stop)
for stops in range(200):
    try:
        signal.setitimer(signal.ITIMER_REAL, rng.uniform(1e-3, 3e-3))
        while True:
            laid(WALKER, q, points, planes, ROBUST)
    except KeyboardInterrupt:
        print(stops)
"""


@pytest.mark.skipif(os.name == "nt", reason="there is no such timer there")
def test_an_interrupt_at_any_moment_is_an_interrupt_and_no_crash():
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(stops) for stops in range(200)]
