"""The summaries that the motion commands print: a line or two of figures."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from dynamics.gaussian import Array
from dynamics.motion.tasks import Labelling
from tracker.models.centred import ANGLES
from tracker.motion.fill import Filled
from tracker.progress import counted
from tracker.tables.poses import PoseSequence


def label_shares(sequences: Sequence[PoseSequence], found: Sequence[Labelling]) -> list[str]:
    """Measured frames of each motion found, and the agreement with the table's own labels."""
    pairs = list(zip(sequences, found, strict=True))
    labels = [f.label[t] for s, f in pairs for t in np.flatnonzero(s.seen.any(axis=1))]
    counts = Counter(labels)
    parts = [f"{motion} {100.0 * counts[motion] / len(labels):.1f} %" for motion in found[0].labels]
    lines = [f"{counted(len(labels), 'frame')} in {counted(len(sequences), 'sequence')}: {', '.join(parts)}"]
    told = [(own, label) for s, f in pairs for own, label in zip(s.labels, f.label, strict=True) if own]
    if told:
        right = 100.0 * np.mean([own == label for own, label in told])
        lines.append(f"the table's own label on {right:.2f} % of {counted(len(told), 'frame')} that have one")
    return lines


def forecast_errors(sequences: Sequence[PoseSequence], means: Sequence[Array], horizon: int) -> str:
    """Errors of forecasts from later measurements, beside those of the pose `horizon` frames before."""
    errors, still = [], []
    for sequence, mean in zip(sequences, means, strict=True):
        T = len(sequence)
        away = np.degrees(mean[horizon:T] - sequence.y[horizon:])[:, ANGLES]
        kept = np.degrees(sequence.y[: max(0, T - horizon)] - sequence.y[horizon:])[:, ANGLES]
        both = np.isfinite(away) & np.isfinite(kept)
        errors.append(away[both])
        still.append(kept[both])
    e, k = np.concatenate(errors), np.concatenate(still)
    ahead = f"{counted(horizon, 'frame')} ahead in {counted(len(sequences), 'sequence')}"
    if not len(e):
        return f"forecasts {ahead}; nothing was measured to compare them with"
    rmse, before = np.sqrt((e**2).mean()), np.sqrt((k**2).mean())
    return (
        f"forecasts {ahead}: {rmse:.2f} degrees RMSE over the angles against what was then measured; "
        f"an unchanged pose {before:.2f}"
    )


def filled_cells(sequences: Sequence[PoseSequence], filled: Sequence[Filled]) -> str:
    """Numbers of filled cells, their standard deviations, and the cells that stay empty."""
    missing = sum(int((~s.seen).sum()) for s in sequences)
    done = sum(int(np.isfinite(f.sd).sum()) for f in filled)
    frames = sum(int(np.isfinite(f.sd).any(1).sum()) for f in filled)
    of_all = counted(len(sequences), "sequence")
    if not missing:
        return f"nothing was missing in {of_all}"
    text = f"{counted(done, 'cell')} filled in {counted(frames, 'frame')} of {of_all}"
    sds = np.concatenate([f.sd[:, ANGLES][np.isfinite(f.sd[:, ANGLES])] for f in filled])
    if len(sds):
        text += f", angles to {np.degrees(np.sqrt((sds**2).mean())):.1f} degrees by the model's own account"
    by = Counter(name for f in filled for name in f.by)
    if by:
        text += f"; gaps filled by the {' and the '.join(f'{name} {count}' for name, count in by.items())}"
    if missing > done:
        text += f"; {missing - done} of a root that was never measured stay empty"
    return text


def unseen_frames(sequences: Sequence[PoseSequence]) -> list[str]:
    """A line on the frames that `track` did not see; none if it saw the pose in all of them."""
    unseen = sum(sequence.unseen for sequence in sequences)
    return [f"{counted(unseen, 'frame')} lost or outside, taken as missing"] if unseen else []


def free_motion(model: str, labels: Sequence[str], fps: float) -> str:
    """The motions of a synthesis."""
    counts = Counter(labels)
    parts = [f"{motion} {100.0 * count / len(labels):.0f} %" for motion, count in counts.items()]
    return f"{counted(len(labels), 'frame')} of {model} at {fps:g} a second: {', '.join(parts)}"
