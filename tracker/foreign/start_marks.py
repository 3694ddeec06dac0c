"""A start pose from another program's file: the choice of frame and person, with a remark for the user."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from kinematics.doubts import doubts
from kinematics.figure import Figure
from kinematics.figure_file import WALKER
from tracker.foreign.formats import check_frames, is_foreign, read_people
from tracker.foreign.names import Parts, facing_seen, joints_of, parts_of
from tracker.foreign.people import People, Person, Sighting, largest
from tracker.foreign.text_files import ForeignError
from tracker.tables.keypoints import Mark, Marks, read_keypoints

LEAST = 0.1  # confidence below which a point is ignored
SURE = 0.5  # confidence below which it counts as an estimate


@dataclass(frozen=True)
class Taken:
    """Marks of one frame from another program.

    told : in words, what was taken and how
    """

    frame: int
    marks: Mapping[str, Mark]
    told: str


def read_marks(
    path: Path, frame: int | None, facing: int | None, first: int, last: int | None, figure: Figure = WALKER
) -> tuple[Marks, str]:
    """The marks of a keypoints table, or those of `read_start` with a remark on them."""
    if not is_foreign(path):
        return read_keypoints(path, figure.marks, figure.joints), ""
    taken = read_start(path, frame, facing, first, last, figure)
    return {taken.frame: dict(taken.marks)}, taken.told


def read_start(
    path: Path,
    frame: int | None = None,
    facing: int | None = None,
    first: int = 0,
    last: int | None = None,
    figure: Figure = WALKER,
) -> Taken:
    """The marks of one frame of another program's file, which is recognised by its content.

    Args:
        frame: None for the best: a plausible whole figure with ankles far apart and likely points. The only
            frame of a file counts as the one asked for.
        facing: +1 right, -1 left, None to find it from the points.
        first, last: range of frames searched for the best, None for the file's last.

    Raises:
        ForeignError: none of these formats, nobody in it, or not in this frame.
    """
    program, people = read_people(path)
    alone = len(people) == 1
    if frame is None or not alone:  # the name of a single picture need not number it
        check_frames(people, path)
    people = {number: seen for number, seen in people.items() if seen}
    source = min(people) if alone else _choose_frame(people, frame, (first, last), path, figure)
    seen = people[source]
    number = largest(seen)
    parts = parts_of(_likely(seen[number]), figure)
    way = facing or facing_seen(parts, figure)
    joints, derived = joints_of(parts, way, figure)
    if not joints:
        known = ", ".join(seen[number])
        raise ForeignError(f"{path} has no point of ours, only {known}; docs/annotate.md has the names")
    marks = {
        name: Mark(round(point.x, 2), round(point.y, 2), point.visible and point.confidence >= SURE)
        for name, point in joints.items()
    }
    which = f", person {number + 1} of {len(seen)}, the largest and surest" if len(seen) > 1 else ""
    told = [f"took {len(marks)} joints from {path.name} ({program}, frame {source}{which})"]
    if any(side in ("right", "left") for side, _ in parts):
        near = "right" if way > 0 else "left"
        told += [f"faces {near}, so the {near} leg is near"]
    if derived:
        told += [f"estimated: {', '.join(derived)}"]
    lacking = [name for name in figure.marks if name not in marks]
    if lacking:
        told += [f"not there: {', '.join(lacking)}"]
    return Taken(source if frame is None else frame, marks, "; ".join(told) + ". Check every joint.")


def _choose_frame(
    people: People, frame: int | None, between: tuple[int, int | None], path: Path, figure: Figure
) -> int:
    frames, (first, last) = sorted(number for number, seen in people.items() if any(seen)), between
    within = [number for number in frames if first <= number and (last is None or number <= last)]
    asked = within if frame is None else [number for number in frames if number == frame]
    if not asked:
        part = f"from frame {first}" + (f" to {last}" if last is not None else " on")
        which = f"in frame {frame}" if frame is not None else part
        shown = ", ".join(map(str, frames[:8])) + (", .." if len(frames) > 8 else "")
        raise ForeignError(f"nobody is marked {which} of {path}; there is somebody in {shown}")
    seen = {number: parts_of(_likely(people[number][largest(people[number])]), figure) for number in asked}
    asked.sort(key=lambda number: _worth(seen[number], figure), reverse=True)
    return next((number for number in asked if _can_be(seen[number], figure)), asked[0])


def _worth(parts: Parts, figure: Figure) -> float:
    """Distance of the ends of twin legs as a share of the figure's height, times the lowest confidence of a
    point; below 0 for an incomplete figure."""
    joints, _ = joints_of(parts, 1, figure)
    if not _whole(joints, figure):
        return -1.0
    ends = [leg[-1] for leg in figure.legs if leg[-1] in figure.twins]
    pairs = [(figure.links[i].joint, figure.links[figure.twins[i]].joint) for i in ends]
    across = [abs(joints[one].x - joints[other].x) for one, other in pairs if {one, other} <= joints.keys()]
    rows = [point.y for point in joints.values()]
    apart = max(across, default=0.0) / max(max(rows) - min(rows), 1.0)
    return apart * min(point.confidence for point in joints.values())


def _can_be(parts: Parts, figure: Figure) -> bool:
    """Whether the figure is complete and plausible."""
    facing = facing_seen(parts, figure)
    joints, _ = joints_of(parts, facing, figure)
    places = {name: (point.x, point.y) for name, point in joints.items()}
    return _whole(joints, figure) and not doubts(figure, places, facing)


def _whole(joints: Mapping[str, Sighting], figure: Figure) -> bool:
    return joints.keys() >= set(figure.needed)


def _likely(person: Person) -> Person:
    return {name: point for name, point in person.items() if point.confidence >= LEAST}
