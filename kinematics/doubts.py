"""Faults of marked joints: limbs of impossible length, joints bent too far, exchanged marks.

Judged from whatever is marked so far, in the figure's own proportions and limits. Marks of people in motion
were measured: twins differ by up to 1.4, proportions by up to 1.5, and joints go 5 degrees beyond their
limits; marks that are 3 px off add to each. A foot, which has a fixed length, turns out of the picture plane:
it may look short, and only a long one has a direction. Legs exchanged as a whole are not noticed: one frame
does not show which is nearer.
"""

from collections.abc import Mapping

import numpy as np

from kinematics.figure import Array, Figure, Link
from kinematics.recover import Marks, recover, span

SMALLEST = 25.0  # pixels of a leg: below, templates have too few pixels to be registered
TWINS = 1.6  # largest ratio of a limb's length to its twin's
PROPORTION = 1.8  # largest factor between a limb's length and what the median limb suggests
LONGEST_FOOT, SHORTEST_FOOT = 2.0, 4.0  # the same for a foot that looks too long, too short
MARK = 3.0  # pixels: error of a length between two marks
FEWEST = 3  # limbs needed to estimate the size of the figure
BEYOND = np.radians(17.0)  # angle beyond a joint's limits; an angle for the error of the marks is added
LONG = 0.6  # share of its expected length above which a foot's direction is judged


def doubts(figure: Figure, marks: Marks, facing: int) -> list[str]:
    """Why marked joints, finite pixels by name, cannot be right: one clause a fault, none if plausible.

    The figure is at rest and faces right (+1) or left (-1).
    """
    spans = _spans(figure, marks)
    legs = [i for i in spans if figure.is_leg(figure.links[i])]
    leg = sum(spans[i] for i in legs) / max(sum(figure.links[i].length for i in legs), 1e-9)
    if len(spans) >= FEWEST and legs and leg < SMALLEST:
        return [f"a leg is {leg:.0f} px long, and {SMALLEST:.0f} are needed; enlarge the video"]
    wrong = _wrong(figure, marks, facing)
    if not wrong or not _wrong(figure, marks, -facing):  # nothing is exchanged if only the facing is wrong
        return wrong
    exchanged = {(a, b): {**marks, a: marks[b], b: marks[a]} for a, b in _pairs(figure, marks)}
    cures = [pair for pair, better in exchanged.items() if not _wrong(figure, better, facing)]
    cures = [pair for pair in cures if any(name in wrong[0] for name in pair)] or cures
    names = [f"{one} and {other}" for one, other in cures]
    return [f"{', or '.join(names)} look exchanged: {wrong[0]}"] if names else wrong


def beyond_limits(figure: Figure, marks: Marks, facing: int) -> list[str]:
    """Joints bent beyond their limits, one clause each."""
    if figure.base not in marks:
        return []
    q, known = recover(figure, {name: np.array([facing * x, -y]) for name, (x, y) in marks.items()})
    spans, found = _spans(figure, marks), []
    size = _usual(figure, spans)
    told: list[bool] = []  # whether the direction of each link is known
    for i, (link, parent) in enumerate(zip(figure.links, figure.parents, strict=True)):
        from_there = parent < 0 or told[parent]
        told.append(from_there if link.freedom is None else bool(known[figure.index(link.freedom)]))
        if link.freedom is None or not (told[-1] and from_there):
            continue
        if not link.breathes and (size is None or spans[i] < LONG * size * link.length):
            continue
        angle = q[figure.index(link.freedom)]
        beyond = max(angle - link.limits[1], link.limits[0] - angle)
        if beyond > BEYOND + MARK / max(spans[i], MARK):
            by = f"{np.degrees(beyond):.0f} degrees more than a body can"
            found.append(f"{link.joint} is turned about {_start(figure, link)} by {by}")
    return found


def _wrong(figure: Figure, marks: Marks, facing: int) -> list[str]:
    spans = _spans(figure, marks)
    return _uneven(figure, spans) + _out_of_proportion(figure, spans) + beyond_limits(figure, marks, facing)


def _spans(figure: Figure, marks: Marks) -> dict[int, float]:
    """Length in pixels of each link with both ends marked."""
    points: dict[str, Array] = {name: np.asarray(at, dtype=np.float64) for name, at in marks.items()}
    along = {i: span(figure, i, points) for i in range(len(figure.links))}
    return {i: float(np.hypot(*way)) for i, way in along.items() if way is not None}


def _usual(figure: Figure, spans: Mapping[int, float]) -> float | None:
    """Leg length in pixels according to the median of the marked limbs; None if too few are marked."""
    sizes = [length / figure.links[i].length for i, length in spans.items() if figure.links[i].breathes]
    return float(np.median(sizes)) if len(sizes) >= FEWEST else None


def _uneven(figure: Figure, spans: Mapping[int, float]) -> list[str]:
    """Twins of too different lengths; the clause names first the one that fits the other limbs less."""
    size, found = _usual(figure, spans), []
    for i, twin in figure.twins.items():
        if i > twin or not {i, twin} <= spans.keys() or not figure.links[i].breathes:
            continue
        (less, short), (more, long) = sorted(
            ((figure.links[j], spans[j]) for j in (i, twin)), key=lambda limb: limb[1]
        )
        if not _unlike(long, short, TWINS):
            continue
        if size is not None and size * less.length / max(short, 1.0) > long / max(size * more.length, 1e-9):
            (less, short), (more, long) = (more, long), (less, short)
        found.append(f"{_way(figure, more)} is {_times(long, short)} times as far as {_way(figure, less)}")
    return found


def _out_of_proportion(figure: Figure, spans: Mapping[int, float]) -> list[str]:
    """Limbs longer or shorter than the other limbs suggest."""
    size, found = _usual(figure, spans), []
    if size is None:
        return []
    for i, length in spans.items():
        link = figure.links[i]
        expected = size * link.length
        most, least = (PROPORTION, PROPORTION) if link.breathes else (LONGEST_FOOT, SHORTEST_FOOT)
        if _unlike(length, expected, most if length > expected else least):
            found.append(
                f"{_way(figure, link)} is {_times(length, expected)} times as far as the other limbs suggest"
            )
    return found


def _unlike(one: float, other: float, factor: float) -> bool:
    """Whether two lengths, pixels, differ by more than a factor and the marks' error."""
    return max(one, other) - MARK > factor * (min(one, other) + MARK)


def _times(one: float, other: float) -> str:
    return f"{one / max(other, 1.0):.1f}"


def _way(figure: Figure, link: Link) -> str:
    return f"from {_start(figure, link)} to {link.joint}"


def _start(figure: Figure, link: Link) -> str:
    """The joint at or before the place where a link begins."""
    return next((other.joint for other in figure.links if other.name == link.parent), figure.base)


def _pairs(figure: Figure, marks: Marks) -> list[tuple[str, str]]:
    """Pairs of joints that are easily confused: a near and a far one, and the two ends of a limb."""
    names = figure.joints
    pairs = [(names[i], names[twin]) for i, twin in enumerate(figure.joint_twins.tolist()) if i < twin]
    pairs += [(_start(figure, link), link.joint) for link in figure.links]
    return [(one, other) for one, other in pairs if one in marks and other in marks]
