"""People in frames as in other programs' files, before one is chosen and near and far leg are named."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

COPY = re.compile(r"\.rf\.[0-9a-f]+$")  # what Roboflow adds to an image's name


@dataclass(frozen=True, slots=True)
class Sighting:
    """One point of one person.

    x, y       : pixels, (0, 0) the centre of the top-left one
    confidence : 0 to 1
    visible    : False if the program marks the point as hidden
    """

    x: float
    y: float
    confidence: float = 1.0
    visible: bool = True


Person = Mapping[str, Sighting]  # by the program's names of points
People = dict[int, list[Person]]  # by frame


def sighting(x: object, y: object, confidence: object = 1.0, visible: bool = True) -> Sighting | None:
    """A point from a file's numbers; None if a number is not finite or the confidence is 0."""
    try:
        numbers = [float(value) for value in (x, y, confidence)]  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return None
    if not all(map(math.isfinite, numbers)) or numbers[2] <= 0.0:
        return None
    return Sighting(numbers[0], numbers[1], min(numbers[2], 1.0), visible)


def person(points: Mapping[str, Sequence[Any]]) -> Person:
    """A person from points, each with the arguments of `sighting`; missing points are left out."""
    found = {name: sighting(*numbers) for name, numbers in points.items()}
    return {name: point for name, point in found.items() if point is not None}


def triples(names: Sequence[str], numbers: Sequence[Any]) -> dict[str, tuple[Any, Any, Any]]:
    """Numbers x, y, c, x, y, c, .. by point; ValueError if there are not three for each name."""
    if len(numbers) != 3 * len(names):
        raise ValueError(f"{len(names)} points need {3 * len(names)} numbers; got {len(numbers)}")
    return {str(name): tuple(numbers[3 * i : 3 * i + 3]) for i, name in enumerate(names)}


def largest(people: Sequence[Person]) -> int:
    """Position of the person in a frame with the greatest height in the picture and confidence."""
    return max(range(len(people)), key=lambda i: _weight(people[i]))


def frame_number(name: str) -> int | None:
    """The last number in a file's name: img0012.png is frame 12, as is img0012_png.rf.8d2f.jpg."""
    numbers = re.findall(r"\d+", COPY.sub("", Path(name.replace("\\", "/")).stem))
    return int(numbers[-1]) if numbers and len(numbers[-1].lstrip("0")) < 10 else None


def _weight(person: Person) -> float:
    if not person:
        return 0.0
    heights = [point.y for point in person.values()]
    return (max(heights) - min(heights)) * sum(point.confidence for point in person.values())
