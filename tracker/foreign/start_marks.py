"""A start pose out of another program's file: which frame, which person, and what is to be said of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from kinematics.figure import load_figure
from kinematics.recover import needed_joints
from tracker.foreign.formats import read_people
from tracker.foreign.names import facing_seen, joints_of, parts_of
from tracker.foreign.people import People, Person, largest
from tracker.foreign.text_files import ForeignError
from tracker.tables.keypoints import KEYPOINTS, Mark

LEAST = 0.1  # confidence below which a point is not taken
SURE = 0.5  # confidence below which it is taken for an estimate


@dataclass(frozen=True)
class Taken:
    """Marks that another program made of one frame.

    told : what was taken, and how, in words
    """

    frame: int
    marks: Mapping[str, Mark]
    told: str


def read_start(path: Path, frame: int | None = None, facing: int | None = None) -> Taken:
    """The marks of one frame of another program's file, told apart by content.

    Args:
        frame: None for the first in which a whole figure was seen. The only frame of a file is taken
            for whichever is asked for.
        facing: +1 right, -1 left, None to see it from the points.

    Raises:
        ForeignError: none of these formats, nobody in it, or not in this frame.
    """
    program, people = read_people(path)
    people = {number: seen for number, seen in people.items() if seen}
    source = _choose_frame(people, frame, path)
    number = largest(people[source])
    parts = parts_of(_likely(people[source][number]))
    way = facing or facing_seen(parts)
    joints, derived = joints_of(parts, way)
    if not joints:
        known = ", ".join(people[source][number])
        raise ForeignError(f"{path} has no point of ours, only {known}; docs/annotate.md has the names")
    marks = {
        name: Mark(round(point.x, 2), round(point.y, 2), point.visible and point.confidence >= SURE)
        for name, point in joints.items()
    }
    which = (
        f", person {number + 1} of {len(people[source])}, the largest and surest"
        if len(people[source]) > 1
        else ""
    )
    sides = {side for side, _ in parts} & {"right", "left"}
    told = [f"took {len(marks)} joints from {path.name} ({program}, frame {source}{which})"]
    if sides:
        told += [
            "faces right, so the right leg is near" if way > 0 else "faces left, so the left leg is near"
        ]
    if derived:
        told += [f"estimated: {', '.join(derived)}"]
    lacking = [name for name in KEYPOINTS if name not in marks]
    if lacking:
        told += [f"not there: {', '.join(lacking)}"]
    return Taken(source if frame is None else frame, marks, "; ".join(told) + ". Check every joint.")


def _choose_frame(people: People, frame: int | None, path: Path) -> int:
    frames = sorted(people)
    if frame in people or len(frames) == 1:
        return frames[0] if frame is None or len(frames) == 1 else frame
    if frame is not None:
        shown = ", ".join(map(str, frames[:8])) + (", .." if len(frames) > 8 else "")
        raise ForeignError(f"nobody is marked in frame {frame} of {path}; there is somebody in {shown}")
    needed = needed_joints(load_figure())
    for number in frames:
        for person in people[number]:
            if set(needed) <= joints_of(parts_of(_likely(person)), 1)[0].keys():
                return number
    return frames[0]


def _likely(person: Person) -> Person:
    return {name: point for name, point in person.items() if point.confidence >= LEAST}
