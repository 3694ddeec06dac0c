"""Made-up gaits, a model learned from them, and tables of them."""

from functools import cache

import numpy as np

from dynamics.learning.options import Options
from dynamics.store import save
from kinematics.mocap import POSE_COLUMNS
from tests.tracker.clips import write_table
from tracker.models.by_motion import learn_hmms, learn_motions, learn_strides
from tracker.tables.poses import PoseSequence, pose_cells

HEADER = ("seq", "frame", *POSE_COLUMNS)
ONE = Options(states=1, order=2, rounds=3)
STRIDES = {"walk": 34.0, "run": 22.0}  # frames
NECK = POSE_COLUMNS.index("neck")
OFFSET = np.array([7.0, -3.0, 0.0, 0.4, 0.0, 0.0, 0.0, 0.0])  # of the place and of how the head is carried


def gait(label, frames, rng, phase=0.0, noise=0.3, speed=None):
    """(frames, 8) poses in body units; a runner lifts its knees, leans and is quick."""
    quick = label == "run"
    turn = phase + 2.0 * np.pi * np.arange(frames) / STRIDES[label]
    swing, bend, lift = (40.0, 60.0, 35.0) if quick else (25.0, 30.0, 25.0)
    legs = [part for t in (turn, turn + np.pi) for part in (swing * np.sin(t), bend + lift * np.cos(t))]
    lean = np.full(frames, 12.0 if quick else 3.0) + np.cos(2.0 * turn)
    travel = (speed or (0.12 if quick else 0.06)) * np.arange(frames)
    angles = np.stack([lean, 2.0 * np.sin(2.0 * turn), *legs], axis=1)
    angles += rng.normal(scale=noise, size=angles.shape)
    root = np.stack([travel, 0.02 * np.cos(2.0 * turn)], axis=1) + rng.normal(scale=0.002, size=(frames, 2))
    return np.hstack([root, np.radians(angles)])


def both(rng, first="walk", second="run", frames=50, noise=0.3):
    """One motion, then the other from where that ended; poses and labels."""
    one, other = (gait(label, frames, rng, noise=noise) for label in (first, second))
    other[:, :2] += one[-1, :2] - other[0, :2]
    return np.vstack([one, other]), (first,) * frames + (second,) * frames


def captures():
    """Three people who walk and run."""
    rng = np.random.default_rng(3)
    return [(f"s{i}", label, gait(label, 90, rng, phase=i)) for i in range(3) for label in STRIDES]


def learned(sequences, options=ONE, **more):
    """A model of 30 frames a second."""
    return learn_motions(sequences, fps=30.0, options=options, **more)


@cache
def gait_model():
    """Two switching states a motion."""
    return learned(captures(), Options(states=2, rounds=4))


@cache
def gait_hmm():
    """Hidden Markov models of the same."""
    return learn_hmms(captures(), fps=30.0, options=Options(states=4, rounds=6))


@cache
def gait_stride():
    """Harmonic strides of the same."""
    return learn_strides(captures(), fps=30.0, options=Options(rounds=3))


def saved(path, model):
    """The model's file."""
    save(model, path, "a test")
    return path


def sequence(y, name="a", first=0, labels=None):
    """A sequence as if read from a table."""
    cells = tuple(tuple(pose_cells(row)) for row in y)
    return PoseSequence(name, first, np.array(y), labels or ("",) * len(y), cells, 0, None)


def blanked(y, rows, columns=slice(None)):
    """The poses with some that were not measured."""
    out = y.copy()
    out[rows, columns] = np.nan
    return out


def write_poses(path, *sequences, further=()):
    """A pose table; rows of which nothing was measured are left out."""
    rows = [
        (s.name, s.first + t, *s.cells[t], *([s.labels[t]] if further else []))
        for s in sequences
        for t in range(len(s))
        if any(s.cells[t])
    ]
    write_table(path, rows, header=(*HEADER, *further))
    return path
