"""The people found in a film, as a table, as lines of text and as a picture."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from kinematics.spm import View
from tracker.clip.naming import nearer, sure_of_leg
from tracker.outline.person import Person
from tracker.report.drawing import segments
from tracker.tables.table import write_table
from videos.frames import Video, images_of
from videos.overlay import draw

COLUMNS = ("person", "first", "last", "frame", "x0", "y0", "x1", "y1", "facing", "direction", "motion")
SURENESS = ("score", "margin", "near_leg", "near_sure")
HEIGHT = 360  # height of the picture's tiles, pixels
WAYS = {1: "right", -1: "left", 0: "none"}


def write_people(path: Path, people: Sequence[Person]) -> None:
    """Write the table of the people found: frames, start frame and box, directions, motion, certainty."""
    rows = []
    for number, one in enumerate(people, 1):
        where = number, one.first, one.last, one.frame, *box(one), *_ways(one)
        score, margin = f"{float(np.median(one.outline.score)):.2f}", f"{one.turned:.2f}"
        rows.append((*where, score, margin, nearer(one), int(sure_of_leg(one))))
    write_table(path, COLUMNS + SURENESS, rows)


def listed(people: Sequence[Person], name: str) -> str:
    """One line for each person found, as printed by `figtrack find`."""
    if not people:
        return f"nobody walks through {name}"
    lines = []
    for number, one in enumerate(people, 1):
        facing, direction, motion = _ways(one)
        leg = "" if sure_of_leg(one) else " (not sure)"
        backwards = "" if direction in (facing, "none") else " backwards"
        lines.append(
            f"person {number}: frames {one.first} to {one.last}, {motion}{backwards}, faces {facing}; "
            f"in frame {one.frame} the nearer leg is {nearer(one)}{leg}"
        )
    return "\n".join(lines)


def write_picture(path: Path, people: Sequence[Person], video: Video) -> None:
    """Write a picture with one frame for each person and the figure drawn on it."""
    tiles, shown = [], images_of(video, {one.frame for one in people})
    for number, one in enumerate(people, 1):
        t, outline = one.frame - one.first, one.outline
        x, y = outline.hips[t].tolist()
        limbs = segments(one.figure, outline.q[t], View((x, y), float(outline.units[t]), one.facing))
        drawn = draw(shown[one.frame], limbs, caption=f"person {number}, frame {one.frame}")
        width = round(drawn.shape[1] * HEIGHT / drawn.shape[0])
        tiles.append(cv2.resize(drawn, (width, HEIGHT), interpolation=cv2.INTER_AREA))
    _, data = cv2.imencode(".png", cv2.cvtColor(np.hstack(tiles), cv2.COLOR_RGB2BGR))
    path.write_bytes(data.tobytes())


def box(one: Person) -> tuple[int, int, int, int]:
    """Left, top, right and bottom pixel of the joints in the start frame."""
    corners = np.concatenate([one.joints.min(0), one.joints.max(0)])
    left, top, right, bottom = corners.round().astype(int).tolist()
    return left, top, right, bottom


def _ways(one: Person) -> tuple[str, str, str]:
    return WAYS[one.facing], WAYS[one.direction], one.outline.gait
