"""The start pose of a marked frame, and its faults."""

from collections.abc import Mapping
from dataclasses import replace

from kinematics.doubts import beyond_limits, doubts
from kinematics.figure import Figure
from kinematics.figure_file import WALKER
from kinematics.recover import Marks as Places
from kinematics.recover import Start, facing_of, facing_told, start_pose
from tracker.tables.keypoints import Mark, Marks, hidden, points


class StartError(ValueError):
    """A start pose from which this clip cannot be followed."""


class FoundError(ValueError):
    """The film gives no reliable start.

    suggested : marks of an uncertain start
    """

    def __init__(self, text: str, suggested: Marks | None = None) -> None:
        super().__init__(text)
        self.suggested = suggested


def marked_start(
    marks: Marks, frame: int, facing: int | None, size: tuple[int, int], figure: Figure = WALKER
) -> Start:
    """The start pose of a marked frame of a clip.

    Args:
        facing: +1 right, -1 left, None to find it from the marks.
        size: width and height of the picture, pixels.

    Raises:
        StartError: marks outside the picture, or a pose that cannot be right.
        PoseError: a required joint is missing, or two joints coincide.
    """
    marked = marks[frame]
    places, way = points(marked), facing or facing_at(marks, frame, figure)
    _check_in_picture(marked, figure.base, frame, size)
    start = replace(start_pose(figure, places, way), hidden=hidden(marked))
    wrong = objections(figure, places, way)
    if wrong:
        raise StartError(f"mark the start again at frame {frame}: {'; '.join(wrong)}")
    return start


def objections(figure: Figure, places: Places, facing: int, turn: str = "give --facing") -> list[str]:
    """Why the joints marked so far cannot be right, one clause a fault; none if they are plausible.

    Args:
        turn: what a user can do if the facing is wrong, in words.
    """
    wrong = doubts(figure, places, facing)
    if wrong and _bends_back(figure, places, facing):
        side = "right" if facing < 0 else "left"
        wrong.append(f"or {turn} {side} if that is where the figure faces")
    return wrong


def facing_at(marks: Marks, frame: int, figure: Figure = WALKER) -> int:
    """Which way the figure faces in a marked frame, by its marks and the next frame's: +1 right, -1 left.

    If the frame's own marks do not show it, the facing for which joints bend the possible way.
    """
    here, later = points(marks[frame]), next((points(marks[f]) for f in sorted(marks) if f > frame), None)
    way = facing_of(here, later, figure)
    return -way if not facing_told(here, figure) and _bends_back(figure, here, way) else way


def _bends_back(figure: Figure, places: Places, facing: int) -> bool:
    """Whether the joints' bends are possible only if the figure faces the other way."""
    return bool(beyond_limits(figure, places, facing)) and not beyond_limits(figure, places, -facing)


def outside(marked: Mapping[str, Mark], size: tuple[int, int]) -> list[str]:
    """Joints marked outside the picture; `size` is its width and height in pixels."""
    width, height = size
    return [
        name
        for name, mark in marked.items()
        if not (-0.5 <= mark.x <= width - 0.5 and -0.5 <= mark.y <= height - 0.5)
    ]


def _check_in_picture(marked: Mapping[str, Mark], base: str, frame: int, size: tuple[int, int]) -> None:
    names = outside(marked, size)
    if base in names or 2 * len(names) > len(marked):
        width, height = size
        raise StartError(
            f"the start pose of frame {frame} lies outside the picture of {width} x {height} px "
            f"({', '.join(names)}); mark it on the very video that is tracked"
        )
