"""Motion capture as pose rows: the trials table, straight segments, another frame rate.

A pose row is POSE_COLUMNS: the hip centre in leg lengths, x forward and y over the floor, then angles in
radians, as `sagittal.project` sees them.
"""

import csv
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from kinematics.asfamc import read_amc
from kinematics.bvh import Array, MotionError, read_bvh
from kinematics.sagittal import Body, find_body, project
from kinematics.sides import exchanged
from kinematics.text_file import blanked, ordinary, why, without_commas

POSE_COLUMNS = ("root_x", "root_y", "torso", "neck", "hip_near", "knee_near", "hip_far", "knee_far")
ARM_COLUMNS = ("shoulder_near", "elbow_near", "shoulder_far", "elbow_far")
SHORTEST = 8  # frames; fewer show no motion to learn from
CURVE = "curve"  # tag of a trial that is walked or run on a bend
FROZEN = 3  # frames; this many copies of one pose are a fault of the capture, not a pause

_TABLE_COLUMNS = ("file", "subject", "trial", "activity", "fps", "segments", "tags", "licence")


@dataclass(frozen=True)
class Trial:
    """One row of a trials table.

    path     : the capture, .bvh or .amc
    fps      : frames per second of the capture
    segments : source frames (first, last + 1) in which the subject travels without stopping, or stands
    tags     : turn, curve, backwards, jump ..
    """

    path: Path
    subject: str
    trial: str
    activity: str
    fps: float
    segments: tuple[tuple[int, int], ...]
    tags: tuple[str, ...]
    licence: str


@dataclass(frozen=True)
class Sequence:
    """Poses of one straight segment.

    y     : (T, 8) pose rows, POSE_COLUMNS, or (T, 12) with ARM_COLUMNS behind; near is the right side
    label : the trial's activity
    name  : subject, trial and source frames, as in "am1_B10:26-119"
    """

    y: Array
    subject: str
    label: str
    name: str

    def __post_init__(self) -> None:
        y = np.array(self.y, dtype=np.float64)
        widths = (len(POSE_COLUMNS), len(POSE_COLUMNS) + len(ARM_COLUMNS))
        if y.ndim != 2 or y.shape[1] not in widths:
            raise ValueError(f"y must be (T, {widths[0]}) or (T, {widths[1]}); got {y.shape}")
        y.setflags(write=False)
        object.__setattr__(self, "y", y)


def read_trials(path: str | Path) -> list[Trial]:
    """Read a table of trials; a file's path in it is relative to the table. MotionError: it cannot be read,
    lacks a column, or a cell is not what it should be."""
    path = Path(path)
    try:
        with ordinary(path).open(encoding="utf-8-sig", newline="") as stream:
            table = csv.DictReader(stream)
            if said := without_commas(table.fieldnames or (), path):
                raise MotionError(said)
            missing = [name for name in _TABLE_COLUMNS if name not in (table.fieldnames or ())]
            if missing:
                raise MotionError(f"{path} lacks the column {missing[0]!r}; add it, its cells may be empty")
            return [_read_trial(path, table.line_num, row) for row in table]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise MotionError(f"cannot read {path} ({why(error)}); give a UTF-8 CSV table of trials") from error


def sequences(trial: Trial, fps: float, *, curves: bool = False, arms: bool = False) -> list[Sequence]:
    """The poses of a trial, one sequence for each straight segment of at least SHORTEST frames.

    Frames outside the segments, a T-pose among them, are dropped. So are FROZEN or more copies of one pose in
    a row: no body stands so still, and the motion is not continuous across them, so the segment is split.

    Args:
        fps: frames per second wanted.
        curves: take the whole of a trial tagged `curve`: each frame is projected from the side of the body in
            that frame, which serves as well to learn a gait.
        arms: include the arms' angles; captures without arms are left out.

    Raises:
        MotionError: the capture is missing or malformed, or does not fit its row in the table.
    """
    whole = curves and CURVE in trial.tags
    if not (whole or trial.segments):
        return []
    body = read_body(trial)
    if arms and body.arms is None:
        return []
    T = len(body.neck)
    found = []
    for first, end in [(0, T)] if whole else trial.segments:
        if end > T:
            raise MotionError(f"{trial.path} has {T} frames, its segment is {first}-{end}; correct the table")
        for start, stop in _moving(body, first, end):
            if len(_times(stop - start, trial.fps, fps)) < SHORTEST:
                continue
            seen = project(body.between(start, stop), curve=CURVE in trial.tags, arms=arms)
            y = resample(seen, trial.fps, fps)
            name = f"{trial.subject}_{trial.trial}:{start}-{stop}"
            found.append(Sequence(y, trial.subject, trial.activity, name))
    return found


def read_body(trial: Trial) -> Body:
    """Every frame of a trial's capture, T-pose included; MotionError when it does not fit its row."""
    is_amc = trial.path.suffix.lower() == ".amc"
    capture = read_amc(trial.path, fps=trial.fps) if is_amc else read_bvh(trial.path)
    if abs(capture.fps / trial.fps - 1.0) > 0.01:
        raise MotionError(
            f"{trial.path} runs at {capture.fps:.2f} frames/s, its row says {trial.fps}; correct it"
        )
    try:
        return find_body(capture)
    except MotionError as error:
        raise MotionError(f"{trial.path}: {error}") from error


def mirror(y: Array) -> Array:
    """Exchange the near and the far side of pose rows (..., 8), or (..., 12) with arms."""
    return np.asarray(y[..., exchanged((*POSE_COLUMNS, *ARM_COLUMNS)[: y.shape[-1]])])


def resample(y: Array, fps_from: float, fps_to: float) -> Array:
    """Poses (T, M) at another frame rate, from the first frame to the last that both rates reach.

    Every k-th frame where k = fps_from / fps_to is whole. Elsewhere a cubic between frames, its slope at each
    one the central difference of its neighbours (Catmull and Rom, 1974): through every frame, exact for
    parabolas. Going down, nothing is smoothed first: the angles of gait hold little above 10 Hz.
    """
    times = _times(len(y), fps_from, fps_to)
    ratio = fps_from / fps_to
    T, whole = len(y), round(ratio)
    if T < 2 or (whole >= 1 and abs(ratio - whole) < 1e-9):
        return y[:: max(whole, 1)].copy()
    from scipy.interpolate import CubicHermiteSpline  # slow to import, and tracking does without

    slopes = np.gradient(y, axis=0, edge_order=2 if T > 2 else 1)
    return np.asarray(CubicHermiteSpline(np.arange(T), y, slopes)(times))


def _read_trial(path: Path, line: int, row: dict[str, str | None]) -> Trial:
    cells = {name: (row[name] or "").strip() for name in _TABLE_COLUMNS}
    for name in ("file", "subject", "activity", "fps"):
        if not cells[name]:
            raise MotionError(f"{path}, line {line}: {name} is empty; fill it in")
    if "\0" in cells["file"]:
        raise MotionError(f"{path}, line {line}: the name of the file contains NUL; save the table as text")
    try:
        fps = float(cells["fps"])
        parts = [segment.split("-") for segment in cells["segments"].split(";") if segment.strip()]
        segments = tuple((int(first), int(end)) for first, end in parts)
    except ValueError as error:
        raise MotionError(
            f"{path}, line {line}: fps {cells['fps']!r} or segments {cells['segments']!r} cannot be read; "
            "write them as 120 and 0-48;48-251"
        ) from error
    if not 0 < fps < np.inf or any(first >= end for first, end in segments):
        raise MotionError(
            f"{path}, line {line}: fps must be above 0 and segments must not be empty; correct it"
        )
    return Trial(
        path=path.parent / cells["file"],
        subject=cells["subject"],
        trial=cells["trial"],
        activity=blanked(cells["activity"]),
        fps=fps,
        segments=segments,
        tags=tuple(tag.strip() for tag in cells["tags"].split(";") if tag.strip()),
        licence=cells["licence"],
    )


def _moving(body: Body, first: int, end: int) -> list[tuple[int, int]]:
    """Parts (start, stop) of a segment that lie between frozen frames."""
    part = body.between(first, end)
    places = np.concatenate([part.right, part.left, part.neck[:, None], part.head[:, None]], axis=1)
    steps = np.abs(np.diff(places, axis=0)).max(axis=(1, 2))
    # Rounding moves the joints of frozen frames a little; a body that pauses sways by a thousandth.
    changes = np.flatnonzero(steps > 1e-9 * body.leg_length) + 1
    cuts = [first]
    for start, stop in pairwise([0, *changes.tolist(), end - first]):
        if stop - start >= FROZEN:
            cuts += [first + start, first + stop]
    cuts.append(end)
    return [(start, stop) for start, stop in zip(cuts[::2], cuts[1::2], strict=True) if start < stop]


def _times(T: int, fps_from: float, fps_to: float) -> Array:
    """Times of the new frames that lie within T old ones, in old frames."""
    # Rounding must not lose the last frame when it falls on one of the new times.
    count = int((T - 1) * fps_to / fps_from + 1e-9) + 1
    return np.asarray(np.arange(count) * (fps_from / fps_to))
