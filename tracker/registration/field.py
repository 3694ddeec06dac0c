"""The data of one frame with which poses are compared, and the result of registration in it."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from dynamics.gaussian import Array
from kinematics.figure import Figure
from kinematics.spm import View
from tracker.picture.backdrop import UNSEEN, Scenery
from tracker.picture.pyramid import Level, sample
from tracker.registration.templates import Templates
from tracker.settings import Settings


@dataclass(frozen=True)
class Likelihood:
    """The likelihood of the pose, linearised once for each of H priors; any leading axes.

    q           : (H, D) the point of linearisation, a mode of the posterior
    information : (H, D, D)
    vector      : (H, D) information times the linearised likelihood's own mode
    cost        : (H,) minus the log likelihood at q, nats
    """

    q: Array
    information: Array
    vector: Array
    cost: Array


@dataclass(frozen=True)
class Registration(Likelihood):
    """Result of registration in one frame, for one prior or, with a leading axis, for several.

    The cost is E (`tracker.registration.objective`), the information its Gauss-Newton matrix, tempered
    J'WJ / sigma^2 and the stiffness of the joints' limits; singular where nothing visible constrains q.

    misfit      : mean over the visible points of half the robust squared residual, in units of the noise
    shown       : share of the points within the outlines and the frame that are neither hidden nor covered
    match       : (P,) robust weight of each point, without the weight of the rim; 0 where not visible
    offset      : (L, 3) brightness offset of each link and channel, grey levels
    inside      : share of the points that lie in the searched part of the frame
    pixels      : (P, 2) places of the points
    """

    misfit: Array
    shown: Array
    match: Array
    offset: Array
    inside: Array
    pixels: Array

    def __getitem__(self, number: int) -> "Registration":
        return Registration(*(getattr(self, each.name)[number] for each in fields(self)))


@dataclass(frozen=True)
class Field:
    """The data of one frame with which poses are compared.

    levels  : of the frame, coarse to fine, one for each blur of the templates
    scenery : how much the frame differs from the scene behind the figure
    """

    templates: Templates
    levels: Sequence[Level]
    figure: Figure
    view: View
    settings: Settings
    scenery: Scenery = UNSEEN

    def seen(self, found: Registration) -> Array:
        """(levels, P, 3) grey levels of the frame at the registered points, less the brightness offsets."""
        shown = np.stack([sample(level, found.pixels)[0] for level in self.levels])
        return np.asarray(shown - found.offset[self.templates.link])
