"""What points tell of a pose: nothing if hidden, out of the frame or unknown."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from dynamics.gaussian import Gaussian
from tests.kinematics.figures import WALKER, upright
from tests.tracker.painted import BARE, FULL, SIZE, STRIDE, VIEW, Painted, freedoms, levels_of
from tests.tracker.registration.planted import MOTIONS, WEAK, D, moved, of_links, registered, settled
from tracker.loop.judging import LEAST_INSIDE
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


def share_in_sight(templates, found):
    """Of the known points within the outline."""
    return (found.match[(templates.weight == 1.0) & templates.known] > 0).mean()


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


@pytest.mark.parametrize(("scale", "sign"), [(3.0, -1.0), (25.0, 1.0)], ids=["matching", "not matching"])
def test_points_that_a_pose_hides_speak_neither_for_it_nor_against_it(scale, sign, rng):
    level = Level(np.full((*SIZE[::-1], 3), 128.0, np.float32), (0, 0), 1.0)
    settings = FULL.model_copy(update={"out_of_sight": 0.0, "in_sight": 1e-6})
    templates = cut(WALKER, VIEW, STRIDE, [level], settings)
    colours = (templates.colours + rng.normal(scale=scale, size=templates.colours.shape)).astype(np.float32)
    templates = replace(templates, colours=colours, known=np.ones(len(templates.link), bool))
    crossed = upright(WALKER, hip_near=0.1, hip_far=0.1)
    open_pose, hiding = (
        settled(templates, [level], Gaussian(q, 1e-12 * WEAK), settings) for q in (STRIDE, crossed)
    )
    assert share_in_sight(templates, hiding) < 0.9 * share_in_sight(templates, open_pose)
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
