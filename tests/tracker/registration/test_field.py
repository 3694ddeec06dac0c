"""What a settled figure shows: the colours at its points, less the light of their links."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from dynamics.gaussian import Gaussian
from tests.kinematics.figures import WALKER
from tests.tracker.painted import FULL, STRIDE, VIEW, Painted, levels_of, placed
from tests.tracker.registration.planted import WEAK, of_links, settled, shown
from tracker.picture.pyramid import sample
from tracker.registration.templates import cut


def without(templates, *joints):
    """Templates that know nothing of some links."""
    return replace(templates, known=templates.known & ~of_links(templates, *joints))


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
