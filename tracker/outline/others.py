"""The places of other people set to unknown, so that a figure is not fitted to them."""

import numpy as np

from kinematics.figure import Array
from tracker.outline.bodies import Path
from tracker.outline.pieces import LATELY, in_scene, line
from tracker.outline.stage import Stage
from tracker.survey.evidence import NOTHING

BROAD = 1.0  # width of the columns removed for a body, leg lengths
BESIDE, ABOVE = 0.5, 1.0  # range beside and above a marked hip in which its path may lie, leg lengths


def path_of(stage: Stage, hip: Array, unit: float, frame: int, everybody: list[Path]) -> Path | None:
    """The path of the figure with its hip (2,) in a frame; None if no path leads there.

    Where two people meet, the path in the direction that the figure faces is taken, even if the other is
    nearer. A path is prolonged by LATELY seconds, since a person behind another is not seen.
    """
    reach, ranked = LATELY * stage.fps, []
    for path in everybody:
        if not path.first - reach <= frame <= path.last + reach:
            continue
        off = np.abs(_prolonged(stage, path)[frame] - hip) / unit
        if (off < [BESIDE, ABOVE]).all():
            scene = in_scene(stage, path)
            away = stage.facing * float(scene[0, 0] - scene[-1, 0]) > unit * stage.zoom[frame]
            ranked.append(((away, not path.first <= frame <= path.last, float(off[0])), path))
    return min(ranked, key=lambda each: each[0])[1] if ranked else None


def forget_others(stage: Stage, own: Path, everybody: list[Path]) -> None:
    """Set the places of all but one of everybody to unknown; changes the stage's log odds.

    Outside the frames of that path, bodies within a leg length of its prolongation stay too.
    """
    down, place = np.linalg.inv(stage.up), _prolonged(stage, own)
    columns = np.arange(stage.odds.shape[2])
    usual = float(np.median(own.units))
    for other in everybody:
        for t in range(other.first, other.last + 1) if other is not own else ():
            hip, unit = other.hips[t - other.first, 0], max(usual, other.units[t - other.first])
            if own.first <= t <= own.last or abs(place[t, 0] - hip) > unit:
                about = np.abs(columns - (down[0, 0] * hip + down[0, 2])) < 0.5 * BROAD * down[0, 0] * unit
                stage.odds[t][:, about] = NOTHING


def _prolonged(stage: Stage, path: Path) -> Array:
    """(T, 2) pixels of the film for a path in every frame, continued at its velocity before and after."""
    n, scene = max(round(LATELY * stage.fps), 2), in_scene(stage, path)
    (begin, back), (end, ahead) = line(scene[:n][::-1]), line(scene[-n:])
    before, after = np.arange(path.first, 0, -1), np.arange(1, len(stage) - path.last)
    ways = begin + np.outer(before, [back, 0.0]), end + np.outer(after, [ahead, 0.0])
    return stage.in_frames(np.concatenate([ways[0], scene, ways[1]]))
