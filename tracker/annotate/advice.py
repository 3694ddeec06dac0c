"""What a frame's marks lack and what cannot be right about them, in plain words."""

from collections.abc import Mapping
from dataclasses import dataclass

from kinematics.figure import Figure
from kinematics.recover import PoseError, needed_joints, start_pose
from tracker.clip.start import objections, outside
from tracker.tables.keypoints import Mark, points


@dataclass(frozen=True)
class Advice:
    """The judgement of one frame.

    missing : joints that a start frame needs and that are not marked
    faults  : what cannot be right, one line each
    faces   : "left" or "right", as tracking will take it; None where it cannot start
    """

    missing: tuple[str, ...]
    faults: tuple[str, ...]
    faces: str | None


def advise(figure: Figure, marks: Mapping[str, Mark], size: tuple[int, int], facing: int) -> Advice:
    """Judge the marks of one frame, complete or not: whatever `figtrack track` refuses is said.

    Args:
        size: width and height of the picture, pixels.
        facing: +1 right, -1 left.
    """
    places = points(marks)
    missing = tuple(name for name in needed_joints(figure) if name not in marks)
    wrong, faces = [*_outside(marks, size), *objections(figure, places, facing, "choose Faces")], None
    if not missing:
        try:
            faces = start_pose(figure, places, facing).view.side
        except PoseError as error:
            wrong = [str(error), *wrong]
    return Advice(missing, tuple(wrong), faces)


def _outside(marks: Mapping[str, Mark], size: tuple[int, int]) -> list[str]:
    width, height = size
    return [
        f"{name} lies outside the picture of {width} x {height} px; move it in, or delete it"
        for name in outside(marks, size)
    ]
