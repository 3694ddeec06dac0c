"""The data of one frame with which poses are compared, and the result of registration in it."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from dynamics.gaussian import Array, Flags, Ints
from kinematics.figure import Figure
from kinematics.spm import View, covering, skeleton, surface
from tracker.picture.backdrop import UNSEEN, Scenery
from tracker.picture.pyramid import Level, sample, within
from tracker.registration.templates import Templates, hiding
from tracker.settings import Settings

STANDS_OUT = 0.7  # share of a link without a template that must differ from the scene to learn one


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
        templates = self.templates
        shown = np.stack([sample(level, found.pixels)[0] for level in self.levels])
        offset = np.where(templates.strange[:, None], templates.light, found.offset)
        return np.asarray(shown - offset[templates.link])

    def new(self, found: Registration) -> Flags:
        """(P,) which unknown points the frame shows, on links mostly in sight."""
        templates, pixels = self.templates, found.pixels
        links = self._in_sight(found) & ~templates.strange
        if templates.strange.any():
            # A link without a template is located if it stands out and its parent is in sight.
            parents = np.array(self.figure.parents)
            links |= templates.strange & (parents >= 0) & links[parents] & self._standing_out(pixels)
        sought = np.flatnonzero(~templates.known & links[templates.link])
        sought = sought[self.in_part(pixels[sought]) & ~self.scenery.plain(pixels[sought])]
        new = np.zeros(len(templates.link), dtype=bool)
        new[sought[~self._hidden(found, sought)]] = True
        return new

    def in_part(self, pixels: Array) -> Flags:
        """Whether pixels (..., 2) lie in the searched part of the frame."""
        level = self.levels[-1]
        return within(pixels - np.asarray(level.corner), level.planes.shape)

    def _hidden(self, found: Registration, sought: Ints) -> Flags:
        """Whether a nearer link covers each of the chosen points."""
        templates, bones = self.templates, skeleton(self.figure, found.q)
        link = templates.link[sought]
        points = surface(bones, link, templates.along[sought], templates.across[sought])
        return covering(self.figure, bones, points, link, hiding(self.levels[-1], self.view, self.settings))

    def _standing_out(self, pixels: Array) -> Flags:
        """(L,) whether most of a link is known to differ from the scene."""
        out = self.in_part(pixels) & self.scenery.outstanding(pixels)
        return np.asarray(self._share(out, self.templates.weight == 1.0) >= STANDS_OUT)

    def _in_sight(self, found: Registration) -> Flags:
        """(L,) whether most known points of a link are seen and match."""
        seen = self.templates.known & (found.match > 0.0)
        match = np.bincount(self.templates.link, found.match * seen, len(self.figure.links))
        number = np.bincount(self.templates.link, seen, len(self.figure.links))
        fair = match >= self.settings.in_sight * np.maximum(number, 1.0)
        return np.asarray(fair & (self._share(seen, self.templates.known) > 0.5))

    def _share(self, those: Flags, of: Flags) -> Array:
        """(L,) share of the points `of` of each link that are among `those`."""
        link, L = self.templates.link, len(self.figure.links)
        return np.asarray(np.bincount(link, those & of, L) / np.maximum(np.bincount(link, of, L), 1.0))
