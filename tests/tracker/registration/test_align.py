"""Registration finds planted motions, weighs picture against prior, and its information is the residuals'."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian
from kinematics.spm import joints
from tests.kinematics.figures import WALKER, upright
from tests.tracker.painted import BARE, CLASSIC, FULL, STRIDE, VIEW, Painted, levels_of
from tests.tracker.registration.planted import (
    MOTIONS,
    POSED,
    WEAK,
    D,
    chequered,
    moved,
    registered,
    settled,
    shown,
)
from tracker.picture.backdrop import UNKNOWN
from tracker.registration.align import align, scan
from tracker.registration.field import Field
from tracker.registration.modes import COARSE, LIMIT_GIVE
from tracker.registration.templates import cut

NOISE = 2.0  # of the pictures, grey levels

# Every pixel counts whole, and the prior weighs next to nothing.
SURE = FULL.model_copy(update={"tempering": 1.0})
LENGTHS = slice(WALKER.freedoms.index("scale"), None)


def pixel_errors(q, want, view=VIEW):
    return np.linalg.norm(view.unit * (joints(WALKER, q) - joints(WALKER, want)), axis=1)


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


def test_a_planted_motion_is_found_as_well_in_pictures_five_times_as_large(rng):
    painted, want, by = Painted(rng, plain=True), MOTIONS["everything"], 5
    before, after = (
        painted.picture(q, noise=NOISE, rng=rng).repeat(by, axis=0).repeat(by, axis=1) for q in (STRIDE, want)
    )
    x, y = VIEW.origin
    middle = 0.5 * (by - 1)  # of the pixels that one has become
    large = replace(VIEW, origin=(by * x + middle, by * y + middle), unit=by * VIEW.unit)
    prior = Gaussian(STRIDE, WEAK)
    _, found = registered(before, after, STRIDE, prior, SURE, view=large)
    assert pixel_errors(found.q, want).max() < 0.5


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
