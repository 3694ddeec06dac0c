"""Registration: planted motions are found, what is hidden measures nothing, information is the residuals'."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian
from kinematics.spm import joints
from tests.kinematics.figures import WALKER, upright
from tests.tracker.painted import (
    BARE,
    CLASSIC,
    FULL,
    SIZE,
    STRIDE,
    VIEW,
    Painted,
    covered,
    freedoms,
    levels_of,
    placed,
)
from tracker.loop.judging import LEAST_INSIDE
from tracker.picture.backdrop import MOST, UNKNOWN, UNSEEN, Scenery, first_backdrop
from tracker.picture.pyramid import Level, sample
from tracker.registration.align import DAMPING, align, scan
from tracker.registration.field import Field, Registration
from tracker.registration.modes import COARSE, LIMIT_GIVE
from tracker.registration.templates import cut

D = len(WALKER.freedoms)
NOISE = 2.0  # of the pictures, grey levels

# A prior so weak that it leans on nothing the picture tells: 0.2 legs, 17 degrees, 5 % of length.
POSED = len(WALKER.pose_freedoms)
WEAK = np.diag(np.r_[0.2, 0.2, np.full(POSED - 2, 0.3), np.full(D - POSED, 0.05)] ** 2)
# Every pixel counts whole, and the prior weighs next to nothing.
SURE = FULL.model_copy(update={"tempering": 1.0})
LENGTHS = slice(WALKER.freedoms.index("scale"), None)

# Near leg so broad, and far leg so close behind it, that no point of the far leg shows.
BROAD = replace(
    WALKER,
    links=tuple(
        replace(link, width=0.7, taper=1.0) if link.name.endswith("_near") else link for link in WALKER.links
    ),
)
BEHIND = upright(BROAD, hip_near=0.1, hip_far=0.2, knee_far=0.2, ankle_far=0.5)
FAR_FREEDOMS = ("hip_far", "knee_far", "ankle_far", "thigh_far", "shank_far")


def registered(before, after, q, prior, settings, *, figure=WALKER, view=VIEW):
    """Templates cut from one picture in pose q, laid on another from a prior."""
    templates = cut(figure, view, q, levels_of(before, settings, view), settings)
    levels = levels_of(after, settings, view)
    return templates, settled(templates, levels, prior, settings, figure=figure, view=view)


def settled(templates, levels, prior, settings, *, figure=WALKER, view=VIEW, scenery=UNSEEN) -> Registration:
    """Where one prior leads."""
    alone = Gaussian(prior.mean[None], prior.cov[None])
    (found,) = align(Field(templates, levels, figure, view, settings, scenery), alone)
    return found


def shown(templates, levels, found, *, view=VIEW):
    """(levels, P, 3) colours at the settled points."""
    return Field(templates, levels, WALKER, view, FULL).seen(found)


def of_links(templates, *joints):
    """(P,) whether a point is fixed to one of the links with these joints at their tips."""
    return np.isin(templates.link, [WALKER.link_of(joint) for joint in joints])


def known_scene(painted, image):
    """How a picture differs from the painted background, which is known everywhere."""
    beside, whole = (-9.0, -9.0, -1.0, -1.0), (0.0, 0.0, SIZE[0] - 1.0, SIZE[1] - 1.0)
    empty = painted.picture(moved(root_x=9.0))
    return first_backdrop(empty, beside, VIEW.unit).follow(image, whole, np.zeros(2)).scenery


def without(templates, *joints):
    """Templates that know nothing of some links."""
    return replace(templates, known=templates.known & ~of_links(templates, *joints))


def pixel_errors(q, want, view=VIEW):
    return np.linalg.norm(view.unit * (joints(WALKER, q) - joints(WALKER, want)), axis=1)


def moved(**by):
    q = STRIDE.copy()
    for name, value in by.items():
        q[WALKER.freedoms.index(name)] += value
    return q


MOTIONS = {
    "3 px aside, 2 px up": moved(root_x=3 / 80, root_y=2 / 80),
    "near leg 4 degrees ahead": moved(hip_near=0.07, knee_near=-0.05),
    "far leg 4 degrees back": moved(hip_far=-0.07, knee_far=0.04),
    "trunk and head": moved(torso=0.06, neck=-0.07),
    "3 percent nearer": moved(scale=0.03),
    "longer shanks": moved(stretch_shank_near=0.05, stretch_shank_far=0.04),
    "everything": moved(root_x=0.03, torso=0.03, neck=0.04, hip_near=0.05, knee_near=-0.06, hip_far=-0.06),
}


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("settings", [SURE, CLASSIC], ids=["full", "classic"])
def test_a_planted_motion_is_found_from_where_the_figure_was(settings, name, rng):
    painted, want = Painted(rng, plain=True), MOTIONS[name]
    before, after = (painted.picture(q, noise=NOISE, rng=rng) for q in (STRIDE, want))
    prior = Gaussian(STRIDE, WEAK)
    if settings.mode == "classic":
        prior = Gaussian(np.r_[STRIDE[: LENGTHS.start], want[LENGTHS]], WEAK)
    _, found = registered(before, after, STRIDE, prior, settings)
    # Some 150 independent pixels a link, each placing it to noise over slope = 2 / 10 px across, would tell
    # a joint to 0.03 px; pixels averaged over steep edges and read bilinearly are worth some tenths.
    assert pixel_errors(found.q, want).max() < 0.5
    # Half a pixel at the end of a link of 27 px (the head) or 40 px (thigh, shank, torso).
    angles = [WALKER.freedoms.index(link.freedom) for link in WALKER.links]
    assert_allclose(found.q[angles], want[angles], atol=0.5 / 27)
    assert_allclose(found.q[:2], want[:2], atol=0.5 / 80)
    # Scale and stretch share a length: half a pixel of 27 and more.
    assert_allclose(found.q[LENGTHS], want[LENGTHS], atol=2 * 0.5 / 27)


def test_each_link_may_change_its_brightness(rng):
    # No rim: the background's light stays, and a link's outline would change.
    painted, want = Painted(rng, plain=True), MOTIONS["everything"]
    before = painted.picture(STRIDE, noise=NOISE, rng=rng)
    light = np.array([18.0, -15.0, 20.0, -20.0, 15.0, -18.0, -16.0, 17.0])
    lit = painted.picture(want, light=light, noise=NOISE, rng=rng)
    bare = SURE.model_copy(update={"rim": 0.0})
    _, found = registered(before, lit, STRIDE, Gaussian(STRIDE, WEAK), bare)
    errors = dict(zip(WALKER.joints, pixel_errors(found.q, want), strict=True))
    toes = [errors.pop("near_toe"), errors.pop("far_toe")]
    assert max(errors.values()) < 0.5  # as without
    # Of a foot 7 px wide, half lies within the blur of its outline, where light changes by less.
    assert max(toes) < 1.5
    _, blind = registered(before, lit, STRIDE, Gaussian(STRIDE, WEAK), CLASSIC)
    assert pixel_errors(blind.q, want).mean() > 2.0 * pixel_errors(found.q, want).mean()


def test_a_picture_that_did_not_change_leaves_the_pose_where_it_was(rng):
    picture = Painted(rng).picture(STRIDE)
    templates, found = registered(picture, picture, STRIDE, Gaussian(STRIDE, WEAK), FULL)
    # Colours in float32 leave 1e-5 of a grey level; slopes are near 1000 a leg length or radian.
    assert_allclose(found.q, STRIDE, atol=1e-7)
    assert found.misfit < 1e-6
    # What lies behind is not known; every known point that is shown speaks for the pose by as much.
    count = FULL.tempering * templates.weight[templates.known].sum()
    assert found.cost == pytest.approx(-count * UNKNOWN, abs=1e-5)
    assert_allclose(shown(templates, levels_of(picture, FULL), found), templates.colours, atol=1e-3)
    assert_array_equal(found.match > 0, templates.known)


def test_a_tight_prior_holds_the_pose_against_the_picture_and_a_weak_one_lets_it_go(rng):
    painted, want = Painted(rng), MOTIONS["3 px aside, 2 px up"]
    before, after = painted.picture(STRIDE), painted.picture(want)
    errors = [
        pixel_errors(registered(before, after, STRIDE, Gaussian(STRIDE, size * WEAK), FULL)[1].q, want).mean()
        for size in (1e-10, 1.0)
    ]
    assert errors[0] == pytest.approx(np.hypot(3, 2), abs=0.05)
    assert errors[1] < 0.5


def test_the_classic_climb_leans_on_the_prior_of_the_lengths_alone(rng):
    painted, want = Painted(rng), MOTIONS["3 px aside, 2 px up"]
    before, after = painted.picture(STRIDE), painted.picture(want)
    posed = np.arange(D) < POSED
    sizes = np.diag(np.where(posed, 1e-5, 1.0))
    tight, weak = (
        registered(before, after, STRIDE, Gaussian(STRIDE, cov), CLASSIC)[1]
        for cov in (sizes @ WEAK @ sizes, WEAK)
    )
    assert_array_equal(tight.q, weak.q)
    assert_array_equal(tight.information, weak.information)


def test_priors_side_by_side_settle_as_each_alone(rng):
    painted = Painted(rng)
    before, after = painted.picture(STRIDE), painted.picture(MOTIONS["everything"], noise=NOISE, rng=rng)
    templates = cut(WALKER, VIEW, STRIDE, levels_of(before, FULL), FULL)
    # There at once, held fast, climbing (two), out of steps, outside.
    means = np.stack(
        [
            MOTIONS["everything"],
            STRIDE,
            STRIDE,
            MOTIONS["trunk and head"],
            moved(root_x=0.2, hip_near=0.4, torso=-0.5),
            moved(root_x=4.0),
        ]
    )
    covs = np.array([1.0, 1e-8, 1.0, 0.1, 1.0, 1.0])[:, None, None] * WEAK
    kept = means.copy()
    settings, levels = FULL.model_copy(update={"iterations": 5}), levels_of(after, FULL)
    together = align(Field(templates, levels, WALKER, VIEW, settings), Gaussian(means, covs))
    assert_array_equal(means, kept)
    for found, mean, cov in zip(together, means, covs, strict=True):
        alone = settled(templates, levels, Gaussian(mean, cov), settings)
        # Products of stacked matrices may be summed in another order.
        assert_allclose(found.q, alone.q, atol=1e-9)
        assert_allclose(found.information, alone.information, atol=1e-7 * alone.information.max() + 1e-12)
        assert_allclose(found.vector, alone.vector, atol=1e-7 * np.abs(alone.vector).max() + 1e-12)
        assert found.cost == pytest.approx(alone.cost, abs=1e-7)
        assert found.inside == alone.inside
        assert_allclose(found.match, alone.match, atol=1e-6)
        assert_allclose(found.offset, alone.offset, atol=1e-4)


def test_colours_are_those_of_the_frame_less_the_light_of_each_link(rng):
    painted = Painted(rng)
    templates = cut(WALKER, VIEW, STRIDE, levels_of(painted.picture(STRIDE), FULL), FULL)
    levels = levels_of(painted.picture(STRIDE, light=np.linspace(-20.0, 20.0, 8)), FULL)
    found = settled(templates, levels, Gaussian(STRIDE, 1e-4 * WEAK), FULL)
    assert np.ptp(found.offset[:, 0]) > 10.0
    colours = shown(templates, levels, found)
    pixels = VIEW.to_pixels(placed(WALKER, found.q, templates))
    for number, level in enumerate(levels):
        want = sample(level, pixels)[0] - np.stack([found.offset[i] for i in templates.link])
        assert_allclose(colours[number], want, atol=1e-4)


def test_a_joint_past_its_limit_is_pulled_back_in_the_full_mode_alone(rng):
    low = WALKER.limits[0][WALKER.index("knee_far")]
    beyond = moved(knee_far=low - 0.25 - STRIDE[WALKER.index("knee_far")])
    picture = Painted(rng).picture(beyond)
    knee = WALKER.index("knee_far")

    def found(settings):
        return registered(picture, picture, beyond, Gaussian(beyond, WEAK), settings)[1]

    # Where the picture tells nothing the limit is kept; where it tells all, given way to.
    blind = found(FULL.model_copy(update={"tempering": 1e-9}))
    assert low - 0.03 < blind.q[knee] < low
    give = LIMIT_GIVE
    assert blind.information[knee, knee] == pytest.approx(1.0 / give**2, rel=1e-3)
    assert low - 0.25 < found(FULL).q[knee] < blind.q[knee]
    assert_allclose(found(CLASSIC).q, beyond, atol=1e-7)


def test_a_leg_wholly_behind_the_other_measures_exactly_nothing_and_is_where_the_prior_has_it(rng):
    painted = Painted(rng, BROAD)
    apart = upright(BROAD, hip_near=-0.6, hip_far=0.7, knee_far=0.2)  # seen in the open once
    before, after = painted.picture(apart), painted.picture(BEHIND)
    prior = Gaussian(BEHIND, 1e-6 * WEAK)
    templates, found = registered(before, after, apart, prior, BARE, figure=BROAD)
    far = np.isin(templates.link, [BROAD.link_of(f"far_{joint}") for joint in ("knee", "ankle", "toe")])
    assert templates.known[far].sum() > 50
    columns = freedoms(BROAD, *FAR_FREEDOMS)
    # The thigh's first row holds the hip itself: whatever shows there, no freedom of the leg moves it.
    left = far & (found.match > 0)
    assert (np.abs(templates.across[left]) + templates.along[left] < 1e-9).all()
    assert not found.information[columns].any()
    assert not found.information[:, columns].any()
    assert not found.vector[columns].any()
    near = freedoms(BROAD, *(name.replace("far", "near") for name in FAR_FREEDOMS))
    assert (np.diag(found.information)[near] > 1.0).all()
    assert_array_equal(found.q[columns], BEHIND[columns])


def test_a_figure_out_of_the_frame_measures_nothing(rng):
    picture = Painted(rng).picture(STRIDE)
    templates = cut(WALKER, VIEW, STRIDE, levels_of(picture, FULL), FULL)
    gone = Gaussian(moved(root_x=4.0), WEAK)
    found = settled(templates, levels_of(picture, FULL), gone, FULL)
    assert found.inside == 0.0
    assert not found.information.any()
    assert not found.vector.any()
    assert_array_equal(found.q, gone.mean)


def test_of_half_a_figure_in_the_frame_half_the_points_are_inside(rng):
    view = replace(VIEW, origin=(90.0, 165.0))
    picture = Painted(rng, view=view).picture(STRIDE)
    _, found = registered(picture, picture, STRIDE, Gaussian(STRIDE, WEAK), FULL, view=view)
    assert LEAST_INSIDE < found.inside < 0.7


def test_the_first_step_is_the_damped_gauss_newton_step(rng):
    painted, want = Painted(rng), MOTIONS["everything"]
    before, after = painted.picture(STRIDE), painted.picture(want, noise=NOISE, rng=rng)
    levels, settings = levels_of(after, FULL)[:1], FULL.model_copy(update={"iterations": 1})
    templates = cut(WALKER, VIEW, STRIDE, levels_of(before, FULL)[:1], FULL)
    held = settled(templates, levels, Gaussian(STRIDE, 1e-14 * WEAK), settings)
    gradient = held.information @ held.q - held.vector
    H = held.information + np.linalg.inv(WEAK)  # the prior has no slope at its own mean
    step = -np.linalg.solve(H + DAMPING.first * np.diag(np.diag(H)), gradient)
    assert 0.02 < np.abs(step).max() < DAMPING.longest
    found = settled(templates, levels, Gaussian(STRIDE, WEAK), settings)
    assert_allclose(found.q - STRIDE, step, atol=1e-6)  # held to within 1e-7


def test_at_the_mode_the_gradient_handed_on_balances_the_prior(rng):
    # Everything in the open and no rim, so that all points count alike.
    painted, q = Painted(rng), upright(WALKER, hip_near=0.9, hip_far=-0.9, knee_far=0.3)
    want = q + np.r_[0.02, -0.01, 0.03, 0.02, -0.04, 0.05, 0.03, -0.02, np.zeros(D - 8)]
    before, after = painted.picture(q), painted.picture(want, noise=NOISE, rng=rng)
    cov = np.diag(np.r_[0.02, 0.02, np.full(POSED - 2, 0.03), np.full(D - POSED, 0.01)] ** 2)
    _, found = registered(before, after, q, Gaussian(q, cov), BARE)
    precision = np.linalg.inv(cov)
    slope = found.information @ found.q - found.vector + precision @ (found.q - q)
    left = np.linalg.solve(found.information + precision, slope)
    # The climb stops at gains below 0.01 nats; a Newton step from there gains slope' H^-1 slope / 2.
    assert 0.5 * slope @ left < 0.05
    assert 0.5 * (found.q - q) @ precision @ (found.q - q) > 1.0  # where the prior does pull


def flat_level(sigma=1.0):
    """A level of one colour."""
    width, height = SIZE
    return Level(np.full((height, width, 3), 128.0, np.float32), (0, 0), sigma)


def spoiled_templates(level, q, rng, settings, scale=7.0):
    templates = cut(WALKER, VIEW, q, [level], settings)
    colours = templates.colours + rng.normal(scale=scale, size=templates.colours.shape)
    return replace(templates, colours=colours.astype(np.float32), known=np.ones(len(colours[0]), bool))


def chequered(rng, step=5):
    """What lies behind the figure differs by 0 here and 2 there."""
    width, height = SIZE
    differs = 2.0 * rng.integers(0, 2, (-(-height // step), -(-width // step)))
    return Scenery(differs.astype(np.float32), step)


def sight(templates, found):
    """Points that are seen within the outline, and what share they are of those that are known."""
    inner = (templates.weight == 1.0) & templates.known
    seen = inner & (found.match > 0)
    return seen, seen.sum() / inner.sum()


def visible_weight(templates, found):
    return templates.weight[found.match > 0].sum()


@pytest.mark.parametrize("differs", [0.0, 0.3, UNKNOWN, 2.0])
def test_what_does_not_match_tells_nothing_where_the_scene_is_seen_as_it_was(differs, rng):
    (level,) = levels_of(Painted(rng).picture(STRIDE), FULL)[-1:]
    scenery = Scenery(np.full((1, 1), differs, np.float32), 1 << 30)
    update = {"out_of_sight": 0.0, "in_sight": 1e-6, "rim": 0.0}
    wary, trusting = (FULL.model_copy(update=update | {"covered": covered}) for covered in (0.05, 0.0))
    templates, prior = spoiled_templates(level, STRIDE, rng, wary, 25.0), Gaussian(STRIDE, 1e-12 * WEAK)
    doubted, trusted = (
        settled(templates, [level], prior, settings, scenery=scenery) for settings in (wary, trusting)
    )
    if differs < UNKNOWN:
        assert doubted.match.sum() < 0.5 * trusted.match.sum()
        assert doubted.misfit < trusted.misfit
        assert np.linalg.norm(doubted.information) < 0.5 * np.linalg.norm(trusted.information)
    else:
        assert_array_equal(doubted.match, trusted.match)
        assert_array_equal(doubted.information, trusted.information)
        assert doubted.misfit == trusted.misfit


@pytest.mark.parametrize(("scale", "sign"), [(3.0, -1.0), (25.0, 1.0)], ids=["matching", "not matching"])
def test_points_that_a_pose_hides_speak_neither_for_it_nor_against_it(scale, sign, rng):
    level, settings = flat_level(), FULL.model_copy(update={"out_of_sight": 0.0, "in_sight": 1e-6})
    templates = spoiled_templates(level, STRIDE, rng, settings, scale)
    crossed = upright(WALKER, hip_near=0.1, hip_far=0.1)
    open_pose, hiding = (
        settled(templates, [level], Gaussian(q, 1e-12 * WEAK), settings) for q in (STRIDE, crossed)
    )
    shares = [sight(templates, found)[1] for found in (open_pose, hiding)]
    assert shares[1] < 0.9 * shares[0]
    assert np.sign([open_pose.cost, hiding.cost]).tolist() == [sign, sign]
    # A mean over some 1000 points each, the loss of each spread about as wide as its mean.
    close = {"abs": settings.tempering * open_pose.misfit * 4.0 / np.sqrt(1000)}
    each = open_pose.cost / visible_weight(templates, open_pose)
    assert hiding.cost / visible_weight(templates, hiding) == pytest.approx(each, **close)
    # Points that are not known yet are none that are hidden.
    fewer = replace(templates, known=rng.random(len(templates.link)) < 0.5)
    unseen = settled(fewer, [level], Gaussian(STRIDE, 1e-12 * WEAK), settings)
    assert unseen.cost / visible_weight(fewer, unseen) == pytest.approx(each, **close)
    assert unseen.information.shape == (D, D)


def test_a_pose_where_the_picture_shows_what_is_always_there_costs_more(rng):
    picture = Painted(rng).picture(STRIDE)
    templates = cut(WALKER, VIEW, STRIDE, levels_of(picture, FULL), FULL)
    prior, levels = Gaussian(STRIDE, 1e-6 * WEAK), levels_of(picture, FULL)
    step, settings = 4, FULL.model_copy(update={"covered": 0.0})
    size = -(-SIZE[1] // step), -(-SIZE[0] // step)
    same, other = (
        settled(templates, levels, prior, settings, scenery=Scenery(np.full(size, d, np.float32), step))
        for d in (0.0, 3.0)
    )
    seen, _ = sight(templates, same)
    assert same.cost - other.cost == pytest.approx(3.0 * FULL.tempering * seen.sum(), rel=1e-6)
    # What lies behind has no slope to climb.
    assert_allclose(same.q, other.q, atol=1e-9)
    assert_allclose(same.information, other.information, atol=1e-9 * other.information.max())


def test_a_climb_may_start_elsewhere_than_where_the_prior_leans(rng):
    painted, want = Painted(rng), moved(root_x=0.4)
    templates = cut(WALKER, VIEW, STRIDE, levels_of(painted.picture(STRIDE), FULL), FULL)
    field = Field(templates, levels_of(painted.picture(want), FULL), WALKER, VIEW, FULL)
    prior = Gaussian(STRIDE[None], WEAK[None])
    (there,) = align(field, prior, want[None])
    (away,) = align(field, prior)
    assert pixel_errors(there.q, want).mean() < 0.5  # as from a planted motion
    assert pixel_errors(away.q, want).mean() > 5.0
    (same,) = align(field, prior, STRIDE[None])
    assert_array_equal(same.q, away.q)
    # Held by the prior, a start elsewhere is left.
    (held,) = align(field, Gaussian(STRIDE[None], 1e-8 * WEAK[None]), want[None])
    assert pixel_errors(held.q, STRIDE).max() < 0.5


def test_a_scan_is_what_each_pose_costs_at_the_coarsest_blur_where_it_stands(rng):
    painted, scenery = Painted(rng), chequered(rng)
    templates = cut(WALKER, VIEW, STRIDE, levels_of(painted.picture(STRIDE), FULL), FULL)
    levels = levels_of(painted.picture(MOTIONS["everything"], noise=NOISE, rng=rng), FULL)
    poses = np.stack([STRIDE, MOTIONS["everything"], moved(root_x=0.5), moved(root_x=4.0)])
    kept = poses.copy()
    found = scan(Field(templates, levels, WALKER, VIEW, FULL, scenery), poses)
    assert_array_equal(poses, kept)
    part = slice(None, None, COARSE)
    names = ("link", "along", "across", "weight", "known")
    fewer = {name: getattr(templates, name)[part] for name in names}
    coarse = replace(templates, **fewer, colours=templates.colours[:1, part])
    each = len(templates.link) / len(coarse.link)  # points that one of them stands for
    for q, cost in zip(poses, found, strict=True):
        held = settled(coarse, levels[:1], Gaussian(q, 1e-14 * WEAK), FULL, scenery=scenery)
        # Held to within 1e-7; slopes are near 1e3 a radian or leg length.
        assert cost == pytest.approx(each * held.cost, abs=1e-3)
    assert found.argmin() == 1
    assert found[3] == 0.0  # out of the frame


def test_points_not_seen_yet_measure_nothing(rng):
    painted = Painted(rng)
    before, after = painted.picture(STRIDE), painted.picture(MOTIONS["everything"])
    templates = cut(WALKER, VIEW, STRIDE, levels_of(before, FULL), FULL)
    lower = of_links(templates, "near_ankle", "near_toe")
    unknown = replace(templates, known=templates.known & ~lower & (rng.random(len(lower)) < 0.7))
    found = settled(unknown, levels_of(after, FULL), Gaussian(STRIDE, WEAK), FULL)
    columns = freedoms(WALKER, "knee_near", "ankle_near", "shank_near")
    assert not found.information[columns].any()
    # A shank of an unknown look is compared with what stands out, and nothing is known to.
    shank = of_links(templates, "near_ankle")
    assert (found.match[~unknown.known & ~shank] == 0.0).all()
    assert (found.match[unknown.known] > 0.0).any()


def test_a_link_that_does_not_match_what_covers_it_measures_less(rng):
    painted = Painted(rng)
    picture = painted.picture(STRIDE)
    shrub = picture.copy()
    rows = slice(VIEW.to_pixels(joints(WALKER, STRIDE))[3:, 1].min().astype(int), None)
    leaves = np.kron(rng.integers(0, 2, (32, 30, 3)), np.ones((6, 6, 1)))[: len(shrub)]
    shrub[rows] = 255 * leaves[rows]
    prior = Gaussian(STRIDE, 1e-4 * WEAK)
    _, clear = registered(picture, picture, STRIDE, prior, FULL)
    _, behind = registered(picture, shrub, STRIDE, prior, FULL)
    knees = freedoms(WALKER, "knee_near", "knee_far")
    # Leaves are steeper than cloth, and yet what they tell is counted for a tenth at most.
    assert (np.diag(behind.information)[knees] < 0.1 * np.diag(clear.information)[knees]).all()
    torso = freedoms(WALKER, "torso")
    assert (np.diag(behind.information)[torso] > 0.5 * np.diag(clear.information)[torso]).all()


def test_the_colours_of_a_strange_link_are_seen_in_the_light_common_to_all(rng):
    painted = Painted(rng)
    levels = levels_of(painted.picture(STRIDE, light=np.full(8, 10.0)), FULL)
    templates = cut(WALKER, VIEW, STRIDE, levels_of(painted.picture(STRIDE), FULL), FULL)
    templates = replace(without(templates, "near_ankle", "near_toe"), light=np.array([9.0, -2.0, 3.0]))
    found = settled(templates, levels, Gaussian(STRIDE, 1e-6 * WEAK), FULL)
    strange = of_links(templates, "near_ankle", "near_toe")
    pixels = VIEW.to_pixels(placed(WALKER, found.q, templates))
    for level, colours in zip(levels, shown(templates, levels, found), strict=True):
        assert_allclose(colours[strange], sample(level, pixels)[0][strange] - templates.light, atol=1e-4)


OPEN = FULL.model_copy(update={"cover": 0.0, "covered": 0.0})  # nothing hidden beyond an outline, or covered


def laid_on(picture, templates, scenery=UNSEEN, *, q=STRIDE, view=VIEW):
    """A field, and where a prior that holds the pose fast settles in it."""
    levels = levels_of(picture, OPEN, view)
    field = Field(templates, levels, WALKER, view, OPEN, scenery)
    return field, settled(templates, levels, Gaussian(q, 1e-12 * WEAK), OPEN, view=view, scenery=scenery)


def forgetful(templates, rng):
    """Templates that know every other point of what was seen."""
    return replace(templates, known=templates.known & (rng.random(len(templates.link)) < 0.5))


@pytest.mark.parametrize("low", [0.0, 50.0], ids=["all of the figure in the picture", "its feet below it"])
def test_what_is_seen_of_a_link_in_full_sight_is_new_where_it_is_not_known(low, rng):
    view = replace(VIEW, origin=(VIEW.origin[0], VIEW.origin[1] + low))
    q = upright(WALKER, hip_near=0.3, hip_far=0.1, knee_near=0.1)
    picture = Painted(rng, view=view).picture(q)
    templates = forgetful(cut(WALKER, view, q, levels_of(picture, OPEN, view), OPEN), rng)
    field, found = laid_on(picture, templates, q=q, view=view)
    points = placed(WALKER, q, templates)
    hidden = covered(WALKER, q, points, templates.link)
    out = (view.to_pixels(points) > (SIZE[0] - 1, SIZE[1] - 1)).any(axis=1)
    assert (hidden & ~out).sum() > 20
    assert out.any() == (low > 0.0)
    assert_array_equal(field.new(found), ~templates.known & ~hidden & ~out)


def test_what_shows_the_bare_scene_is_not_new(rng):
    picture = Painted(rng).picture(STRIDE)
    templates = forgetful(cut(WALKER, VIEW, STRIDE, levels_of(picture, OPEN), OPEN), rng)
    field, found = laid_on(picture, templates, chequered(rng))
    column, row = np.floor(VIEW.to_pixels(placed(WALKER, found.q, templates)) + 0.5).astype(int).T // 5
    plain = field.scenery.differs[row, column] == 0.0
    everywhere = replace(field, scenery=UNSEEN).new(found)
    assert 0.3 < plain[everywhere].mean() < 0.7
    assert_array_equal(field.new(found), everywhere & ~plain)


def test_nothing_is_new_of_a_link_that_does_not_match(rng):
    picture = Painted(rng).picture(STRIDE)
    templates = forgetful(cut(WALKER, VIEW, STRIDE, levels_of(picture, OPEN), OPEN), rng)
    thigh = of_links(templates, "near_knee")
    noise = rng.normal(0.0, 22.0, templates.colours.shape)
    spoiled = np.where(thigh[:, None], templates.colours + noise, templates.colours).astype(np.float32)
    field, found = laid_on(picture, replace(templates, colours=spoiled))
    assert 0.0 < found.match[thigh & templates.known].mean() < OPEN.in_sight  # doubtful, and yet not nothing
    clear, matching = laid_on(picture, templates)
    want = clear.new(matching)
    assert want[thigh].sum() > 20
    assert_array_equal(field.new(found), want & ~thigh)


def test_nothing_is_new_of_a_leg_that_is_mostly_hidden(rng):
    painted, crossed = Painted(rng), upright(WALKER, hip_near=0.05)
    levels = levels_of(painted.picture(STRIDE), OPEN)
    templates = forgetful(cut(WALKER, VIEW, STRIDE, levels, OPEN), rng)
    field, found = laid_on(painted.picture(crossed), templates, q=crossed)
    leg = of_links(templates, "far_knee", "far_ankle")
    seen = ~covered(WALKER, crossed, placed(WALKER, crossed, templates), templates.link)
    assert (seen & leg & ~templates.known).sum() > 10
    assert not field.new(found)[leg].any()
    assert field.new(found)[of_links(templates, "near_knee", "near_ankle")].any()


def strange_shank(rng):
    """A picture before a known scene, templates that know nothing of its near shank and foot, both."""
    painted = Painted(rng, plain=True)
    picture = painted.picture(STRIDE)
    templates = cut(WALKER, VIEW, STRIDE, levels_of(picture, OPEN), OPEN)
    return picture, without(templates, "near_ankle", "near_toe"), known_scene(painted, picture)


def test_a_strange_limb_is_new_where_it_stands_out_and_hangs_on_one_in_sight(rng):
    picture, templates, scenery = strange_shank(rng)
    shank = of_links(templates, "near_ankle")
    field, found = laid_on(picture, templates, scenery)
    new = field.new(found)
    outline = shank & (templates.weight == 1.0)
    assert new[outline].mean() > 0.9
    assert not new[shank & field.scenery.plain(found.pixels)].any()
    # The foot hangs on the shank, of which nothing is known yet.
    assert not new[of_links(templates, "near_toe")].any()

    unseen, found = laid_on(picture, templates)
    assert not unseen.new(found)[shank].any()
    away, found = laid_on(picture, templates, scenery, q=moved(knee_near=1.2))
    assert not away.new(found)[shank].any()

    thigh = of_links(templates, "near_knee")
    inverse = np.where(thigh[:, None], 255.0 - templates.colours, templates.colours).astype(np.float32)
    for other in (without(templates, "near_knee"), replace(templates, colours=inverse)):
        field, found = laid_on(picture, other, scenery)
        assert not field.new(found)[shank].any()


@pytest.mark.parametrize(("share", "learned"), [(0.6, False), (0.8, True)])
def test_a_strange_limb_is_learned_if_most_of_it_is_known_to_stand_out(share, learned, rng):
    picture, templates, _ = strange_shank(rng)
    shank = of_links(templates, "near_ankle")
    outline = shank & (templates.weight == 1.0)
    lower = np.quantile(VIEW.to_pixels(placed(WALKER, STRIDE, templates))[outline, 1], share)
    differs = np.full(SIZE[::-1], UNKNOWN, np.float32)
    differs[: int(np.floor(lower + 0.5))] = MOST
    field, found = laid_on(picture, templates, Scenery(differs, 1))
    assert field.new(found)[shank].any() == learned
