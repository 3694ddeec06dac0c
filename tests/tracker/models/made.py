"""Walks and runs made of sinusoids, and what is learned from such."""

import numpy as np

from dynamics.learning.options import Options
from kinematics.mocap import POSE_COLUMNS
from tracker.models.by_motion import learn_motions

ONE = Options(states=1, order=2, rounds=3)


def gait(rng, *, T=80, period=32.0, speed=0.045, size=1.0, noise=0.003):
    """Pose rows of a walk: sinusoids of one stride, a little unsteady."""
    phase = 2.0 * np.pi * (rng.random() + np.arange(T) / period)
    y = np.zeros((T, len(POSE_COLUMNS)))
    y[:, 0], y[:, 1] = speed * np.arange(T), 0.9 + 0.02 * np.cos(2.0 * phase)
    y[:, 2], y[:, 3] = 0.08 + 0.02 * np.sin(2.0 * phase), 0.15 + 0.03 * np.cos(2.0 * phase)
    for hip, knee, p in ((4, 5, phase), (6, 7, phase + np.pi)):
        y[:, hip] = 0.1 + 0.4 * size * np.sin(p)
        y[:, knee] = 0.5 * size * (1.0 + np.cos(p + 0.6))
    return y + rng.normal(scale=noise, size=y.shape)


def learned(sequences, options=ONE, **more):
    return learn_motions(sequences, fps=30.0, options=options, **more)
