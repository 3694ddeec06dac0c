"""Templates: the pixels of each link, cut from a frame at a pose, in the link's own coordinates."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from dynamics.gaussian import Array, Flags, Ints
from kinematics.figure import Figure
from kinematics.spm import View, covering, skeleton, surface
from tracker.picture.pyramid import Level, Planes, sample
from tracker.registration.modes import mode_of
from tracker.settings import Settings

RIM_WEIGHT = 0.15  # weight of points on the rim; points within the outline have 1
FAIR = 0.2  # mean trust of a link's points from which its brightness offset counts


@dataclass(frozen=True)
class Templates:
    """P points fixed to links, with their colours at each blur.

    link, along, across : (P,) place of each point on its link, see `kinematics.spm.surface`
    weight  : (P,) 1 within the link's outline, less on its rim
    colours : (levels, P, 3) Lab grey levels
    known   : (P,) whether the point's colours are known
    light   : (3,) brightness offset of each channel, common to the links, grey levels
    """

    link: Ints
    along: Array
    across: Array
    weight: Array
    colours: Planes
    known: Flags
    light: Array

    @property
    def inner(self) -> Flags:
        """(P,) whether a point is known and within its link's outline."""
        return np.asarray((self.weight == 1.0) & self.known)

    def refreshed(self, seen: Array | Planes, trust: Array, blend: float, offset: Array) -> Self:
        """The templates blended with the present frame; unknown points take its colours entirely.

        Args:
            seen: (levels, P, 3) colours at the registered pose, less the brightness offsets.
            trust: (P,) 0 where the point is hidden, out of the frame or does not match, up to 1.
            blend: share of the present frame.
            offset: (L, 3) the brightness offsets that were subtracted.
        """
        share = np.where(self.known, blend * trust, np.where(trust > 0, 1.0, 0.0))
        colours = self.colours + share[None, :, None] * (seen - self.colours)
        number = np.bincount(self.link[self.known], minlength=len(offset))
        fair = np.bincount(self.link, trust * self.known, len(offset)) / np.maximum(number, 1)
        return replace(
            self,
            colours=colours.astype(np.float32),
            known=self.known | (trust > 0),
            light=np.median(offset[fair > FAIR], axis=0) if (fair > FAIR).any() else self.light,
        )

    def completed(self, figure: Figure, reach: float) -> Self:
        """The templates with the colours of a link that is wholly unknown copied from its twin, from points
        no farther off than `reach`."""
        place = np.stack([self.along * figure.layout.length[self.link], self.across], axis=1)
        colours, known = self.colours.copy(), self.known.copy()
        for i, twin in figure.twins.items():
            mine = np.flatnonzero(self.link == i)
            theirs = np.flatnonzero((self.link == twin) & self.known)
            if len(theirs) and not self.known[mine].any():
                apart = np.linalg.norm(place[mine, None] - place[theirs], axis=-1)
                near = apart.min(axis=1) <= reach
                colours[:, mine[near]] = self.colours[:, theirs[apart.argmin(axis=1)[near]]]
                known[mine[near]] = True
        return replace(self, colours=colours, known=known)


def cut(
    figure: Figure, view: View, q: Array, levels: list[Level], settings: Settings, placed: Flags | None = None
) -> Templates:
    """Templates of every link, cut from a frame at a pose; links that are not `placed` (L,) stay unknown."""
    link, along, across, weight = _grid(figure, settings)
    bones = skeleton(figure, q)
    points = surface(bones, link, along, across)
    pixels = view.to_pixels(points)
    hidden = covering(figure, bones, points, link, hiding(levels[-1], view, settings))
    found = [sample(level, pixels) for level in levels]
    colours = np.stack([values for values, _ in found]).astype(np.float32)
    known = found[0][1] & ~hidden
    if placed is not None:
        known &= placed[link]
    return Templates(link, along, across, weight, colours, known, np.zeros(3))


def hiding(level: Level, view: View, settings: Settings) -> float:
    """How far beyond its outline a link hides others at a blur, leg lengths."""
    return settings.cover * level.sigma / view.unit


def _grid(figure: Figure, settings: Settings) -> tuple[Ints, Array, Array, Array]:
    """Points spread evenly over every link and its rim."""
    rim = mode_of(settings).rim
    parts = []
    for i, part in enumerate(figure.links):
        tip = rim if i not in figure.parents else 0.0
        length = np.arange(0.0, part.length + tip + 1e-9, settings.spacing)
        half = part.half_width + rim
        width = np.arange(-half, half + 1e-9, settings.spacing)
        if abs(width).min() > 0.5 * part.width * min(1.0, part.taper):  # no row would lie in a thin link
            width = np.zeros(1)
        u, v = (grid.ravel() for grid in np.meshgrid(length, width, indexing="ij"))
        edge = 0.5 * part.width * (1.0 + (part.taper - 1.0) * np.clip(u / part.length, 0.0, 1.0))
        keep = np.abs(v) <= edge + rim
        weight = np.where((np.abs(v) <= edge) & (u <= part.length), 1.0, RIM_WEIGHT)
        parts.append((np.full(keep.sum(), i), u[keep] / part.length, v[keep], weight[keep]))
    link, along, across, weight = (np.concatenate(column) for column in zip(*parts, strict=True))
    return link.astype(np.intp), along, across, weight
