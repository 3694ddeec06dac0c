"""A run whose legs are exchanged from one frame on."""

import numpy as np

from kinematics.sides import other_side
from tracker.tables.keypoints import points, read_keypoints

T, TURN = 30, 12  # frames; from TURN on the run's legs are exchanged
LEGS = ("near_knee", "near_ankle", "far_knee", "far_ankle")


def exchanged(scene, folder):
    """(T,) whether the legs of a run lie nearer to those of the other names."""
    found = {t: points(marks) for t, marks in read_keypoints(folder / "keypoints.csv").items()}

    def away(t, named):
        return sum(np.hypot(*np.subtract(found[t][name], scene.joints[named(name)][t])) for name in LEGS)

    return np.array([away(t, other_side) < away(t, str) for t in range(T)])
