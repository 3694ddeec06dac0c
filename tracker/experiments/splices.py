"""Sequences of alternating motions, spliced from captures as the papers did.

Pieces have SHORTEST to LONGEST frames; their motion, then subject, capture and place are drawn uniformly, and
near and far legs are exchanged for half of them. The SIDE frames on each side of a joint are replaced by a
least-squares cubic B-spline through twice as many.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_lsq_spline

from dynamics.gaussian import Array, Flags
from kinematics.mocap import Sequence as Capture
from kinematics.mocap import mirror
from tracker.models.centred import centred, rootless

SHORTEST, LONGEST = 28, 75  # range of a piece's length, frames
SIDE = 4
PIECES = 8
DEGREE = 3


@dataclass(frozen=True)
class Splice:
    """One spliced sequence.

    y      : (T, 8) poses, the root not measured
    labels : (T,) the motion of each frame
    joints : frames at which another piece begins, at least one
    """

    y: Array
    labels: tuple[str, ...]
    joints: tuple[int, ...]

    def far(self, frames: int) -> Flags:
        """(T,) whether a frame is more than so many frames from every joint."""
        t = np.arange(len(self.y))
        apart = [np.where(t < joint, joint - t, t - joint + 1) for joint in self.joints]
        return np.asarray(np.min(apart, axis=0) > frames)


def long_enough(captures: Sequence[Capture]) -> list[Capture]:
    """The captures that are long enough for a piece."""
    return [c for c in captures if len(c.y) >= SHORTEST]


def splice(captures: Sequence[Capture], rng: np.random.Generator, pieces: int) -> Splice:
    """One sequence of two or more pieces from captures that are `long_enough`, with all of their motions."""
    motions = sorted({c.label for c in captures})
    parts, labels = [], []
    for _ in range(pieces):
        motion = motions[rng.integers(len(motions))]
        subjects = sorted({c.subject for c in captures if c.label == motion})
        subject = subjects[rng.integers(len(subjects))]
        theirs = [c for c in captures if (c.label, c.subject) == (motion, subject)]
        parts.append(_piece(theirs[rng.integers(len(theirs))].y, rng))
        labels += [motion] * len(parts[-1])
    joints = tuple(np.cumsum([len(part) for part in parts])[:-1].tolist())
    y = np.concatenate(parts)
    for joint in joints:
        y[joint - SIDE : joint + SIDE] = _joined(y[joint - 2 * SIDE : joint + 2 * SIDE])
    return Splice(rootless(y), tuple(labels), joints)


def _piece(y: Array, rng: np.random.Generator) -> Array:
    length = int(rng.integers(SHORTEST, min(LONGEST, len(y)) + 1))
    first = int(rng.integers(len(y) - length + 1))
    piece = centred(y[first : first + length])
    return mirror(piece) if rng.random() < 0.5 else piece


def _joined(y: Array) -> Array:
    """The middle half of 4 SIDE frames, smoothed by a spline with knots where that half begins and ends."""
    t = np.arange(len(y), dtype=float)
    ends = [t[0]] * (DEGREE + 1), [t[-1]] * (DEGREE + 1)
    knots = np.r_[ends[0], [SIDE - 0.5, 3.0 * SIDE - 0.5], ends[1]]
    middle: Array = make_lsq_spline(t, y, knots, k=DEGREE)(t[SIDE:-SIDE])
    return middle
