"""What captures show of walks and runs, and the gait of a rendered figure made of it.

A capture gives the angles; the figure has its own lengths, so the floor gives the rest, as in
`tracker.scene.steps`: the root is carried so that a foot which stands is on the floor and stays where it is.
Between such times, in the flight of a run, the root moves as the capture's does. A capture too short for a
film goes on from an earlier moment at which pose and motion are most like those at its end.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from kinematics.mocap import CURVE, Trial, mirror, read_body, sequences
from kinematics.sagittal import Body
from tracker.scene.steps import Array, Build, Gait

GAITS = ("walk", "run")
RATE = 480.0  # moments a second at which feet and floor are reckoned
SHORTEST, LONGEST = 0.45, 2.0  # seconds that a capture is taken back by
BLEND = 0.15  # seconds over which the pose goes on from the last to the earlier one
STRIDE = 1.2  # seconds within which some foot stands
SLOWEST = 0.8  # leg lengths a second that a walk is taken to make at least
STILL = 0.4  # of that pace; a foot as slow stands
LOW = 0.1  # leg lengths over the lowest; a foot as low stands
STANDS = 0.3  # total weight from which somebody does
SETTLING = 0.02  # seconds over which a change of the standing foot is spread
# Degrees: mean and swing against the leg of the upper arm, mean and swing of the elbow's flexion.
ARMS = {"walk": (-6.0, 0.75, 24.0, 9.0), "run": (-15.0, 1.0, 86.0, 18.0)}


@dataclass(frozen=True)
class Motion:
    """One straight segment of a capture, or a whole one on a bend.

    y    : (T, 8) pose rows, kinematics.mocap.POSE_COLUMNS
    feet : (T, 2) pitch of the near and the far foot, radians, toe up positive, 0 where it stands flat
    fps  : frames a second
    """

    y: Array
    feet: Array
    fps: float
    label: str
    name: str

    @property
    def seconds(self) -> float:
        return (len(self.y) - 1) / self.fps

    @property
    def mirrored(self) -> "Motion":
        """The other leg near."""
        return replace(self, y=mirror(self.y), feet=self.feet[:, ::-1])

    def prolonged(self, seconds: float) -> "Motion":
        """At least so long."""
        y, feet = self.y, self.feet
        first, last = _alike(np.concatenate([y[:, 1:], feet], axis=1), self.fps)
        rows, again = np.concatenate([y, feet], axis=1)[: last + 1], slice(first + 1, last + 1)
        repeated = rows[again].copy()
        while (len(rows) - 1) / self.fps < seconds:
            rest = np.clip(1.0 - np.arange(1, len(repeated) + 1) / (BLEND * self.fps), 0.0, 1.0)[:, None]
            further = repeated + rest * (rows[-1] - rows[first])
            further[:, 0] = rows[-1, 0] + repeated[:, 0] - rows[first, 0]
            rows = np.concatenate([rows, further])
        return replace(self, y=rows[:, :8], feet=rows[:, 8:])


def motions(trial: Trial) -> list[Motion]:
    """Those of one row of the table, at the capture's own rate.

    Raises:
        MotionError: as `kinematics.mocap.sequences`.
    """
    body, found = read_body(trial), []
    for sequence in sequences(trial, trial.fps, curves=CURVE in trial.tags):
        start, stop = map(int, sequence.name.rpartition(":")[2].split("-"))
        pitch = _pitch(body.between(start, stop))
        found.append(Motion(np.array(sequence.y), pitch, trial.fps, trial.activity, sequence.name))
    return found


def gait_of(motion: Motion, build: Build, times: Array, swing: float = 1.0) -> Gait:
    """The motion of a figure of these lengths at some times, seconds from the motion's first row.

    Args:
        times: (S,) within the motion.
        swing: of the arms, 1 as usual.
    """
    moments = np.arange(int(motion.seconds * RATE) + 1) / RATE
    rows = np.concatenate([motion.y, motion.feet], axis=1)
    rows = CubicSpline(np.arange(len(rows)) / motion.fps, rows)(moments)
    y, wanted = rows[:, :8], rows[:, 8:]
    y[:, :2], foot = _on_floor(y, wanted, build)
    arms, phase = _arms(y[:, 4] - y[:, 6], motion.label, swing)
    everything = np.concatenate([y, foot, arms, phase[:, None]], axis=1)
    at = np.stack([np.interp(times, moments, column) for column in everything.T], axis=1)
    return Gait(pose=at[:, :8], foot=at[:, 8:10], arms=at[:, 10:14], phase=at[:, 14])


def _pitch(body: Body) -> Array:
    """(T, 2) pitch of right and left foot, against the pitch at which each stands."""
    forward = np.cross(body.left[:, 0] - body.right[:, 0], [0.0, 1.0, 0.0])
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    found = []
    for leg in (body.right, body.left):
        foot = leg[:, 3] - leg[:, 2]
        pitch = np.unwrap(np.arctan2(foot[:, 1], (foot * forward).sum(axis=1)))
        speed = np.linalg.norm(np.gradient(leg[:, 3], axis=0), axis=-1)
        found.append(pitch - np.median(pitch[speed <= np.quantile(speed, 0.25)]))
    return np.stack(found, axis=1)


def _alike(rows: Array, fps: float) -> tuple[int, int]:
    """An earlier and a late frame that show the most alike pose and motion."""
    T = len(rows)
    motion = np.concatenate([rows, 0.1 * fps * np.gradient(rows, axis=0)], axis=1)
    best = (np.inf, 0, T - 1)
    for last in range(max(T - int(0.4 * fps), 2), T - 1):
        nearest, farthest = last - int(SHORTEST * fps), max(last - int(LONGEST * fps), 0)
        away = np.linalg.norm(motion[farthest:nearest] - motion[last], axis=1)
        if len(away):
            best = min(best, (float(away.min()), farthest + int(away.argmin()), last))
    return best[1:]


def _on_floor(y: Array, wanted: Array, build: Build) -> tuple[Array, Array]:
    """(S, 2) root over the floor and (S, 2) pitch of the feet, neither heel nor toe below it."""
    hips, knees = y[:, [4, 6]], y[:, [5, 7]]
    ahead = build.thigh * np.sin(hips) + build.shank * np.sin(hips - knees)
    drop = build.thigh * np.cos(hips) + build.shank * np.cos(hips - knees)
    ends = np.array([-build.heel, build.toe])[:, None, None]
    height = (ends * np.sin(wanted) - build.ankle * np.cos(wanted)).min(axis=0) + y[:, 1:2] - drop
    place = y[:, :1] + ahead + ends * np.cos(wanted) + build.ankle * np.sin(wanted)  # (2, S, 2)
    speeds = np.gradient(place, axis=1)
    slower = np.abs(speeds).argmin(axis=0)[None]
    slip = np.take_along_axis(speeds, slower, axis=0)[0]

    pace = max((y[-1, 0] - y[0, 0]) / len(y), SLOWEST / RATE)
    under = minimum_filter1d(height.min(axis=1), int(0.5 * STRIDE * RATE), mode="nearest")
    weight = np.exp(-((slip / (STILL * pace)) ** 2) - ((height - under[:, None]) / LOW) ** 2)
    total = weight.sum(axis=1)
    stands = np.flatnonzero(total > STANDS)
    share = weight / np.maximum(total, STANDS)[:, None]
    floor = np.interp(np.arange(len(y)), stands, (share * height).sum(axis=1)[stands])

    root_x = y[:, 0] - np.cumsum(_settled((share * slip).sum(axis=1)))
    root_y = y[:, 1] - _settled(floor)
    return np.stack([root_x, root_y], axis=1), _within(wanted, root_y[:, None] - drop, build)


def _settled(values: Array) -> Array:
    return np.asarray(gaussian_filter1d(values, SETTLING * RATE, mode="nearest"))


def _within(wanted: Array, ankle_height: Array, build: Build) -> Array:
    """The pitch of feet as near to the one wanted as the floor allows."""
    to_toe, to_heel = np.hypot(build.toe, build.ankle), np.hypot(build.heel, build.ankle)
    lowest = np.arctan2(build.ankle, build.toe) - np.arcsin(np.clip(ankle_height / to_toe, -1.0, 1.0))
    highest = np.arcsin(np.clip(ankle_height / to_heel, -1.0, 1.0)) - np.arctan2(build.ankle, build.heel)
    # An ankle higher than the foot is long lets it hang as it will.
    lowest = np.where(ankle_height >= to_toe, -np.pi, lowest)
    highest = np.where(ankle_height >= to_heel, np.pi, highest)
    return np.asarray(np.clip(wanted, np.minimum(lowest, 0.0), np.maximum(highest, 0.0)))


def _arms(apart: Array, label: str, swing: float) -> tuple[Array, Array]:
    """(S, 4) arms that swing against the legs, and (S,) strides walked, of the angle between the thighs."""
    smooth = gaussian_filter1d(apart - apart.mean(), 0.03 * RATE, mode="nearest")
    speed = gaussian_filter1d(np.gradient(smooth), 0.03 * RATE, mode="nearest")
    phase = np.unwrap(np.arctan2(-speed / speed.std(), smooth / smooth.std())) / (2.0 * np.pi)
    mean, share, elbow, bend = ARMS[label]
    arms = []
    for side in (-1.0, 1.0):
        arms += [np.radians(mean) + 0.5 * side * swing * share * smooth]
        arms += [np.radians(elbow + bend * side * swing * smooth / np.abs(smooth).max())]
    return np.stack(arms, axis=1), phase
