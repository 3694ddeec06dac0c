"""What points tell of a pose: nothing if hidden, and the share of them within the frame."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from dynamics.gaussian import Gaussian
from kinematics.spm import skeleton, surface
from tests.kinematics.figures import WALKER, upright
from tests.tracker.painted import BARE, FULL, SIZE, STRIDE, VIEW, Painted, freedoms, levels_of
from tests.tracker.registration.planted import WEAK, of_links, registered, settled
from tracker.loop.judging import LEAST_INSIDE
from tracker.picture.backdrop import UNKNOWN, Scenery
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


@pytest.mark.parametrize("noise", [40.0, 60.0])
def test_a_shank_where_the_scene_is_shown_measures_nothing_though_some_of_it_matches(noise, rng):
    """A shrub that looks about like trousers stands before the near shank and foot."""
    painted, settings = Painted(rng), FULL.model_copy(update={"rim": 0.0})
    templates = cut(WALKER, VIEW, STRIDE, levels_of(painted.picture(STRIDE), settings), settings)
    shank = of_links(templates, "near_ankle", "near_toe")
    bones = skeleton(WALKER, STRIDE)
    places = VIEW.to_pixels(surface(bones, templates.link, templates.along, templates.across))[shank]
    (x0, y0), (x1, y1) = (places.min(0) - 4.0).astype(int), (places.max(0) + 4.0).astype(int)
    image = painted.picture(STRIDE).astype(float)
    image[y0:y1, x0:x1] += rng.normal(0.0, noise, image[y0:y1, x0:x1].shape)
    levels = levels_of(np.clip(image, 0, 255).astype(np.uint8), settings)
    knee, hip = WALKER.index("knee_near"), WALKER.index("hip_near")
    told = []
    for shown in (False, True):
        differs = np.full(SIZE[::-1], UNKNOWN, np.float32)
        differs[y0:y1, x0:x1] = 0.05 if shown else UNKNOWN
        prior = Gaussian(STRIDE, 1e-4 * WEAK)
        found = settled(templates, levels, prior, settings, scenery=Scenery(differs, 1))
        told.append(np.diag(found.information)[[knee, hip]])
    assert told[0][0] > 100.0
    assert told[1][0] < 0.02 * told[0][0]
    assert told[1][1] > 100.0  # the thigh is seen


def test_of_half_a_figure_in_the_frame_half_the_points_are_inside(rng):
    view = replace(VIEW, origin=(90.0, 165.0))
    picture = Painted(rng, view=view).picture(STRIDE)
    _, found = registered(picture, picture, STRIDE, Gaussian(STRIDE, WEAK), FULL, view=view)
    assert LEAST_INSIDE < found.inside < 0.7
