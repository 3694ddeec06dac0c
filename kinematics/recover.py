"""A pose from joint positions: clicked in a start frame, or projected from motion capture.

The start pose also sets what the figure's TOML leaves open: how long this person's links are, how many
pixels a leg is, and which way the figure faces.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kinematics.figure import Array, Figure, Flags
from kinematics.figure_file import WALKER
from kinematics.spm import View

Marks = Mapping[str, tuple[float, float]]

STRAIGHT = 0.02  # leg lengths by which the knee of a straight leg may seem off the line: error of marks
FORESHORTENED = 0.75  # share of its twin's length; feet marked square to the camera differ by less


class PoseError(ValueError):
    """The marked joints do not make a pose."""


@dataclass(frozen=True)
class Start:
    """Figure, view and pose as a marked frame gives them.

    figure : with this person's rest lengths
    view   : where and how large it stands in the picture
    q      : (D,) the marked pose; scale zero
    known  : (D,) whether each freedom was marked; the others were assumed
    hidden : joints whose place was guessed, as something hides them
    foreshortened : links turned towards or away from the camera, whose length is unknown
    """

    figure: Figure
    view: View
    q: Array
    known: Flags
    hidden: frozenset[str] = frozenset()
    foreshortened: frozenset[str] = frozenset()


def start_pose(figure: Figure, marks: Marks, facing: int) -> Start:
    """Figure, view and pose from the joints of one frame.

    A link whose tip is not marked takes its twin's length (names that differ in near/far only), and where
    neither is marked the rest proportions. Twins have one rest length: their difference in a frame, due to
    foreshortening and errors of the marks, becomes stretch. A foot, which does not stretch, takes its twin's
    length if it looks much shorter.

    Args:
        marks: pixel of each marked joint; one without a finite position counts as missing.
        facing: +1 right, -1 left.

    Raises:
        PoseError: a required joint is missing, or two joints coincide.
        ValueError: the figure does not say which links make a leg.
    """
    if not figure.leg:
        raise ValueError(f"figure {figure.name!r} has no leg to measure in; list its links under leg")
    pixels = positions(marks)
    _check_complete(figure, marks, pixels)
    lengths = _link_lengths(figure, pixels)
    foreshortened = _foreshortened(figure, lengths)
    for i in foreshortened:
        lengths[i] = lengths[figure.twins[i]]
    leg = _leg_length(figure, lengths)
    x, y = pixels[figure.base].tolist()
    view = View(origin=(x, y), unit=leg, facing=facing)
    fitted = figure.with_lengths([length / leg for length in lengths])
    places = met(fitted, {name: view.to_body(point) for name, point in pixels.items()})
    q, known = recover(fitted, places)
    figure, q = _evened(fitted, q)
    names = frozenset(figure.links[i].name for i in foreshortened)
    return Start(figure, view, q, known, foreshortened=names)


def recover(figure: Figure, points: Mapping[str, Array]) -> tuple[Array, Flags]:
    """The pose q (D,), scale and stretches zero, whose links point the way the joints lie; and (D,) whether
    each freedom was seen.

    `points` holds (2,) body coordinates of the known joints, with the base. A link with an unknown tip or
    start takes the angle nearest zero that its limits allow.
    """
    q, known = np.zeros(len(figure.freedoms)), np.ones(len(figure.freedoms), dtype=bool)
    q[:2] = points[figure.base]
    angle = np.zeros(len(figure.links))
    for i, (link, parent) in enumerate(zip(figure.links, figure.parents, strict=True)):
        angle[i] = link.rest + (angle[parent] if parent >= 0 else 0.0)
        along = span(figure, i, points)
        if link.breathes:
            known[figure.layout.stretch[i]] = along is not None
        if link.freedom is None:
            continue
        column = figure.index(link.freedom)
        known[column] = along is not None
        if along is None:
            q[column] = np.clip(0.0, *link.limits)
        else:
            # Of the turns that differ by whole circles, the one nearest to the middle of the limits.
            middle = 0.5 * (link.limits[0] + link.limits[1])
            turn = link.sense * (np.arctan2(along[1], along[0]) - angle[i])
            q[column] = middle + (turn - middle + np.pi) % (2.0 * np.pi) - np.pi
        angle[i] += link.sense * q[column]
    return q, known


def met(figure: Figure, points: Mapping[str, Array]) -> dict[str, Array]:
    """The known joints, (2,) body coordinates, and unknown ones between links whose far ends are known.

    Of the two possible places, the one in which the joint bends as its limits allow. If the links are too
    short or too long to meet, the joint lies on the line through their far ends.
    """
    places = dict(points)
    for j, link in enumerate(figure.links):
        i = figure.parents[j]
        if i < 0 or link.at < 1.0 or not (link.breathes and figure.links[i].breathes):
            continue
        middle, start, tip = figure.links[i].joint, _start_point(figure, i, places), places.get(link.joint)
        if middle not in places and start is not None and tip is not None:
            places[middle] = _elbow(start, tip, (figure.links[i].length, link.length), _bend(figure, j))
    return places


def _elbow(start: Array, tip: Array, lengths: tuple[float, float], side: float) -> Array:
    """(2,) where a link from `start` meets one to `tip`: +1 bends the second anticlockwise, -1 clockwise."""
    way = tip - start
    apart = max(float(np.hypot(*way)), 1e-9)
    first, second = lengths
    along = np.clip((apart**2 + first**2 - second**2) / (2.0 * apart), -first, first)
    across = -side * np.sqrt(first**2 - along**2)
    normal = np.array([-way[1], way[0]])
    return np.asarray(start + (along * way + across * normal) / apart)


def _bend(figure: Figure, i: int) -> float:
    """Direction in which its limits let a link bend: +1 anticlockwise (x forward, y up), -1 clockwise."""
    link = figure.links[i]
    return 1.0 if np.sin(link.rest + link.sense * sum(link.limits) / 2.0) >= 0.0 else -1.0


def span(figure: Figure, i: int, points: Mapping[str, Array]) -> Array | None:
    """(2,) from the start of link i to its tip; None where one of the two is not known."""
    start, tip = _start_point(figure, i, points), points.get(figure.links[i].joint)
    return None if start is None or tip is None else tip - start


def facing_of(marks: Marks, later: Marks | None = None, figure: Figure = WALKER) -> int:
    """Which way the figure faces: +1 right, -1 left.

    From its pairs of joints that lie ahead of each other (toes) if all are marked, else from middle joints of
    bent legs (knees) if all are marked, else from the marked pairs, else from the movement of the base,
    else from a bend that is slight or of one leg only. Right if nothing shows it.
    """
    seen, base = positions(marks), figure.base
    toes, clear, toe, bend = _votes(seen, figure)
    after = positions(later or {})
    travel = after[base][0] - seen[base][0] if base in seen and base in after else 0.0
    votes = [vote for vote in (toes, clear, toe, travel, bend) if vote != 0.0]
    return 1 if not votes or votes[0] > 0 else -1


def facing_told(marks: Marks, figure: Figure = WALKER) -> bool:
    """Whether the marks of one frame show reliably which way the figure faces.

    Also true for a figure without joints that lie ahead and without bending legs, where no mark could.
    """
    toes, clear, _, _ = _votes(positions(marks), figure)
    nothing = not figure.ahead and all(len(leg) < 2 for leg in figure.legs)
    return nothing or toes != 0.0 or clear != 0.0


def _votes(seen: Mapping[str, Array], figure: Figure) -> tuple[float, float, float, float]:
    """Four votes, positive for facing right, 0 for none: all toes, all bent legs, any toes, any legs."""
    ways = [
        float(np.sign(seen[tip][0] - seen[start][0]))
        for start, tip in figure.ahead
        if {start, tip} <= seen.keys()
    ]
    # One foot alone may mislead: pushing off it points down, and its toe may lie behind its ankle. So may one
    # leg, which bends little where it stands.
    toes, toe = (sum(ways), 0.0) if len(ways) == len(figure.ahead) else (0.0, sum(ways))
    bends = [_bent_ahead(figure, leg, seen) for leg in figure.legs]
    clear = sum(bends) if all(bends) and abs(sum(bends)) > STRAIGHT else 0.0
    return toes, clear, toe, sum(bends)


def positions(marks: Marks) -> dict[str, Array]:
    """Pixel (2,) of every mark with a finite position, by name."""
    points = {name: np.asarray(point, dtype=np.float64) for name, point in marks.items()}
    return {name: point for name, point in points.items() if np.isfinite(point).all()}


def _bent_ahead(figure: Figure, leg: Sequence[int], seen: Mapping[str, Array]) -> float:
    """How far a leg's first joint lies off the line from its start to its second, positive for facing right.

    As a share of that line's length; 0 if one of the three is unknown or the leg has a single link.
    """
    if len(leg) < 2:
        return 0.0
    ends = [_start_point(figure, leg[0], seen), *(seen.get(figure.links[i].joint) for i in leg[:2])]
    hip, knee, ankle = (np.full(2, np.nan) if end is None else end for end in ends)
    line, thigh = ankle - hip, knee - hip
    share = np.clip(thigh[1] / max(line[1], 1e-9), 0.0, 1.0)
    ahead = float((thigh[0] - share * line[0]) / max(np.hypot(*line), 1e-9))
    return 0.0 if np.isnan(ahead) else -_bend(figure, leg[1]) * ahead


def _check_complete(figure: Figure, marks: Marks, pixels: Mapping[str, Array]) -> None:
    needed = figure.needed
    for name in needed:
        if name not in marks:
            raise PoseError(f"the start pose lacks {name}; mark {', '.join(needed)} at least")
        if name not in pixels:
            raise PoseError(f"the start pose has no position for {name}; mark it again")


def _start_point(figure: Figure, i: int, points: Mapping[str, Array]) -> Array | None:
    """Where link i starts, if that is known."""
    parent, at = figure.parents[i], figure.links[i].at
    if parent < 0:
        return points.get(figure.base)
    tip = points.get(figure.links[parent].joint)
    if at == 1.0:
        return tip
    start = _start_point(figure, parent, points)
    if at == 0.0:
        return start
    return None if tip is None or start is None else at * tip + (1.0 - at) * start


def _link_lengths(figure: Figure, pixels: Mapping[str, Array]) -> list[float]:
    """(L,) pixels: the measured length, else the twin's, else the rest length at the scale of the others."""
    seen: dict[str, float] = {}
    for i, link in enumerate(figure.links):
        along = span(figure, i, pixels)
        if along is not None:
            length = float(np.linalg.norm(along))
            if length < 1.0:
                raise PoseError(f"{link.joint} lies on the joint before it; mark the two apart")
            seen[link.name] = length
    if not seen:
        raise PoseError("no limb has both its ends marked; mark one at least")
    scale = sum(seen.values()) / sum(link.length for link in figure.links if link.name in seen)
    names = [link.name for link in figure.links]
    either = {names[twin]: seen[names[i]] for i, twin in figure.twins.items() if names[i] in seen} | seen
    return [either.get(link.name, scale * link.length) for link in figure.links]


def _foreshortened(figure: Figure, lengths: Sequence[float]) -> list[int]:
    """Positions of the links that cannot stretch and look much shorter than their twin, from lengths (L,)."""
    return [
        i
        for i, twin in figure.twins.items()
        if not figure.links[i].breathes and lengths[i] < FORESHORTENED * lengths[twin]
    ]


def _evened(figure: Figure, q: Array) -> tuple[Figure, Array]:
    """The figure with breathing twins of one length, and the pose (D,) whose stretches undo the change."""
    layout = figure.layout
    log, twin = np.log(layout.length), np.arange(len(figure.links))
    for i, other in figure.twins.items():
        if figure.links[i].breathes and figure.links[other].breathes:
            twin[i] = other
    even, q = 0.5 * (log + log[twin]), q.copy()
    q[layout.stretch[layout.breathes]] = (log - even)[layout.breathes]
    return figure.with_lengths(np.exp(even).tolist()), q


def _leg_length(figure: Figure, lengths: list[float]) -> float:
    """A leg's length in pixels, the mean over the legs, of the links' lengths (L,)."""
    own = [i for i, link in enumerate(figure.links) if figure.is_leg(link)]
    parts = {frozenset((i, figure.twins.get(i, i))) for i in own}
    return sum(lengths[i] for i in own) * len(parts) / len(own)
