"""Motion capture as pose rows: the trials table, the sagittal plane, another frame rate.

A pose row is POSE_COLUMNS: the hip centre in leg lengths, x forward and y over the floor, then angles in
radians. Forward is the way the figure faces, so who walks backwards has a falling root_x. With v seen in the
plane spanned by forward f and up u, a segment leans by atan2(v.f, v.u) from the vertical and swings by
atan2(v.f, -v.u) from hanging; a knee's flexion is the thigh's swing less the shank's. Up is the floor's
normal: where a capture's floor rises along the way its axes are askew, not the laboratory.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinematics.asfamc import read_amc
from kinematics.bvh import Capture, MotionError, read_bvh

Array = NDArray[np.float64]

POSE_COLUMNS = ("root_x", "root_y", "torso", "neck", "hip_near", "knee_near", "hip_far", "knee_far")
SHORTEST = 8  # frames; less holds no motion to learn from

_MIRRORED = [0, 1, 2, 3, 6, 7, 4, 5]
_TABLE_COLUMNS = ("file", "subject", "trial", "activity", "fps", "segments", "tags", "licence")
_UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Trial:
    """One row of a trials table.

    path     : the capture, .bvh or .amc
    fps      : frames per second of the capture
    segments : source frames (first, last + 1) in which the subject travels without stopping
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

    y     : (T, 8) pose rows, POSE_COLUMNS; near is the right side
    label : the trial's activity
    name  : subject, trial and source frames, as in "am1_B10:26-119"
    """

    y: Array
    subject: str
    label: str
    licence: str
    name: str

    def __post_init__(self) -> None:
        y = np.array(self.y, dtype=np.float64)
        if y.ndim != 2 or y.shape[1] != len(POSE_COLUMNS):
            raise ValueError(f"y must be (T, {len(POSE_COLUMNS)}); got {y.shape}")
        y.setflags(write=False)
        object.__setattr__(self, "y", y)


@dataclass(frozen=True)
class Body:
    """The joints that the figure has, in space.

    right, left : (T, 4, 3) hip, knee, ankle and ball of the foot
    neck, head  : (T, 3) base of the neck, top of the head
    """

    right: Array
    left: Array
    neck: Array
    head: Array

    @property
    def leg_length(self) -> float:
        """Thigh and shank, the mean of both sides, in the capture's unit."""
        bones = np.linalg.norm(np.diff(np.stack([self.right, self.left])[:, :, :3], axis=2), axis=-1)
        return float(np.median(bones.sum(axis=-1), axis=1).mean())

    def between(self, first: int, end: int) -> "Body":
        """Frames first .. end - 1."""
        part = slice(first, end)
        return Body(self.right[part], self.left[part], self.neck[part], self.head[part])


@dataclass(frozen=True)
class _Dialect:
    """What a family of files calls the figure's joints; several names for the neck mean their mean."""

    leg: str
    sides: tuple[str, str]
    neck: tuple[str, ...]
    head: str

    @property
    def legs(self) -> list[list[str]]:
        return [self.leg.replace("*", side).split() for side in self.sides]

    @property
    def names(self) -> set[str]:
        right, left = self.legs
        return {*right, *left, *self.neck, self.head}


_DIALECTS = (
    _Dialect("*UpLeg *Leg *Foot *ToeBase", ("Right", "Left"), ("Neck",), "Head_end"),
    _Dialect("UpperLeg_* LowerLeg_* Foot_* Toes_*", ("R", "L"), ("Neck",), "Head"),
    _Dialect("*UpLeg *Leg *Foot *Toes", ("Right", "Left"), ("LeftArm", "RightArm"), "HEad_end"),
    _Dialect("*hipjoint *femur *tibia *foot", ("r", "l"), ("thorax",), "head"),
)


def read_trials(path: str | Path) -> list[Trial]:
    """Read a table of trials; a file's path in it is relative to the table.

    Raises:
        MotionError: the table cannot be read, lacks a column, or a cell is not what it should be.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            table = csv.DictReader(stream)
            missing = [name for name in _TABLE_COLUMNS if name not in (table.fieldnames or ())]
            if missing:
                raise MotionError(f"{path} lacks the column {missing[0]!r}; add it, its cells may be empty")
            return [_read_trial(path, table.line_num, row) for row in table]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise MotionError(f"cannot read {path} ({error}); give a UTF-8 CSV table of trials") from error


def sequences(trial: Trial, fps: float) -> list[Sequence]:
    """The poses of a trial, one sequence for each straight segment of at least SHORTEST frames.

    Frames outside the segments, a T-pose among them, are dropped.

    Args:
        trial: a row of the table.
        fps: frames per second wanted.

    Raises:
        MotionError: the capture is missing or malformed, or does not fit its row in the table.
        ValueError: fps is not above 0.
    """
    if not trial.segments:
        return []
    body = read_body(trial)
    T = len(body.neck)
    found = []
    for first, end in trial.segments:
        if end > T:
            raise MotionError(f"{trial.path} has {T} frames, its segment is {first}-{end}; correct the table")
        if len(_times(end - first, trial.fps, fps)) < SHORTEST:
            continue
        y = resample(project(body.between(first, end), curve="curve" in trial.tags), trial.fps, fps)
        name = f"{trial.subject}_{trial.trial}:{first}-{end}"
        found.append(Sequence(y, trial.subject, trial.activity, trial.licence, name))
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


def find_body(capture: Capture) -> Body:
    """The figure's joints among a capture's; MotionError when its names are of no known dialect."""
    dialect = min(_DIALECTS, key=lambda dialect: len(dialect.names - set(capture.names)))
    missing = sorted(dialect.names - set(capture.names))
    if missing:
        raise MotionError(
            f"no joint is called {', '.join(missing)} among {', '.join(capture.names)}; "
            "rename the joints as the CMU, Bandai-Namco or SNU files do"
        )
    neck = np.mean([capture.at(name) for name in dialect.neck], axis=0)
    right, left = (np.stack([capture.at(name) for name in leg], axis=1) for leg in dialect.legs)
    return Body(right, left, neck, capture.at(dialect.head))


def project(body: Body, *, curve: bool = False) -> Array:
    """See a body from its right side, in the plane of its travel.

    Args:
        body: one straight segment, T frames.
        curve: the way bends, so each frame is seen across the way the hips face in it.

    Returns:
        (T, 8) pose rows, POSE_COLUMNS; root_x starts at 0, near is the right side. The floor is the line,
        tilted along the way, on which the balls of the feet stand.
    """
    hips = (body.right[:, 0] + body.left[:, 0]) / 2.0
    level = _facing(body) if curve else _heading(hips, body)
    slope, ground = _floor(body, hips, level, tilted=not curve)
    forward, up = _unit(level + slope * _UP), _unit(_UP - slope * level)

    def lean(v: Array) -> Array:
        return np.asarray(np.arctan2(_dot(v, forward), _dot(v, up)))

    steps = _dot(np.diff(hips, axis=0), (forward[1:] + forward[:-1]) / 2.0)
    root = np.stack([np.concatenate([[0.0], np.cumsum(steps)]), _dot(hips - ground, up)]) / body.leg_length
    torso = lean(body.neck - hips)
    neck = _wrap(lean(body.head - body.neck) - torso)
    leg_angles = []
    for leg in (body.right, body.left):
        # What leans back from knee to hip swings forward from hip to knee.
        thigh, shank = -lean(leg[:, 0] - leg[:, 1]), -lean(leg[:, 1] - leg[:, 2])
        leg_angles += [thigh, _wrap(thigh - shank)]
    return np.stack([*root, torso, neck, *leg_angles], axis=1)


def mirror(y: Array) -> Array:
    """Exchange the near and the far leg of pose rows (..., 8)."""
    return np.asarray(y[..., _MIRRORED])


def resample(y: Array, fps_from: float, fps_to: float) -> Array:
    """Poses at another frame rate, from the first frame to the last that both rates reach.

    Every k-th frame where k = fps_from / fps_to is whole. Elsewhere a cubic between frames, its slope at each
    one the central difference of its neighbours (Catmull and Rom, 1974): through every frame, exact for
    parabolas. Going down, nothing is smoothed first: the angles of gait hold little above 10 Hz.

    Args:
        y: (T, M) poses.
        fps_from, fps_to: frames per second of y, and wanted.

    Raises:
        ValueError: a rate is not above 0.
    """
    times = _times(len(y), fps_from, fps_to)
    ratio = fps_from / fps_to
    T, whole = len(y), round(ratio)
    if T < 2 or (whole >= 1 and abs(ratio - whole) < 1e-9):
        return y[:: max(whole, 1)].copy()
    slopes = np.gradient(y, axis=0, edge_order=2 if T > 2 else 1)
    i = np.minimum(times.astype(np.intp), T - 2)
    u = (times - i)[:, None]
    step = y[i + 1] - y[i]
    bend = (1.0 - u) * (slopes[i] - step) - u * (slopes[i + 1] - step)
    return np.asarray(y[i] + u * step + u * (1.0 - u) * bend)


def _read_trial(path: Path, line: int, row: dict[str, str | None]) -> Trial:
    cells = {name: (row[name] or "").strip() for name in _TABLE_COLUMNS}
    for name in ("file", "subject", "activity", "fps"):
        if not cells[name]:
            raise MotionError(f"{path}, line {line}: {name} is empty; fill it in")
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
        activity=cells["activity"],
        fps=fps,
        segments=segments,
        tags=tuple(tag.strip() for tag in cells["tags"].split(";") if tag.strip()),
        licence=cells["licence"],
    )


def _times(T: int, fps_from: float, fps_to: float) -> Array:
    """Times of the new frames that lie within T old ones, in old frames."""
    if not (0 < fps_from < np.inf and 0 < fps_to < np.inf):
        raise ValueError(f"frame rates must be above 0; got {fps_from} and {fps_to}")
    # Rounding must not lose the last frame when it falls on one of the new times.
    count = int((T - 1) * fps_to / fps_from + 1e-9) + 1
    return np.asarray(np.arange(count) * (fps_from / fps_to))


def _dot(v: Array, w: Array) -> Array:
    return np.asarray((v * w).sum(axis=-1))


def _unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _wrap(angle: Array) -> Array:
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _facing(body: Body) -> Array:
    """Where the hips face, (T, 3), level and of length 1."""
    return _unit(np.cross(body.left[:, 0] - body.right[:, 0], _UP))


def _heading(hips: Array, body: Body) -> Array:
    """The line of travel, (T, 3), pointing where the body faces on the whole."""
    facing = _facing(body).mean(axis=0)
    travel = (hips[-1] - hips[0]) * (1.0 - _UP)
    # Who stays on the spot has no line of travel.
    if np.linalg.norm(travel) < 0.5 * body.leg_length:
        return np.broadcast_to(_unit(facing), hips.shape)
    return np.broadcast_to(_unit(travel * np.copysign(1.0, travel @ facing)), hips.shape)


def _floor(body: Body, hips: Array, forward: Array, *, tilted: bool) -> tuple[float, Array]:
    """Rise of the floor along the way, and its point (3,) under the hips of the first frame.

    A ball of the foot stands where it moves at less than a tenth of the speed it has in swing. What then lies
    above the line drawn, a foot already lifting or a frozen frame, is left out of the next one.
    """
    balls = np.stack([body.right[:, 3], body.left[:, 3]], axis=1)
    speed = np.linalg.norm(np.gradient(balls, axis=0), axis=-1)
    stands = speed <= 0.1 * np.quantile(speed, 0.95)
    if not stands.any():
        return 0.0, np.array([hips[0, 0], balls[..., 1].min(), hips[0, 2]])
    place = _dot(balls - hips[0], forward[:, None])[stands]
    height = balls[..., 1][stands]
    slope, base = 0.0, float(np.median(height))
    for _ in range(3):
        low = height <= base + slope * place + 0.03 * body.leg_length
        # Steps on one spot say nothing of the tilt.
        if tilted and np.ptp(place[low]) > body.leg_length:
            slope, base = (float(c) for c in np.polyfit(place[low], height[low], 1))
        else:
            slope, base = 0.0, float(height[low].mean())
    return slope, np.array([hips[0, 0], base, hips[0, 2]])
