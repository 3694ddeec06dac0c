"""Joining the pieces of a person's path that are separated because something hid the person.

Two pieces belong to one person if, each continued at its velocity, they meet in the middle of the time
between them, have about the same velocity, and are of about the same size. Where two people meet, a path may
arrive with one and go back with the other, so paths are first cut where they turn.
"""

import numpy as np

from kinematics.figure import Array
from tracker.outline.bodies import Path
from tracker.outline.stage import Stage

LONGEST = 1.5  # longest time that a person may be hidden, seconds
NEAR, HIGHER = 0.5, 1.0  # largest distance along and up between two continued pieces, leg lengths
SPEED = 1.0  # largest difference of their speeds across the picture, leg lengths a second
ALIKE = 1.5  # largest ratio of their sizes
LATELY = 1.0  # seconds before and after a gap from which the velocity is measured
TURN = 0.4  # seconds before and after a turn that show it
SLOW = 0.3  # speed below which a person has no direction, leg lengths a second


def joined(stage: Stage, paths: list[Path]) -> list[Path]:
    """The paths, with pieces of one person joined, the surest first."""
    found: list[Path] = []
    pieces = [piece for path in paths for piece in _straight(stage, path)]
    for path in sorted(pieces, key=lambda each: each.first):
        before = [each for each in found if _one(stage, each, path)]
        if before:
            nearest = max(before, key=lambda each: each.last)
            found = [each for each in found if each is not nearest]
            path = _both(stage, nearest, path)
        found.append(path)
    return sorted(found, key=lambda each: -each.worth)


def _one(stage: Stage, before: Path, after: Path) -> bool:
    """Whether two pieces belong to one person."""
    between = after.first - before.last
    if not 0 < between <= LONGEST * stage.fps:
        return False
    n = max(round(LATELY * stage.fps), 2)
    (come, ahead), (gone, back) = line(in_scene(stage, before)[-n:]), line(in_scene(stage, after)[:n][::-1])
    along, up = np.abs(come - gone + [0.5 * between * (ahead - back), 0.0])
    lately = np.array([np.median(_sizes(stage, before)[-n:]), np.median(_sizes(stage, after)[:n])])
    unit, faster = float(lately.mean()), abs(ahead + back) * stage.fps
    alike = lately.max() < ALIKE * lately.min()
    return bool(alike and along < NEAR * unit and up < HIGHER * unit and faster < SPEED * unit)


def line(scene: Array) -> tuple[Array, float]:
    """A robust line through places (n, 2): the place in the last frame, and the motion along in a frame.

    Vertically there is no motion: hips move up and down, and a person with hidden legs is found higher.
    """
    n = len(scene)
    apart = max(n // 2, 1)
    way = float(np.median(scene[apart:, 0] - scene[:-apart, 0])) / apart if n > 1 else 0.0
    return np.median(scene + np.outer(np.arange(n)[::-1] * way, [1.0, 0.0]), axis=0), way


def _straight(stage: Stage, path: Path) -> list[Path]:
    """The path, cut at turns."""
    n = max(round(TURN * stage.fps), 2)
    if len(path.hips) <= 2 * n:
        return [path]
    x, slow = in_scene(stage, path)[:, 0], SLOW * np.median(_sizes(stage, path)) * n / stage.fps
    come, gone = x[n:-n] - x[: -2 * n], x[2 * n :] - x[n:-n]
    turns = (np.minimum(abs(come), abs(gone)) > slow) & (come * gone < 0.0)
    if not turns.any():
        return [path]
    cut = n + int(np.where(turns, abs(gone - come), 0.0).argmax())
    parts = path.part(slice(cut)), path.part(slice(cut, None))
    return [piece for part in parts for piece in _straight(stage, part)]


def _both(stage: Stage, before: Path, after: Path) -> Path:
    """Two paths joined to one, with a straight line over the scene between them."""
    between = np.arange(before.last + 1, after.first)
    ends = [in_scene(stage, before)[-1], in_scene(stage, after)[0]]
    x, y = (np.interp(between, [before.last, after.first], [a, b]) for a, b in zip(*ends, strict=True))
    hips = stage.part(slice(before.last + 1, after.first)).in_frames(np.column_stack([x, y]))
    units = np.interp(between, [before.last, after.first], [before.units[-1], after.units[0]])
    return Path(
        before.first,
        np.concatenate([before.hips, hips, after.hips]),
        np.concatenate([before.units, units, after.units]),
        np.concatenate([before.score, np.zeros(len(between)), after.score]),
    )


def in_scene(stage: Stage, path: Path) -> Array:
    """(n, 2) the hips of a path in pixels of the first frame, camera motion removed."""
    return stage.part(slice(path.first, path.last + 1)).in_scene(path.hips)


def _sizes(stage: Stage, path: Path) -> Array:
    """(n,) the leg lengths of a path in pixels of the first frame."""
    return path.units * stage.part(slice(path.first, path.last + 1)).zoom
