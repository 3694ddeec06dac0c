"""Tracks made up for tests."""

from dataclasses import replace

import numpy as np

from kinematics.spm import View
from tests.kinematics.figures import WALKER, random_pose
from tests.oracles import random_covariance
from tracker.run.track import Track

OUTCOMES = ("ok", "hidden", "lost", "outside")


def random_track(rng, T=4, *, first=0, facing=1, figure=WALKER):
    """Poses anywhere, covariances small, every outcome in turn."""
    D = len(figure.freedoms)
    return Track(
        figure=figure,
        view=View(origin=(150.0, 110.0), unit=70.0, facing=facing),
        model="made-up",
        labels=("walk", "walk", "run"),
        first=first,
        times=first / 25.0 + np.arange(T) / 25.0,
        q=np.stack([random_pose(figure, rng, size=0.1) for _ in range(T)]),
        cov=np.stack([1e-4 * random_covariance(D, rng) for _ in range(T)]),
        s=rng.integers(0, 3, T),
        motions=tuple("walk" if t < 3 else "run" for t in range(T)),
        outcome=tuple(OUTCOMES[t % len(OUTCOMES)] for t in range(T)),
        mark=0.02,
        moved=np.column_stack([rng.normal(scale=5.0, size=(T, 2)), rng.uniform(0.8, 1.25, T)]),
    )


def standing(track, q):
    """The same track with one pose throughout."""
    return replace(track, q=np.broadcast_to(q, track.q.shape))
