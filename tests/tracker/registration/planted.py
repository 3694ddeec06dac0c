"""A painted walker that moved by a known amount, and where registration settles from a prior."""

import numpy as np

from dynamics.gaussian import Gaussian
from tests.kinematics.figures import WALKER, upright
from tests.tracker.painted import FULL, SIZE, STRIDE, VIEW, levels_of
from tracker.picture.backdrop import UNSEEN, Scenery
from tracker.registration.align import align
from tracker.registration.field import Field, Registration
from tracker.registration.templates import cut

D = len(WALKER.freedoms)

# A prior so weak that it leans on nothing the picture tells: 0.2 legs, 17 degrees, 5 % of length.
POSED = len(WALKER.pose_freedoms)
WEAK = np.diag(np.r_[0.2, 0.2, np.full(POSED - 2, 0.3), np.full(D - POSED, 0.05)] ** 2)


SQUARE = 5  # side of a square of the chequered scene, pixels of the coarsest level


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


def moved(**by):
    return STRIDE + upright(WALKER, **by)


MOTIONS = {
    "3 px aside, 2 px up": moved(root_x=3 / 80, root_y=2 / 80),
    "near leg 4 degrees ahead": moved(hip_near=0.07, knee_near=-0.05),
    "far leg 4 degrees back": moved(hip_far=-0.07, knee_far=0.04),
    "trunk and head": moved(torso=0.06, neck=-0.07),
    "3 percent nearer": moved(scale=0.03),
    "longer shanks": moved(stretch_shank_near=0.05, stretch_shank_far=0.04),
    "everything": moved(root_x=0.03, torso=0.03, neck=0.04, hip_near=0.05, knee_near=-0.06, hip_far=-0.06),
}


def chequered(rng):
    """What lies behind the figure differs by 0 here and 2 there."""
    width, height = SIZE
    differs = 2.0 * rng.integers(0, 2, (-(-height // SQUARE), -(-width // SQUARE)))
    return Scenery(differs.astype(np.float32), SQUARE)
