"""Filling gaps of a pose table by a switching model, by the harmonic stride, or by the more probable one.

Both are compared on the angles measured around a gap, at frames far enough apart that both must bridge the
time between them (`dynamics.periodic.filling`): frame by frame the switching model would win in gait too, as
it follows measured frames more closely than it bridges missing ones. If its evidence, that of its best path,
is greater, it fills the gap: the motion is not periodic. The figure's place and the neck's angle are
subtracted before and added afterwards, and a figure that goes backwards is filled with its frames in reversed
order, as in `tracker.motion.tasks`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynamics.gaussian import Array, Gaussian, Ints
from dynamics.motion.gaps import interpolate
from dynamics.motion.noise import SEARCHES, at_noise
from dynamics.periodic.filling import MOST, NOISES, Filling, around, fill, gaps, spaced
from dynamics.slds import SLDS
from dynamics.store import Model, load_shipped
from dynamics.stride import Stride
from dynamics.viterbi import best_log_p_all
from kinematics.mocap import POSE_COLUMNS
from tracker.models.centred import centred, own_offset, rootless
from tracker.motion.tasks import (
    SILENT,
    UNKNOWN_ANGLES,
    UNKNOWN_NECK,
    UNKNOWN_PLACE,
    check_names,
    first_measured,
    whole_pose,
)
from tracker.progress import Progress
from tracker.tables.poses import ROOT_COLUMNS, PoseSequence

BY_EVIDENCE = "gait"  # name of the model with which the stride is compared
STRIDE = "stride"
BY_STRIDE, BY_SWITCHING = "stride", "switching model"


@dataclass(frozen=True)
class Filled:
    """A sequence without gaps.

    y, sd : (T, 8) poses, with measured numbers unchanged, and standard deviations; body units. A place that
            was never measured stays NaN; so does the deviation of measured numbers
    by    : the model that filled each gap, BY_STRIDE or BY_SWITCHING
    """

    y: Array
    sd: Array
    by: tuple[str, ...] = ()


@dataclass(frozen=True)
class Fillers:
    """The models that fill gaps: one of the two, or for each gap the one with more evidence around it.

    slds : at the table's frame rate and noise
    fps  : frames a second of the table
    """

    slds: SLDS | None
    stride: Stride | None
    fps: float


def fillers(name: str, model: Model, fps: float) -> Fillers:
    """The fillers for a model with this name; ValueError if it cannot fill gaps."""
    if isinstance(model, Stride):
        check_names(model.names)
        return Fillers(None, model, fps)
    slds = whole_pose(model, "interpolate")
    shipped = load_shipped(STRIDE, fps) if name == BY_EVIDENCE else None
    return Fillers(slds, shipped if isinstance(shipped, Stride) else None, fps)


def at_table_noise(slds: SLDS, sequences: Sequence[PoseSequence], progress: Progress = SILENT) -> SLDS:
    """The model with R raised to the noise of these sequences; PosesError: one has no measured number."""
    for sequence in sequences:
        first_measured(sequence)
    ys = [centred(sequence.y[sequence.order(slds.fps)]) for sequence in sequences]
    with progress.task("measuring the noise", SEARCHES) as tick:
        return replace(slds, R=at_noise(slds.with_constants(UNKNOWN_PLACE), ys, tick).R)


def fill_gaps(fillers: Fillers, sequence: PoseSequence, rng: np.random.Generator) -> Filled:
    """Fill every unmeasured number from the measured ones before and after.

    PosesError: no number was measured; ValueError: a gap is too long, or only a stride is given, and no angle
    was measured near a gap.
    """
    first_measured(sequence)
    seen = sequence.seen
    placed = np.ones(len(POSE_COLUMNS), dtype=bool)
    placed[:ROOT_COLUMNS] = seen[:, :ROOT_COLUMNS].any(0)
    if (seen | ~placed).all():
        return Filled(sequence.y, np.full(sequence.y.shape, np.nan))
    order = sequence.order(fillers.fps)
    taken = own_offset(sequence.y[order])
    found, by = _poses(fillers, sequence.y[order] - taken, rng)
    found, by = found[order], by[order]
    sd = np.sqrt(np.diagonal(found.cov, axis1=1, axis2=2))
    for name, unknown in UNKNOWN_NECK.items():
        column = POSE_COLUMNS.index(name)
        if not seen[:, column].any():
            sd[:, column] = np.hypot(sd[:, column], unknown)
    filled = np.where(seen, sequence.y, found.mean + taken)
    return Filled(np.where(placed, filled, np.nan), np.where(placed & ~seen, sd, np.nan), by)


def angles_evidence(slds: SLDS, window: Array, fps: float) -> float:
    """Log density of the best path through a window's angles (T, 8), comparable with a stride's, nats.

    The added noise is the likeliest among those that are tried for a stride.
    """
    shown = spaced(rootless(window), fps)
    best = -np.inf
    for noise in (0.0, *NOISES):
        noisy = replace(slds, R=slds.R + np.diag(np.where(slds.travels, 0.0, noise**2)))
        log_p = float(best_log_p_all(noisy, [shown])[0])
        if log_p <= best:
            break
        best = log_p
    return best


def _poses(fillers: Fillers, y: Array, rng: np.random.Generator) -> tuple[Gaussian, tuple[str, ...]]:
    """Poses (T, 8) and covariances of the frames in gaps, and the model that filled each gap."""
    slds, stride = fillers.slds, fillers.stride
    found: list[Filling | None] = []
    if stride is not None:
        found = [_by_stride(stride, slds, y, rows, fillers.fps) for rows in gaps(stride, y, fillers.fps)]
    if slds is not None and (stride is None or None in found):
        try:
            whole = interpolate(slds, y, rng, constants=UNKNOWN_ANGLES)
        except np.linalg.LinAlgError as error:
            raise ValueError(
                "a gap is so long that the model's poses grow without limit; "
                "give the frames after it a seq of their own"
            ) from error
    else:
        whole = Gaussian(y.copy(), np.zeros((*y.shape, y.shape[1])))
    for gap in found:
        if gap is not None:
            whole.mean[gap.rows], whole.cov[gap.rows] = gap.poses.mean, gap.poses.cov
    return whole, tuple(BY_SWITCHING if gap is None else BY_STRIDE for gap in found)


def _by_stride(stride: Stride, slds: SLDS | None, y: Array, rows: Ints, fps: float) -> Filling | None:
    """A gap filled by the stride; None where the switching model explains its neighbourhood better."""
    window = y[around(y, rows, fps)]
    if slds is None:
        return fill(stride, y, rows, fps)
    if len(rows) > MOST or np.isnan(window[:, ROOT_COLUMNS:]).all():
        return None
    gap = fill(stride, y, rows, fps)
    return gap if gap.log_evidence >= angles_evidence(slds, window, fps) else None
