"""Pieces of one person's path, parted by what hid the person for a while, made one again.

Two pieces are of one person where, gone on with as each of them went, they meet in the middle of the time
between them, went about as fast the same way, and were seen about as large.
"""

import numpy as np

from kinematics.figure import Array
from tracker.outline.bodies import Path
from tracker.outline.stage import Stage

LONGEST = 1.5  # seconds that somebody may be hidden
NEAR = 0.7  # leg lengths by which the two may miss each other
SPEED = 1.0  # leg lengths a second by which they may have gone differently fast across the picture
ALIKE = 1.35  # times as large may one be seen as the other
LATELY = 1.0  # seconds before and after the time between that tell how the person went


def joined(stage: Stage, paths: list[Path], fps: float) -> list[Path]:
    """The paths with those of one person joined, the surest first."""
    found: list[Path] = []
    for path in sorted(paths, key=lambda each: each.first):
        before = [each for each in found if _one(stage, each, path, fps)]
        if before:
            nearest = max(before, key=lambda each: each.last)
            found = [each for each in found if each is not nearest]
            path = _both(stage, nearest, path)
        found.append(path)
    return sorted(found, key=lambda each: -each.worth)


def _one(stage: Stage, before: Path, after: Path, fps: float) -> bool:
    """Whether two pieces are of one person."""
    between = after.first - before.last
    if not 0 < between <= LONGEST * fps:
        return False
    n = max(round(LATELY * fps), 2)
    come, gone = _scene(stage, before)[-n:], _scene(stage, after)[:n]
    ways = [(each[-1] - each[0]) / max(len(each) - 1, 1) for each in (come, gone)]
    miss = (come[-1] + 0.5 * between * ways[0]) - (gone[0] - 0.5 * between * ways[1])
    sizes = np.array([np.median(before.units[-n:]), np.median(after.units[:n])])
    unit, faster = float(sizes.mean()), abs(ways[0][0] - ways[1][0]) * fps
    alike = sizes.max() < ALIKE * sizes.min()
    return bool(alike and np.hypot(*miss) < NEAR * unit and faster < SPEED * unit)


def _both(stage: Stage, before: Path, after: Path) -> Path:
    """One path of two, straight over the scene between them."""
    between = np.arange(before.last + 1, after.first)
    ends = [_scene(stage, before)[-1], _scene(stage, after)[0]]
    x, y = (np.interp(between, [before.last, after.first], [a, b]) for a, b in zip(*ends, strict=True))
    hips = stage.part(slice(before.last + 1, after.first)).in_frames(np.column_stack([x, y]))
    units = np.interp(between, [before.last, after.first], [before.units[-1], after.units[0]])
    return Path(
        before.first,
        np.concatenate([before.hips, hips, after.hips]),
        np.concatenate([before.units, units, after.units]),
        np.concatenate([before.score, np.zeros(len(between)), after.score]),
    )


def _scene(stage: Stage, path: Path) -> Array:
    """(n, 2) the hips where the camera saw them, the first frame's pixels."""
    return stage.part(slice(path.first, path.last + 1)).in_scene(path.hips)
