"""What points tell of a pose: nothing if hidden, out of the frame or unknown, little if they do not match."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian
from kinematics.spm import joints
from tests.kinematics.figures import WALKER, upright
from tests.tracker.painted import BARE, FULL, SIZE, STRIDE, VIEW, Painted, freedoms, levels_of
from tests.tracker.registration.planted import MOTIONS, WEAK, D, moved, of_links, registered, settled
from tracker.loop.judging import LEAST_INSIDE
from tracker.picture.backdrop import UNKNOWN, Scenery
from tracker.picture.pyramid import Level
from tracker.registration.templates import cut

# Near leg so broad, and far leg so close behind it, that no point of the far leg shows.
BROAD = replace(
    WALKER,
    links=tuple(
        replace(link, width=0.7, taper=1.0) if link.name.endswith("_near") else link for link in WALKER.links
    ),
)
BEHIND = upright(BROAD, hip_near=0.1, hip_far=0.2, knee_far=0.2, ankle_far=0.5)
FAR_FREEDOMS = ("hip_far", "knee_far", "ankle_far", "thigh_far", "shank_far")


def flat_level(sigma=1.0):
    """A level of one colour."""
    width, height = SIZE
    return Level(np.full((height, width, 3), 128.0, np.float32), (0, 0), sigma)


def spoiled_templates(level, q, rng, settings, scale=7.0):
    templates = cut(WALKER, VIEW, q, [level], settings)
    colours = templates.colours + rng.normal(scale=scale, size=templates.colours.shape)
    return replace(templates, colours=colours.astype(np.float32), known=np.ones(len(colours[0]), bool))


def sight(templates, found):
    """Points that are seen within the outline, and what share they are of those that are known."""
    inner = (templates.weight == 1.0) & templates.known
    seen = inner & (found.match > 0)
    return seen, seen.sum() / inner.sum()


def visible_weight(templates, found):
    return templates.weight[found.match > 0].sum()


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
