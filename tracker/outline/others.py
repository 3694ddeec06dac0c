"""A film with nothing known of where others are, so that nobody is fitted to somebody else's outline."""

from dataclasses import replace

import numpy as np

from kinematics.figure import Array
from tracker.outline.bodies import Path
from tracker.outline.pieces import LATELY, in_scene, line
from tracker.outline.stage import Stage
from tracker.survey.evidence import NOTHING

BROAD = 1.0  # leg lengths, of a body's columns
BESIDE, ABOVE = 0.5, 1.0  # leg lengths beside and above a marked hip in which the path of who is marked lies


def path_of(stage: Stage, hip: Array, unit: float, frame: int, everybody: list[Path]) -> Path | None:
    """The path of the figure with its hip (2,) in a frame; None where none leads there.

    Where two people meet, that of who goes the way the stage faces: the other one may be the nearer. A path
    leads on for LATELY seconds, since who is behind somebody is not seen.

    Args:
        unit: pixels in a leg length.
    """
    reach, ranked = LATELY * stage.fps, []
    for path in everybody:
        if not path.first - reach <= frame <= path.last + reach:
            continue
        off = np.abs(_prolonged(stage, path)[frame] - hip) / unit
        if (off < [BESIDE, ABOVE]).all():
            scene = in_scene(stage, path)
            away = stage.facing * float(scene[0, 0] - scene[-1, 0]) > unit
            ranked.append(((away, not path.first <= frame <= path.last, float(off[0])), path))
    return min(ranked, key=lambda each: each[0])[1] if ranked else None


def without_others(stage: Stage, own: Path, everybody: list[Path]) -> Stage:
    """The film with nothing known of where others are.

    Args:
        own: path of the one about whom all else stays known.
        everybody: the paths of all; where `own` tells nothing, who is closer than a leg length to where it
            leads is left.
    """
    odds, down = stage.odds.copy(), np.linalg.inv(stage.up)
    columns, place = np.arange(odds.shape[2]), _prolonged(stage, own)
    usual = float(np.median(own.units))
    for other in everybody:
        for t in range(other.first, other.last + 1) if other is not own else ():
            hip, unit = other.hips[t - other.first, 0], max(usual, other.units[t - other.first])
            if own.first <= t <= own.last or abs(place[t, 0] - hip) > unit:
                about = np.abs(columns - (down[0, 0] * hip + down[0, 2])) < 0.5 * BROAD * down[0, 0] * unit
                odds[t][:, about] = NOTHING
    return replace(stage, odds=odds)


def _prolonged(stage: Stage, path: Path) -> Array:
    """(T, 2) the film's pixels of a path in every frame, gone on with as it went before and after it."""
    n, scene = max(round(LATELY * stage.fps), 2), in_scene(stage, path)
    (begin, back), (end, ahead) = line(scene[:n][::-1]), line(scene[-n:])
    before, after = np.arange(path.first, 0, -1), np.arange(1, len(stage) - path.last)
    ways = begin + np.outer(before, [back, 0.0]), end + np.outer(after, [ahead, 0.0])
    return stage.in_frames(np.concatenate([ways[0], scene, ways[1]]))
