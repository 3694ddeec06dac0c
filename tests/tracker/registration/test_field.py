"""What a settled figure shows: the colours at its points, and which points are seen for the first time."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian
from tests.kinematics.figures import WALKER, upright
from tests.tracker.painted import FULL, SIZE, STRIDE, VIEW, Painted, covered, levels_of, placed
from tests.tracker.registration.planted import WEAK, chequered, moved, of_links, settled, shown
from tracker.picture.backdrop import MOST, UNKNOWN, UNSEEN, Scenery, first_backdrop
from tracker.picture.pyramid import sample
from tracker.registration.field import Field
from tracker.registration.templates import cut


def known_scene(painted, image):
    """How a picture differs from the painted background, which is known everywhere."""
    beside, whole = (-9.0, -9.0, -1.0, -1.0), (0.0, 0.0, SIZE[0] - 1.0, SIZE[1] - 1.0)
    empty = painted.picture(moved(root_x=9.0))
    return first_backdrop(empty, beside, VIEW.unit).follow(image, whole, np.zeros(2)).scenery


def without(templates, *joints):
    """Templates that know nothing of some links."""
    return replace(templates, known=templates.known & ~of_links(templates, *joints))


OPEN = FULL.model_copy(update={"cover": 0.0, "covered": 0.0})  # nothing hidden beyond an outline, or covered


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
