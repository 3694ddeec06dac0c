"""Files with marks or points of any supported program, recognised by their content."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from kinematics.figure import Figure
from kinematics.figure_file import WALKER
from tracker.foreign import coco, dlc, labelme, openpose, trc
from tracker.foreign.names import joints_of, parts_of
from tracker.foreign.people import People, largest
from tracker.foreign.points import Points
from tracker.foreign.text_files import ForeignError, load_json, opened

JSON = ("{", "[")  # first characters of JSON
# Programs and readers by a key of the file's object.
OF_OBJECT = {
    "people": ("OpenPose", openpose.read_people),
    "shapes": ("labelme", labelme.read_people),
    "annotations": ("COCO", coco.read_people),
}
LONGEST = 1_000_000  # largest number of frames in an undamaged file


def read_people(path: Path) -> tuple[str, People]:
    """The program of a file, and all people in it. ForeignError: none of the formats, a malformed file, or
    nobody in it."""
    program, read = _format(path)
    people = read(path)
    if not any(any(seen) for seen in people.values()):
        raise ForeignError(f"nobody is marked in {path}; give another file")
    return program, people


def read_points(path: Path, facing: int, figure: Figure = WALKER) -> Points:
    """The largest and surest person of each frame under our names, without hidden and estimated points.

    `facing`, +1 right or -1 left, decides which leg is near. ForeignError: as `read_people`, or no point has
    a known name.
    """
    _, people = read_people(path)
    check_frames(people, path)
    found = {}
    for frame, seen in people.items():
        parts = parts_of(seen[largest(seen)], figure) if seen else {}
        joints, _ = joints_of(parts, facing, figure)
        found[frame] = {name: point for name, point in joints.items() if point.visible}
    names = tuple(name for name in figure.marks if any(name in joints for joints in found.values()))
    if not names:
        raise ForeignError(f"{path} has no point of ours; docs/annotate.md has the names")
    places = np.full((max(people) + 1, len(names), 2), np.nan)
    likelihood = np.zeros(places.shape[:2])
    for frame, joints in found.items():
        for name, point in joints.items():
            places[frame, names.index(name)] = point.x, point.y
            likelihood[frame, names.index(name)] = point.confidence
    return Points(names, places, likelihood)


def is_foreign(path: Path) -> bool:
    """Whether a file looks like another program's rather than a table of our own."""
    if path.is_dir():
        return True
    try:
        head = _head(path)
    except ForeignError:
        return False
    if dlc.is_dlc(head):  # any table may have a column "scorer"
        return dlc.has_parts(path)
    return trc.is_trc(head) or head.startswith(JSON)


def check_frames(people: People, path: Path) -> None:
    """ForeignError if the numbers of frames are none of a film."""
    if not 0 <= min(people) <= max(people) < LONGEST:
        raise ForeignError(f"{path} goes from frame {min(people)} to {max(people)}; export it again")


def _head(path: Path) -> str:
    with opened(path) as file:
        return file.read(10_000).lstrip()


def _format(path: Path) -> tuple[str, Callable[[Path], People]]:
    if path.is_dir():
        return "OpenPose", openpose.read_people
    head = _head(path)
    if dlc.is_dlc(head):
        return "DeepLabCut", dlc.read_people
    if trc.is_trc(head):
        return "TRC", trc.read_people
    content: Any = load_json(path) if head.startswith(JSON) else ()
    if isinstance(content, list):  # a detector's results
        return "COCO", coco.read_people
    for key, found in OF_OBJECT.items():
        if key in content:
            return found
    raise ForeignError(
        f"{path} is none of the files that marks are taken from: a DeepLabCut CSV, a TRC in pixels, "
        "OpenPose JSON, COCO keypoints JSON or labelme JSON; export it as one of them"
    )
