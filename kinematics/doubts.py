"""What speaks against a start pose: limbs of impossible length, joints bent too far, too small a figure.

Marks of people in motion were measured: twins differ by up to 1.4, proportions by up to 1.5, and joints go 5
degrees beyond their limits; marks that are 3 px off add to each. Feet are left out: pointing towards the
camera, they have any length and direction. Near and far exchanged cannot be seen in one frame.
"""

from collections.abc import Mapping

import numpy as np

from kinematics.figure import Figure
from kinematics.recover import Start

TWINS = 1.6  # how many times as long as its twin a link may seem, whatever the marks' error
PROPORTION = 1.8  # how many times as long, or short, as the rest of the figure has it
MARK = 4.0  # pixels: error of a length between two marks
BEYOND = float(np.radians(30.0))  # of a joint's limits
SMALLEST = 25.0  # pixels of a leg: below, templates have too few pixels to be registered


def doubts(figure: Figure, marks: Mapping[str, tuple[float, float]], start: Start) -> list[str]:
    """Why a start pose cannot be right, a clause each; none if it can.

    Args:
        figure: at rest, before it took the lengths of the marks.
        marks: pixels of the marked joints.
        start: the pose they made.
    """
    if start.view.unit < SMALLEST:
        return [f"a leg is {start.view.unit:.0f} px long, and {SMALLEST:.0f} are needed; enlarge the video"]
    return [*_uneven(start, marks), *_out_of_proportion(figure, start), *beyond_limits(start)]


def beyond_limits(start: Start) -> list[str]:
    """Joints bent further than they go, a clause each."""
    found = []
    for link in start.figure.links:
        if link.freedom is None or not link.breathes:
            continue
        i = start.figure.index(link.freedom)
        low, high = link.limits
        if not low - BEYOND <= start.q[i] <= high + BEYOND:
            angle, least, most = np.degrees([start.q[i], low, high]).round()
            found.append(f"{link.freedom} is bent to {angle:.0f} degrees, beyond {least:.0f} to {most:.0f}")
    return found


def _uneven(start: Start, marks: Mapping[str, tuple[float, float]]) -> list[str]:
    """Twins of unlike lengths."""
    lengths = _marked_lengths(start, marks)
    found = []
    for near, length in lengths.items():
        far = near.removesuffix("_near") + "_far"
        if not near.endswith("_near") or far not in lengths:
            continue
        if _unlike(length, lengths[far], TWINS):
            (short, less), (long, more) = sorted([(near, length), (far, lengths[far])], key=lambda e: e[1])
            found.append(f"{long} is {more / less:.1f} times as long as {short}")
    return found


def _out_of_proportion(figure: Figure, start: Start) -> list[str]:
    """Links of another length than the figure at rest has beside its other links."""
    # How uneven twins are is another question: each counts with the mean of both.
    twins: dict[str, list[tuple[float, float]]] = {}
    for own in start.figure.links:
        if own.breathes:
            rest = figure.links[figure.link_of(own.joint)]
            name = own.name.removesuffix("_near").removesuffix("_far")
            twins.setdefault(name, []).append((own.length, rest.length))
    means = {name: np.mean(lengths, axis=0) for name, lengths in twins.items()}
    middle = np.median([means[name][0] / means[name][1] for name in twins for _ in twins[name]])
    return [
        f"the {name} is {length / (middle * rest):.1f} times as long as the rest has it"
        for name, (length, rest) in means.items()
        if _unlike(length * start.view.unit, middle * rest * start.view.unit, PROPORTION)
    ]


def _unlike(one: float, other: float, factor: float) -> bool:
    """Whether two lengths, pixels, differ by more than a factor and the marks' error."""
    return max(one, other) - MARK > factor * (min(one, other) + MARK)


def _marked_lengths(start: Start, marks: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """Pixels of each link whose both ends are marked."""
    figure = start.figure
    found = {}
    for link, parent in zip(figure.links, figure.parents, strict=True):
        begin = figure.base if parent < 0 else figure.links[parent].joint
        if link.breathes and link.at == 1.0 and {begin, link.joint} <= marks.keys():
            found[link.name] = float(np.hypot(*np.subtract(marks[link.joint], marks[begin])))
    return found
