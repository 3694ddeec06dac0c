"""What registration's inner loop takes, works on and gives: template points, links, pictures, their sums."""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Single = NDArray[np.float32]

# Of H poses: q (H, D); their links' start, direction, length and size; moments, pull and cost of `Laid`.
Laying = tuple[Array, Array, Array, Array, Array, Array, Array, Array]


class Points(NamedTuple):
    """P template points, those of link l at first[l]:first[l + 1].

    first : (L + 1,); along, across, weight : (P,); colours : (P, 3); known : (P,); light : (3,)
    """

    first: NDArray[np.intp]
    along: Array
    across: Array
    weight: Array
    colours: Single
    known: NDArray[np.bool_]
    light: Array


class Shape(NamedTuple):
    """What of the links hides others: layer, width and taper (L,)."""

    layer: NDArray[np.intp]
    width: Array
    taper: Array


class Picture(NamedTuple):
    """What poses are laid on at one blur.

    planes    : (h, w, 3) the level's grey levels
    origin_x, origin_y, axis_x, axis_y : body coordinates to pixels of the planes, origin + axes * point
    differs   : what the scene without the figure costs at each place of the frame, as half the robust
                square of `Laid.mean`, with log(its sigma / the figure's)
    around    : the most of it there and around
    unknown   : from where on that tells nothing
    step      : pixels from one place to the next
    corner_x, corner_y : the level's corner in the frame, pixels
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
    corner_x: int
    corner_y: int


class Noise(NamedTuple):
    """variance of a channel; how far an offset of light may be from the common one, grey levels; scale
    (squared, in the noise's units) of the robust weight, inf for plain squares; mean loss from which a link
    is out of sight, and up to which it is in full sight; how few points have no offset of light of their own;
    whether nearer links hide farther ones, and how far beyond their outline, leg lengths; prior odds that a
    point is covered by what was seen there without the figure."""

    variance: float
    light: float
    scale: float
    out_of_sight: float
    in_sight: float
    fewest: int
    layered: bool
    margin: float
    covered: float


class Row(NamedTuple):
    """What the n visible points of one link see, side by side, so that a processor takes several at a time.

    point : (n,) position in `Points`; place : (3, n) u, v and weight; residual, along, across : (3, n) by
    channel, the latter slopes along the link and across; excess : (n,) squared residual in units of the
    robust scale; match : (n,) robust weight; differs, around : (n,) what the scene without the figure costs,
    there, and at most there and around; the latter is inf where that is not known or too much to tell;
    clear : (n,) 1 within the outline, less by what the scene may cover, 0 on the rim
    """

    point: NDArray[np.intp]
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
    """H poses laid on a picture.

    moments  : (H, L, 5, 5) sum of weight * match * f f'
    pull     : (H, L, 5) sum of weight * match * f residual
    cost     : (H,) sum of weight * loss over the visible points, faded link by link, less weight * differs
    mean     : (H,) mean over the visible points of half the robust squared residual, in units of the noise;
               of what the scene may cover, minus log of the mixture of the two likelihoods
    shown    : (H,) share of the points within the links' outlines that are visible and not covered
    match    : (H, P) robust weight, 0 where not visible
    offset   : (H, L, 3) grey levels
    inside   : (H, P) whether the point lies in the frame
    """

    moments: Array
    pull: Array
    cost: Array
    mean: Array
    shown: Array
    match: Array
    offset: Array
    inside: NDArray[np.bool_]


class Weights(NamedTuple):
    """How what is measured of links and joint limits add up to E of `tracker.registration.objective`.

    lost, pulled : nats of a unit of the links' cost, and of their pull and moments
    low, high    : (D,) the limits
    stiffness    : per radian squared, beyond them
    """

    lost: float
    pulled: float
    low: Array
    high: Array
    stiffness: float


class Damping(NamedTuple):
    """Of Levenberg-Marquardt: at first, and beyond which no step helps; a climb ends with a step or gain as
    small as these, radians or leg lengths and nats; the longest step."""

    first: float
    heaviest: float
    small_step: float
    small_gain: float
    longest: float


class Climbs(NamedTuple):
    """H climbs side by side, each with two rows of what is laid out: 2 h and 2 h + 1.

    own     : (H,) the row of the best pose so far; the other one, own ^ 1, is tried
    on      : (H,) whether a climb goes on
    cost    : (H,) of the best pose, nats
    damping : (H,)
    """

    own: NDArray[np.intp]
    on: NDArray[np.bool_]
    cost: Array
    damping: Array

    @classmethod
    def begin(cls, H: int, damping: Damping) -> Self:
        """Climbs of which nothing is known yet, that try their even rows first."""
        odd = 2 * np.arange(H) + 1
        return cls(odd, np.ones(H, bool), np.full(H, np.inf), np.full(H, damping.first))
