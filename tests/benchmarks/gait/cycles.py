"""Learn tracker/outline/cycles.npz from captures, for `make models`.

    python -m tests.benchmarks.gait.cycles TRIALS OUT.npz --licence CMU --licence "Seoul National"

Strides are cut where the near thigh is farthest ahead of the far one, brought to PHASES poses each, and
averaged with their own mirror image half a stride later. k-means gathers them to a few kinds. Two kinds that
hardly any capture shows are made of the mean walk: one on bent knees, and one with short steps.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.cluster.vq import kmeans2
from scipy.signal import find_peaks

from kinematics.figure import Array
from kinematics.mocap import CURVE, Trial, read_body, read_trials
from kinematics.sagittal import Body, project
from kinematics.sides import exchanged
from tests.benchmarks.gait.learn import allowed, arguments
from tests.benchmarks.rendered.captures import GAITS
from tracker.outline.cycles import COLUMNS, COUNTED, PHASES, Cycles

KINDS = 12
MIRRORED = exchanged(COLUMNS)
SHORTEST, LONGEST = 0.4, 1.8  # seconds of a stride
SWING = 0.3  # radians by which the thighs part at least
MOST = 12  # strides of one person's walk or run
LEGS = [2, 3, 4, 5]  # columns
BENT = np.radians([15.0, 25.0, 15.0, 25.0])  # of LEGS, added where somebody walks on bent knees
SHORT = 0.5  # share of the usual swing of LEGS in short steps
FLAT = float(np.radians(-20.0))  # how a foot that stands flat points, ankle to toe


@dataclass(frozen=True)
class Stride:
    """(PHASES, 8) symmetric pose of somebody's stride."""

    pose: Array
    subject: str
    activity: str


def learn_cycles(trials: Iterable[Trial], kinds: int, seed: int = 0) -> Cycles:
    """Kinds of stride in captures; none counts more than MOST strides of one person's walk or run."""
    rng = np.random.default_rng(seed)
    by_person: dict[tuple[str, str], list[Stride]] = {}
    for trial in trials:
        for stride in strides(trial):
            by_person.setdefault((stride.subject, stride.activity), []).append(stride)
    chosen = [own[i] for own in by_person.values() for i in rng.permutation(len(own))[: min(MOST, len(own))]]
    features = np.stack([stride.pose[:, COUNTED].ravel() for stride in chosen])
    _, kind = kmeans2(features, kinds, minit="++", rng=rng, iter=50)
    members = [[s for s, k in zip(chosen, kind, strict=True) if k == i] for i in range(kinds)]
    pose = np.stack([np.mean([s.pose for s in own], axis=0) for own in members if own])
    runs = np.array([np.mean([s.activity == "run" for s in own]) for own in members if own])
    rare = _rare(pose[runs <= 0.5].mean(axis=0))
    both = np.concatenate([pose, rare])
    return Cycles(both, np.append(runs, np.zeros(len(rare))), np.arange(len(both)) >= len(pose))


def _rare(walk: Array) -> Array:
    """(2, PHASES, 8) a walk on bent knees and one with short steps, made of a usual one (PHASES, 8)."""
    bent, short = walk.copy(), walk.copy()
    bent[:, LEGS] += BENT
    mean = walk[:, LEGS].mean(axis=0)
    short[:, LEGS] = mean + SHORT * (walk[:, LEGS] - mean)
    return np.stack([bent, short])


def strides(trial: Trial) -> list[Stride]:
    """The strides of a capture's straight segments."""
    if not trial.segments:
        return []
    body = read_body(trial)
    found = []
    for first, end in trial.segments:
        part = body.between(first, end)
        y = project(part, curve=CURVE in trial.tags)
        rows = np.concatenate([y[:, 2:], _ankles(part, y)], axis=1)
        for own in (rows, rows[:, MIRRORED]):
            peaks, _ = find_peaks(own[:, 2] - own[:, 4], distance=SHORTEST * trial.fps, prominence=SWING)
            for begin, stop in pairwise(peaks.tolist()):
                if SHORTEST <= (stop - begin) / trial.fps <= LONGEST:
                    found.append(Stride(_symmetric(own, begin, stop), trial.subject, trial.activity))
    return found


def _symmetric(rows: Array, begin: int, stop: int) -> Array:
    """(PHASES, 8) of rows (T, 8) from one frame to another, averaged with its mirror half a stride later."""
    times = begin + (stop - begin) * np.arange(PHASES) / PHASES
    pose = np.stack([np.interp(times, np.arange(len(rows)), column) for column in rows.T], axis=1)
    other = np.roll(pose[:, MIRRORED], PHASES // 2, axis=0)
    return np.asarray(0.5 * (pose + other))


def _ankles(body: Body, y: Array) -> Array:
    """(T, 2) near and far ankle of pose rows y (T, 8): the foot off the square to the shank, toes up +."""
    hips = 0.5 * (body.right[:, 0] + body.left[:, 0])
    forward = hips[-1] - hips[0]
    forward[1] = 0.0
    side = np.cross(body.left[:, 0] - body.right[:, 0], [0.0, -1.0, 0.0]).mean(axis=0)
    forward *= np.sign(forward @ -side) / np.linalg.norm(forward)
    found = []
    for leg, columns in ((body.right, (4, 5)), (body.left, (6, 7))):
        foot = leg[:, 3] - leg[:, 2]
        pitch = np.arctan2(foot[:, 1], foot @ forward)
        speed = np.linalg.norm(np.gradient(leg[:, 3], axis=0), axis=-1)
        stands = speed <= np.quantile(speed, 0.25)
        pitch += FLAT - np.median(pitch[stands])
        found.append(pitch - (y[:, columns[0]] - y[:, columns[1]]))
    return np.stack(found, axis=1)


def main() -> None:
    """Learn and write."""
    asked = arguments("cycles", __doc__)
    trials = [trial for trial in read_trials(asked.trials) if trial.activity in GAITS]
    made = learn_cycles((trial for trial in trials if allowed(trial.licence, asked.licence)), KINDS)
    np.savez_compressed(asked.out, pose=made.pose.astype(np.float32), runs=made.runs, rare=made.rare)


if __name__ == "__main__":
    main()
