"""Which leg is nearer: where the legs overlap, the picture shows the grey level of the nearer one.

Places on either leg move with its links. The grey level of a place is known from the frames just before and
after in which the other leg does not cover it. Where the legs overlap, a pixel x shows a place of one, and

    e = min(|x - grey of the far leg|, MOST) - min(|x - grey of the near leg|, MOST)

is positive if the legs are named correctly; of the places that are as near as poses are exact, the one most
like x counts. The evidence is its mean over a film's frames in standard errors.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from kinematics.figure import Array, Figure, Flags
from kinematics.sides import exchanged, on_side
from kinematics.spm import Skeleton, skeleton
from tracker.often import often
from tracker.outline.doubt import in_standard_errors
from tracker.outline.shape import Shape
from tracker.outline.stage import Stage
from tracker.survey.evidence import NOTHING

LINKS = ("thigh", "shank")
ALONG = np.linspace(0.15, 0.95, 9)  # places along a link, shares of its length
ACROSS = np.linspace(-0.7, 0.7, 5)  # and across it, shares of its half width
FREE = 0.03  # distance from the other leg's outline beyond which a place is uncovered, leg lengths
AROUND = 1.5  # standard deviation of the weights of neighbouring frames in a grey level, at 30 a second
ENOUGH = 0.08  # share of that weight that frames with the place uncovered must have
MOST = 20.0  # largest difference that counts, grey levels; more is something else
SAME = 0.05  # largest distance of a place that a pixel may show, as poses are inexact, leg lengths
FEWEST = 8  # pixels that a frame needs to count
TOGETHER = 3.0  # number of neighbouring frames with correlated errors, at 30 a second


@dataclass(frozen=True)
class Leg:
    """Places (P,) on a leg in all frames.

    place  : (T, P, 2) body coordinates
    value  : (T, P) grey level in the frame there
    look   : (T, P) grey level of the leg itself; NaN where no neighbouring frame shows it
    shared : (T, P) whether the other leg covers the same place, which stands out from the scene
    """

    place: Array
    value: Array
    look: Array
    shared: Flags


def nearness(shape: Shape, q: Array, stage: Stage, hips: Array, units: Array, seen: Flags) -> float:
    """Evidence that the leg named near is in front, standard errors; negative if the far one is.

    Args:
        q: (T, D) poses.
        hips, units: as in `Stage.around`.
        seen: (T,) whether the outline is seen.
    """
    near, far = _legs(shape, q, stage, hips, units, seen)
    frames = [_evidence(near, far, t) for t in range(len(q))]
    means = np.array([each.mean() for each in frames if len(each) >= FEWEST])
    return in_standard_errors(means, TOGETHER * stage.often)


def near_leg(figure: Figure) -> list[int]:
    """The positions of the near thigh and shank among a figure's links."""
    names = [link.name for link in figure.links]
    return [i for i, name in enumerate(names) if on_side(name, "near") and name.startswith(LINKS)]


def _legs(shape: Shape, q: Array, stage: Stage, hips: Array, units: Array, seen: Flags) -> tuple[Leg, Leg]:
    """The legs named near and far in all frames."""
    near = near_leg(shape.figure)
    sides = near, exchanged([link.name for link in shape.figure.links])[near].tolist()
    bones, legs = skeleton(shape.figure, q), []
    for own, other in (sides, sides[::-1]):
        place = shape.places(bones, own, ALONG, ACROSS)
        depth = _depth(shape, bones, other, place)
        value = stage.at(stage.light, hips, units, place)
        out = seen[:, None] & (stage.at(stage.odds, hips, units, place, NOTHING) > NOTHING)
        look = _greys(value, out & (depth < -FREE), stage.fps)
        legs.append(Leg(place, value, look, out & (depth > 0.0)))
    return legs[0], legs[1]


def _evidence(near: Leg, far: Leg, t: int) -> Array:
    """(n,) evidence of each leg pixel of a frame that the legs are named rightly, grey levels."""
    return np.concatenate([_less_alike(near, far, t), -_less_alike(far, near, t)])


def _less_alike(own: Leg, other: Leg, t: int) -> Array:
    """(n,) by how much less the pixels at a leg's shared places in a frame look like the other leg."""
    places = np.flatnonzero(own.shared[t] & np.isfinite(own.look[t]))
    as_own, as_other = (_unlike(leg, t, own.place[t, places], own.value[t, places]) for leg in (own, other))
    known = np.isfinite(as_other)
    return np.asarray(np.minimum(as_other, MOST) - np.minimum(as_own, MOST))[known]


def _unlike(leg: Leg, t: int, places: Array, values: Array) -> Array:
    """(n,) least difference of values at places (n, 2) from a leg close to them; inf where none is."""
    near = np.square(places[:, None] - leg.place[t]).sum(-1) < SAME**2
    off = np.where(near, np.abs(values[:, None] - leg.look[t]), np.nan)
    return np.asarray(np.fmin.reduce(off, axis=1, initial=np.inf))


def _depth(shape: Shape, bones: Skeleton, links: list[int], places: Array) -> Array:
    """(T, P) depth of places (T, P, 2) within the outline of some links, leg lengths."""
    deepest = np.full(places.shape[:2], -np.inf)
    for link in links:
        first, last, start, tip, beside = shape.bars[link]
        off, length = places - bones.start[:, None, link], bones.length[:, None, link]
        u = np.einsum("tpk,tk->tp", off, bones.direction[:, link])
        v = np.einsum("tpk,tk->tp", off, bones.normal[:, link]) - beside * bones.size[:, None]
        nearest = np.clip(u, first * length, last * length)
        half = bones.size[:, None] * (start + (tip - start) * (nearest / length - first) / (last - first))
        deepest = np.maximum(deepest, half - np.hypot(u - nearest, v))
    return deepest


def _greys(value: Array, free: Flags, fps: float) -> Array:
    """(T, P) mean of the uncovered values (T, P) in neighbouring frames; NaN where there are too few."""
    sigma = AROUND * often(fps)
    reach = round(2.0 * sigma)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    enough = ENOUGH * weights.sum()
    over = np.ones(1), weights
    shares, values = free.astype(np.float64), np.where(free, value, 0.0)
    weight = cv2.sepFilter2D(shares, -1, *over, borderType=cv2.BORDER_CONSTANT)
    total = cv2.sepFilter2D(values, -1, *over, borderType=cv2.BORDER_CONSTANT)
    return np.where(weight > enough, total / np.maximum(weight, enough), np.nan)
