"""The start pose that a marked frame makes, and what is wrong with it."""

from kinematics.doubts import beyond_limits, doubts
from kinematics.figure import Figure, load_figure
from kinematics.recover import Marks as Places
from kinematics.recover import Start, facing_of, marked_part, start_pose
from tracker.keypoints import Mark, Marks, points


class StartError(ValueError):
    """A start pose that this clip cannot be followed from."""


def marked_start(marks: Marks, frame: int, facing: int | None, size: tuple[int, int]) -> Start:
    """The start pose of a marked frame of a clip.

    Args:
        facing: +1 right, -1 left, None to see it from the marks.
        size: width and height of the picture, pixels.

    Raises:
        StartError: marks outside the picture, or a pose that cannot be right.
        PoseError: a joint that the figure cannot do without is missing.
    """
    marked, whole = marks[frame], load_figure()
    places = points(marked)
    figure = marked_part(whole, places)
    _check_in_picture(marked, figure.base, frame, size)
    later = next((points(marks[f]) for f in sorted(marks) if f > frame), None)
    start = start_pose(figure, places, facing or facing_of(places, later))
    _check_likely(whole, places, start, frame)
    return start


def _check_likely(figure: Figure, places: Places, start: Start, frame: int) -> None:
    reasons = doubts(figure, places, start)
    if not reasons:
        return
    told = f"mark the start again at frame {frame}: {'; '.join(reasons)}"
    side = "right" if start.view.facing < 0 else "left"
    turned = start_pose(start.figure, places, -start.view.facing)
    if beyond_limits(start) and not beyond_limits(turned):
        told += f"; or give --facing {side} if that is where the figure faces"
    raise StartError(told)


def _check_in_picture(marked: dict[str, Mark], base: str, frame: int, size: tuple[int, int]) -> None:
    width, height = size
    outside = [
        name
        for name, mark in marked.items()
        if not (-0.5 <= mark.x <= width - 0.5 and -0.5 <= mark.y <= height - 0.5)
    ]
    if base in outside or 2 * len(outside) > len(marked):
        raise StartError(
            f"the start pose of frame {frame} lies outside the picture of {width} x {height} px "
            f"({', '.join(outside)}); mark it on the very video that is tracked"
        )
