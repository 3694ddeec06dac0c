"""What stands in front of a walker: places of the scene that hide a figure which passes them.

Over the frames of a path each place relative to the hip shows foreground in a share P of them. The sum of P
over the frames in which the figure passes a place of the scene is the number of frames in which that place
should show foreground. If it shows hardly any, the place is in front of the figure, and so are those below it
down to the ground, unless they show foreground themselves.
"""

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from kinematics.figure import Array, Flags, Ints
from tracker.outline.bodies import Path
from tracker.outline.place import extent, maps, to_map
from tracker.outline.shape import Grid
from tracker.outline.smooth import smooth
from tracker.outline.stage import Stage
from tracker.picture.pyramid import Image
from tracker.survey.evidence import NOTHING

DENSITY = 16.0  # places in a leg length
GRID = Grid((-1.0, 1.0), DENSITY, (38, 33))
HIP = (16, 16)  # row and column of the hip in it
SQUARE = np.ones((3, 3), np.uint8)
STEADY = 1.5  # seconds whose median is the hip's height, since paths rise where legs are hidden
LIKELY = 0.4  # least share of frames with foreground at a place that counts
EXPECTED = 2.0  # least number of frames, at 30 a second, in which an occluder should show foreground
SHOWN = 0.1  # largest share of them in which it does
LEAST = 6  # least number of its places
WIDEST = 1.0  # its largest width, leg lengths
ENDS = 0.5  # its least distance from both ends of what the figure passes, leg lengths
BELOW = 2.0  # distance below the lowest places passed down to which it may reach, leg lengths


def forget_occluders(stage: Stage, path: Path) -> None:
    """Set the places in front of the walker of a path to unknown; changes the stage's log odds."""
    part = stage.part(slice(path.first, path.last + 1))
    by = DENSITY / float(np.median(path.units * part.zoom))
    hidden, corner = _occluders(part, path.hips, by)
    if hidden.any():
        size, how = stage.odds.shape[:0:-1], cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
        from_scene = to_map(by, corner)
        for odds, place in zip(stage.odds, stage.places, strict=True):
            way = (from_scene @ place @ stage.up)[:2]
            odds[cv2.warpAffine(hidden, way, size, flags=how) > 0] = NOTHING


def _occluders(part: Stage, hips: Array, by: float) -> tuple[Image, Ints]:
    """A map of the scene, `by` places a pixel, with 1 for what is in front; its corner's column and row."""
    shown, known, corners = _passing(part, hips, by)
    rows, columns = GRID.shape
    share = shown.sum(0) / np.maximum(known.sum(0), 1)
    share[share < LIKELY] = 0.0
    corner = corners.min(0)
    width, height = corners.max(0) - corner + [columns, rows + round(BELOW * DENSITY)]
    wanted, found = np.zeros((2, height, width))
    for t, (x, y) in enumerate(corners - corner):
        here = slice(y, y + rows), slice(x, x + columns)
        wanted[here] += share * known[t]
        found[here] += shown[t]
    wanted, found = (cv2.blur(each, (3, 3), borderType=cv2.BORDER_CONSTANT) for each in (wanted, found))
    least = EXPECTED * part.often
    passed, empty = wanted > least, found < SHOWN * np.maximum(wanted, least)
    front = _large(passed & empty, np.flatnonzero(passed.any(0)))
    for above, below, through in zip(front, front[1:], empty[1:], strict=False):
        below |= above & through
    return np.asarray(cv2.dilate(front.astype(np.uint8), SQUARE)), corner


def _passing(part: Stage, hips: Array, by: float) -> tuple[Flags, Flags, Ints]:
    """(T, *GRID.shape) whether places around the hip show foreground, and whether they are known; and (T, 2)
    column and row of each frame's first place in a map of the scene."""
    size, corners = extent(part, by)
    rows, columns = GRID.shape
    hip = np.rint(_steady(part, hips) * by).astype(np.intp)
    shown, known = (np.zeros((len(part), rows, columns), bool) for _ in range(2))
    for t, odds in enumerate(maps(part, by, size, corners)):
        x, y = hip[t] - corners[t]
        if 0 <= x <= size[1] and 0 <= y <= size[0]:
            wide = cv2.copyMakeBorder(odds, HIP[0], rows, HIP[1], columns, cv2.BORDER_CONSTANT, value=0.0)
            here = wide[y : y + rows, x : x + columns]
            shown[t], known[t] = here > 0.0, here != 0.0
    return shown, known, hip - HIP[::-1]


def _steady(part: Stage, hips: Array) -> Array:
    """(T, 2) the hips in the scene, with a height that changes slowly."""
    scene = part.in_scene(hips)
    half = max(round(0.5 * STEADY * part.fps), 1)
    around = sliding_window_view(np.pad(scene[:, 1], half, mode="edge"), 2 * half + 1)
    height = smooth(np.median(around, axis=1), half / 3.0)
    return np.column_stack([scene[:, 0], height])


def _large(front: Flags, passed: Ints) -> Flags:
    """The regions of places in front that may be occluders; `passed` columns, ascending, are those walked."""
    closed = cv2.morphologyEx(front.astype(np.uint8), cv2.MORPH_CLOSE, SQUARE)
    count, regions, about, _ = cv2.connectedComponentsWithStats(closed, connectivity=4)
    first, width = about[:, cv2.CC_STAT_LEFT], about[:, cv2.CC_STAT_WIDTH]
    kept = (about[:, cv2.CC_STAT_AREA] >= LEAST) & (width <= WIDEST * DENSITY) & (np.arange(count) > 0)
    if len(passed):
        kept &= (first > passed[0] + ENDS * DENSITY) & (first + width < passed[-1] + 1 - ENDS * DENSITY)
    return np.asarray(kept[regions])
