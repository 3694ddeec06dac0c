"""Templates: which points a link has, what they are worth, what is cut for them, and how they keep up."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import map_coordinates

from kinematics.spm import View, covering, skeleton
from tests.kinematics.figures import HORSE, WALKER, random_pose, upright
from tests.tracker.painted import BARE, CLASSIC, FULL, STRIDE, VIEW, Painted, covered, levels_of, placed
from tracker.registration.templates import RIM_WEIGHT, Templates, cut
from tracker.settings import Settings

CROSSING = upright(WALKER, hip_near=0.1, knee_near=0.2, hip_far=-0.1, knee_far=0.1)


@pytest.fixture
def levels(rng):
    return levels_of(Painted(rng).picture(CROSSING))


def names(figure, templates):
    return [figure.links[i].name for i in templates.link]


@pytest.mark.parametrize("settings", [FULL, BARE], ids=["rim", "bare"])
def test_points_lie_within_the_outline_at_full_weight_and_on_the_rim_at_less(levels, settings):
    templates = cut(WALKER, VIEW, CROSSING, levels, settings)
    for i, link in enumerate(WALKER.links):
        own = templates.link == i
        along, across = templates.along[own] * link.length, templates.across[own]
        edge = 0.5 * link.width * (1.0 + (link.taper - 1.0) * np.clip(templates.along[own], 0.0, 1.0))
        inner = (np.abs(across) <= edge) & (along <= link.length)
        assert_array_equal(templates.weight[own], np.where(inner, 1.0, RIM_WEIGHT))
        assert along.min() == 0.0
        assert (np.abs(across) <= edge + settings.rim + 1e-12).all()
        # A grid of this spacing leaves at most one step free at each end.
        leaf = i not in WALKER.parents
        end = link.length + (settings.rim if leaf else 0.0)
        assert end - settings.spacing < along.max() <= end + 1e-9


def test_the_classic_mode_has_no_rim(levels):
    templates = cut(WALKER, VIEW, CROSSING, levels, CLASSIC)
    assert (templates.weight == 1.0).all()


def test_points_are_spread_evenly_over_every_link(levels):
    templates = cut(WALKER, VIEW, CROSSING, levels, BARE)
    for i, link in enumerate(WALKER.links):
        area = link.length * link.width * 0.5 * (1.0 + link.taper)
        # Rows and columns at both ends of the grid stand for half a cell each: a spacing more all round.
        most = (link.length + BARE.spacing) * (link.width * max(1.0, link.taper) + BARE.spacing)
        count = (templates.link == i).sum() * BARE.spacing**2
        assert 0.8 * area < count < 1.001 * most


@pytest.mark.parametrize("spacing", [0.022, 0.13, 0.2])
@pytest.mark.parametrize("figure", [WALKER, HORSE], ids=lambda figure: figure.name)
def test_every_link_has_points_however_wide_apart(figure, spacing, rng):
    pose = np.zeros(len(figure.freedoms))
    levels = levels_of(Painted(rng).picture(CROSSING))
    settings = Settings(rim=0.0, spacing=spacing)
    templates = cut(figure, VIEW, pose, levels, settings)
    assert np.bincount(templates.link, templates.weight == 1.0, len(figure.links)).min() >= 1


@pytest.mark.parametrize("facing", [1, -1], ids=["right", "left"])
@pytest.mark.parametrize("figure", [WALKER, HORSE], ids=lambda figure: figure.name)
def test_cut_takes_the_picture_s_colours_where_the_points_lie(figure, facing, rng):
    view = View((90.3, 92.7), 60.0, facing)
    levels = levels_of(rng.integers(0, 256, (190, 180, 3)).astype(np.uint8), view=view)
    q = random_pose(figure, rng, size=0.1)
    templates = cut(figure, view, q, levels, FULL)
    body = placed(figure, q, templates)
    pixels = np.array(view.origin) + view.unit * body * (facing, -1.0)
    inside = ((pixels >= 0) & (pixels <= (179, 189))).all(axis=1)
    for number, level in enumerate(levels):
        for channel in range(3):
            want = map_coordinates(level.planes[..., channel], pixels[inside, ::-1].T, order=1)
            # Neighbours differ by up to 100 grey levels; float32 planes and rounding of places leave 1e-4.
            assert_allclose(templates.colours[number, inside, channel], want, atol=1e-3)


def test_points_behind_a_nearer_link_or_out_of_the_frame_are_unknown(rng):
    view = replace(VIEW, origin=(90.0, 130.0))  # the feet stand below the picture
    levels = levels_of(Painted(rng, view=view).picture(CROSSING))
    templates = cut(WALKER, view, CROSSING, levels, FULL.model_copy(update={"cover": 0.0}))
    body = placed(WALKER, CROSSING, templates)
    pixels = view.to_pixels(body)
    inside = ((pixels >= 0) & (pixels <= (179, 189))).all(axis=1)
    hidden = covered(WALKER, CROSSING, body, templates.link)
    assert_array_equal(templates.known, inside & ~hidden)
    assert (inside & hidden).sum() > 20
    assert (~inside).sum() > 20
    near = [name.endswith("near") for name in names(WALKER, templates)]
    assert_array_equal(templates.known[near], inside[near])


def test_a_link_of_which_nothing_is_known_looks_as_its_twin_does_in_the_same_place(levels):
    longer = {"shank_far": 1.1}
    uneven = WALKER.with_lengths([link.length * longer.get(link.name, 1.0) for link in WALKER.links])
    before = cut(uneven, VIEW, CROSSING, levels, FULL)
    shank = before.link == uneven.link_of("far_ankle")
    before = replace(before, known=before.known & ~shank)
    after = before.completed(uneven, FULL.spacing)
    place = np.stack([before.along * uneven.layout.length[before.link], before.across], axis=1)
    theirs = np.flatnonzero((before.link == uneven.link_of("near_ankle")) & before.known)
    for p in np.flatnonzero(shank):
        apart = np.linalg.norm(place[theirs] - place[p], axis=1)
        assert after.known[p] == (apart.min() <= FULL.spacing)
        if after.known[p]:
            assert_array_equal(after.colours[:, p], before.colours[:, theirs[apart.argmin()]])
    assert 0.5 < after.known[shank].mean() < 1.0  # the longer one's end has no counterpart
    assert_array_equal(after.colours[:, ~shank], before.colours[:, ~shank])


def test_what_is_hidden_of_a_link_in_sight_and_what_has_no_twin_is_not_taken_from_another(levels):
    before = cut(WALKER, VIEW, CROSSING, levels, FULL)
    before = replace(before, known=before.known & (before.link > 1))  # the trunk is not known
    assert (~before.known[before.link > 1]).any()
    after = before.completed(WALKER, 1.0)
    assert_array_equal(after.known, before.known)
    assert_array_equal(after.colours, before.colours)


DARK = np.zeros((1, 3))  # the light of one link


def small(known, link=None):
    P = len(known)
    zero = np.zeros(P)
    link = np.zeros(P, np.intp) if link is None else np.asarray(link)
    return Templates(link, zero, zero, np.ones(P), np.zeros((2, P, 3)), np.array(known, bool), np.zeros(3))


@pytest.mark.parametrize("blurs", [0.5, 3.0])
def test_a_point_is_hidden_as_far_beyond_an_outline_as_the_finest_blur_carries_it(blurs, rng):
    levels = levels_of(Painted(rng).picture(CROSSING))
    templates = cut(WALKER, VIEW, CROSSING, levels, FULL.model_copy(update={"cover": blurs}))
    body, bones = placed(WALKER, CROSSING, templates), skeleton(WALKER, CROSSING)
    margin = blurs * levels[-1].sigma / VIEW.unit
    hidden = covering(WALKER, bones, body, templates.link, margin)
    assert (hidden & ~covering(WALKER, bones, body, templates.link)).sum() > 3
    assert not templates.known[hidden].any()
    far = [name.endswith("far") for name in names(WALKER, templates)]
    assert templates.known[far & ~hidden].mean() > 0.9


def test_refreshed_moves_by_the_stated_share_where_the_point_is_trusted():
    seen = np.full((2, 3, 3), 100.0)
    new = small([True] * 3).refreshed(seen, np.array([1.0, 0.5, 0.0]), 0.2, DARK)
    assert_allclose(new.colours, np.broadcast_to([[20.0], [10.0], [0.0]], (2, 3, 3)), atol=1e-12)
    assert new.known.all()


def test_refreshed_takes_what_comes_into_view_whole_and_leaves_what_stays_hidden():
    seen = np.full((2, 3, 3), 100.0)
    new = small([False, False, True]).refreshed(seen, np.array([0.3, 0.0, 0.0]), 0.2, DARK)
    assert_array_equal(new.colours[:, :, 0], [[100.0, 0.0, 0.0]] * 2)
    assert_array_equal(new.known, [True, False, True])


def test_refreshed_leaves_the_old_templates_as_they_were():
    old = small([True, False])
    old.refreshed(np.ones((2, 2, 3)), np.ones(2), 0.5, np.ones((1, 3)))
    assert not old.colours.any()
    assert not old.light.any()
    assert_array_equal(old.known, [True, False])


def test_refreshed_takes_over_the_light_of_a_link_that_is_in_fair_sight_and_of_no_other():
    known, trust = [True, True, True, False], np.array([0.5, 0.0, 0.0, 1.0])
    light = np.array([[7.0, -2.0, 3.0]])

    def lit(trust):
        return small(known).refreshed(np.zeros((2, 4, 3)), trust, 0.2, light).light

    # A sixth of what is known of it; what had never been seen before says nothing of the light there was.
    assert_array_equal(lit(trust), 0.0)
    assert_array_equal(lit(np.array([0.5, 0.5, 0.0, 1.0])), light[0])


def test_the_common_light_is_the_median_of_the_links_in_fair_sight_channel_by_channel():
    before = np.array([5.0, 6.0, 7.0])
    old = replace(small([True] * 10, np.repeat(np.arange(5), 2)), light=before)
    offset = np.array([[9.0, 1.0, 0.0], [11.0, 2.0, -9.0], [90.0, 3.0, 4.0], [-99.0, 50.0, 99.0], [99.0] * 3])
    trust = np.repeat([1.0, 0.25, 0.5, 0.15, 0.0], 2)  # the last two links are hardly in sight, or not at all
    assert_array_equal(old.refreshed(np.zeros((2, 10, 3)), trust, 0.2, offset).light, [11.0, 2.0, 0.0])
    assert_array_equal(old.refreshed(np.zeros((2, 10, 3)), np.zeros(10), 0.2, offset).light, before)


def test_templates_just_cut_have_their_own_light_and_those_that_lie_nobody_knows_where_are_unknown(levels):
    nowhere = np.array([link.name.endswith("far") for link in WALKER.links])
    templates = cut(WALKER, VIEW, STRIDE, levels, FULL, ~nowhere)
    whole = cut(WALKER, VIEW, STRIDE, levels, FULL)
    assert_array_equal(templates.known, whole.known & ~nowhere[templates.link])
    assert_array_equal(np.bincount(templates.link, templates.known) == 0.0, nowhere)
    assert_array_equal(templates.light, np.zeros(3))
