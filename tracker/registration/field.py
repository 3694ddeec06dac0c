"""What poses are compared with in one frame, and where templates settled in it."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array
from kinematics.figure import Figure
from kinematics.spm import Index, View, covering, skeleton, surface
from tracker.picture.backdrop import UNSEEN, Scenery
from tracker.picture.pyramid import Level, sample, within
from tracker.registration.templates import Templates, hiding
from tracker.settings import Settings

STANDS_OUT = 0.7  # share of a link of an unknown look that must differ from the scene to be learned


@dataclass(frozen=True)
class Likelihood:
    """What was measured says of the pose, linearised once for each of H priors; any leading axes.

    q           : (H, D) where: a mode of the posterior
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
    """Where the templates settled in one frame, of one prior or, with a leading axis, of several.

    The cost is E (`tracker.registration.objective`), the information its Gauss-Newton matrix, tempered
    J'WJ / sigma^2 and the stiffness of the joints' limits; singular where nothing visible constrains q.

    misfit      : mean over the visible points of half the robust squared residual, in units of the noise
    shown       : share of the points within the outlines in the frame that nothing hides or covers
    match       : (P,) robust weight of each point without the rim's, 0 where not visible
    offset      : (L, 3) brightness offset of each link and channel, grey levels
    inside      : share of the points that lie in the part of the frame that was looked at
    pixels      : (P, 2) where the points settled
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
    """What poses are compared with in one frame.

    levels  : of the frame, coarse to fine, as many as the templates have colours for
    scenery : how much the frame differs from what lies behind the figure
    """

    templates: Templates
    levels: Sequence[Level]
    figure: Figure
    view: View
    settings: Settings
    scenery: Scenery = UNSEEN

    def seen(self, found: Registration) -> Array:
        """(levels, P, 3) what the frame shows where the points settled, the offsets of light taken off."""
        templates = self.templates
        shown = np.stack([sample(level, found.pixels)[0] for level in self.levels])
        offset = np.where(templates.strange[:, None], templates.light, found.offset)
        return np.asarray(shown - offset[templates.link])

    def new(self, found: Registration) -> NDArray[np.bool_]:
        """(P,) which points not known yet the frame shows, on links in full sight."""
        templates, pixels = self.templates, found.pixels
        links = self._in_sight(found) & ~templates.strange
        if templates.strange.any():
            # A link of an unknown look is where it stands out, if it hangs on one in sight.
            parents = np.array(self.figure.parents)
            links |= templates.strange & (parents >= 0) & links[parents] & self._standing_out(pixels)
        sought = np.flatnonzero(~templates.known & links[templates.link])
        sought = sought[self.in_part(pixels[sought]) & ~self.scenery.plain(pixels[sought])]
        new = np.zeros(len(templates.link), dtype=bool)
        new[sought[~self._hidden(found, sought)]] = True
        return new

    def in_part(self, pixels: Array) -> NDArray[np.bool_]:
        """Whether pixels (..., 2) lie in the part of the frame that is looked at."""
        level = self.levels[-1]
        return within(pixels - np.asarray(level.corner), level.planes.shape)

    def _hidden(self, found: Registration, sought: Index) -> NDArray[np.bool_]:
        """Whether a nearer link lies over some of the points."""
        templates, bones = self.templates, skeleton(self.figure, found.q)
        link = templates.link[sought]
        points = surface(bones, link, templates.along[sought], templates.across[sought])
        return covering(self.figure, bones, points, link, hiding(self.levels[-1], self.view, self.settings))

    def _standing_out(self, pixels: Array) -> NDArray[np.bool_]:
        """(L,) whether most of a link is known to differ from the scene."""
        out = self.in_part(pixels) & self.scenery.outstanding(pixels)
        return np.asarray(self._share(out, self.templates.weight == 1.0) >= STANDS_OUT)

    def _in_sight(self, found: Registration) -> NDArray[np.bool_]:
        """(L,) whether most of what is known of a link is seen, and matches."""
        seen = self.templates.known & (found.match > 0.0)
        match = np.bincount(self.templates.link, found.match * seen, len(self.figure.links))
        number = np.bincount(self.templates.link, seen, len(self.figure.links))
        fair = match >= self.settings.in_sight * np.maximum(number, 1.0)
        return np.asarray(fair & (self._share(seen, self.templates.known) > 0.5))

    def _share(self, those: NDArray[np.bool_], of: NDArray[np.bool_]) -> Array:
        """(L,) share of some points of each link."""
        link, L = self.templates.link, len(self.figure.links)
        return np.asarray(np.bincount(link, those & of, L) / np.maximum(np.bincount(link, of, L), 1.0))
