"""What points tell of a pose: nothing if hidden, and the share of them within the frame."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_array_equal

from dynamics.gaussian import Gaussian
from tests.kinematics.figures import WALKER, upright
from tests.tracker.painted import BARE, FULL, STRIDE, VIEW, Painted, freedoms
from tests.tracker.registration.planted import WEAK, registered
from tracker.loop.judging import LEAST_INSIDE

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


def test_of_half_a_figure_in_the_frame_half_the_points_are_inside(rng):
    view = replace(VIEW, origin=(90.0, 165.0))
    picture = Painted(rng, view=view).picture(STRIDE)
    _, found = registered(picture, picture, STRIDE, Gaussian(STRIDE, WEAK), FULL, view=view)
    assert LEAST_INSIDE < found.inside < 0.7
