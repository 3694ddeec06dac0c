"""A motion for rendered films that no capture went into."""

import numpy as np

from tests.benchmarks.rendered.captures import Motion
from tracker.scene.steps import random_build, walk

FPS = 60.0


def a_motion(label="walk", seconds=4.0, seed=3):
    """The walk of a random person, called by this label."""
    rng = np.random.default_rng(seed)
    gait = walk(random_build(rng), round(seconds * FPS) + 1, 1.1 * FPS, rng)
    return Motion(gait.pose, gait.foot, FPS, label, "made up")
