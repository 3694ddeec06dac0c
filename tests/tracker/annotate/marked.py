"""The marks of a frame that are in order, and marks as the page tells them."""

from tests.tracker.people import LEGS
from tracker.tables.keypoints import Mark

MARKS = {
    "head_top": Mark(108, 28),
    "neck": Mark(100, 70),
    "hip": Mark(100, 130),
    **{name: Mark(*place) for name, place in LEGS.items()},
}


def without(*names):
    return {name: mark for name, mark in MARKS.items() if name not in names}


def told(marks):
    return {name: {"x": mark.x, "y": mark.y, "visible": mark.visible} for name, mark in marks.items()}
