"""Arguments, buffers and results of registration's inner loop: template points, links, pictures, sums."""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array, Flags, Ints

Single = NDArray[np.float32]
FIRST = 1e-3  # damping at the beginning of a climb

# For H poses: q (H, D); their links' start, direction, length and size; moments, pull and cost of `Laid`.
Laying = tuple[Array, Array, Array, Array, Array, Array, Array, Array]


class Points(NamedTuple):
    """P template points, those of link l at first[l]:first[l + 1].

    first : (L + 1,); along, across, weight : (P,); colours : (P, 3); known : (P,); light : (3,)
    """

    first: Ints
    along: Array
    across: Array
    weight: Array
    colours: Single
    known: Flags
    light: Array


class Picture(NamedTuple):
    """The data with which poses are compared at one blur.

    planes    : (h, w, 3) the level's grey levels
    origin_x, origin_y, axis_x, axis_y : body coordinates to pixels of the planes, origin + axes * point
    differs   : loss of the scene without the figure at each place of the frame, half a robust square as in
                `Laid.mean`, with log(its sigma / the figure's)
    around    : its maximum over each place and the places around
    unknown   : value of `around` from which on the scene counts as unknown
    step      : pixels from one place to the next
    corner_x, corner_y, pixel : of the level, see `tracker.picture.pyramid.Level`
    """

    planes: Single
    origin_x: float
    origin_y: float
    axis_x: float
    axis_y: float
    differs: Single
    around: Single
    unknown: float
    step: int
    corner_x: float
    corner_y: float
    pixel: int


class Noise(NamedTuple):
    """Variance of a channel; largest distance of a brightness offset from the common one, grey levels;
    squared scale of the robust weight in units of the noise, inf for squared loss; mean loss from which a
    link is out of sight, and up to which it is in full sight; number of points below which a link has no
    offset of its own; whether nearer links hide farther ones, and how far beyond their outline, leg lengths;
    prior odds that something which looks like the scene without the figure covers a point; difference from
    the scene below which a point shows it."""

    variance: float
    light: float
    scale: float
    out_of_sight: float
    in_sight: float
    fewest: int
    layered: bool
    margin: float
    covered: float
    alike: float


class Row(NamedTuple):
    """The comparison at the n visible points of one link, in arrays that a processor takes at once.

    point : (n,) position in `Points`; place : (3, n) u, v and weight; residual, along, across : (3, n) by
    channel, the latter slopes along the link and across; excess : (n,) squared residual in units of the
    robust scale; match : (n,) robust weight; differs, around : (n,) as in `Picture`; `around` is inf where it
    is unknown or too large to matter; clear : (n,) 1 within the outline, less where the scene may cover it, 0
    on the rim
    """

    point: Ints
    place: Array
    residual: Single
    along: Single
    across: Single
    excess: Array
    match: Array
    differs: Array
    around: Array
    clear: Array


class Laid(NamedTuple):
    """Results of the comparison at H poses.

    moments  : (H, L, 5, 5) sum of weight * match * f f'
    pull     : (H, L, 5) sum of weight * match * f residual
    cost     : (H,) sum of weight * loss over the visible points, faded link by link, less weight * differs
    bare     : (H, L) how much better the scene explains the link's inner points than the template, where they
               show it: mean over all of them, in units of rho / 2
    mean     : (H,) mean over the visible points of half the robust squared residual, in units of the noise;
               minus the log of the mixture of two likelihoods where the scene may cover a point
    shown    : (H,) share of the points within the links' outlines that are visible and not covered
    match    : (H, P) robust weight, 0 where not visible
    offset   : (H, L, 3) grey levels
    inside   : (H, P) whether the point lies in the frame
    """

    moments: Array
    pull: Array
    cost: Array
    bare: Array
    mean: Array
    shown: Array
    match: Array
    offset: Array
    inside: Flags


class Weights(NamedTuple):
    """Weights with which the links' sums and joint limits add up to E of `tracker.registration.objective`.

    lost, pulled : nats for a unit of the links' cost, and of their pull and moments
    low, high    : (D,) the limits
    stiffness    : per radian squared, beyond them
    """

    lost: float
    pulled: float
    low: Array
    high: Array
    stiffness: float


class Climbs(NamedTuple):
    """H climbs in parallel, each with two rows of the fit: 2 h and 2 h + 1.

    own     : (H,) row of the best pose so far; the other row, own ^ 1, holds the tried pose
    on      : (H,) whether a climb is unfinished
    cost    : (H,) of the best pose, nats
    damping : (H,)
    """

    own: Ints
    on: Flags
    cost: Array
    damping: Array

    @classmethod
    def begin(cls, H: int) -> Self:
        """Climbs without a best pose yet, whose even rows are tried first."""
        odd = 2 * np.arange(H) + 1
        return cls(odd, np.ones(H, bool), np.full(H, np.inf), np.full(H, FIRST))
