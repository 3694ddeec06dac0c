"""Whether the covariances of tracked joints are those of their errors.

For a mark with error e, tracked covariance P and mark noise R, e' (P + R)^-1 e has the mean 2 where both are
right (the normalised estimation error squared of Bar-Shalom), and 86.5 % of marks lie inside two sigma.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tracker.run.track import Track
from tracker.tables.keypoints import Marks

Array = NDArray[np.float64]

ACROSS = 1.5  # px: how well marks repeat
ALONG = 4.0  # px: how far marks of hips and knees slide along the limb under clothes
# The limb along which a joint's mark slides, from the one end to the other.
SLIDING = {
    "hip": ("hip", "near_knee"),
    "near_knee": ("hip", "near_knee"),
    "far_knee": ("hip", "far_knee"),
}
TWO_SIGMA = 4.0


def distances(track: Track, marks: Marks, start: int) -> Array:
    """(M,) e' (P + R)^-1 e of every visible mark in the frames after the start."""
    places, covs = track.joints(), track.joint_covs()
    column = {name: j for j, name in enumerate(track.figure.joints)}

    def found() -> Iterator[float]:
        for frame in sorted(marks):
            t = frame - track.first
            if frame <= start or t >= len(track):
                continue
            for name, mark in marks[frame].items():
                if mark.visible and name in column:
                    limb = [places[t, column[end]] for end in SLIDING.get(name, ())]
                    error = np.array([mark.x, mark.y]) - places[t, column[name]]
                    yield distance(error, covs[t, column[name]] + mark_noise(limb))

    return np.array(list(found()))


def distance(error: Array, cov: Array) -> float:
    """error' cov^-1 error."""
    return float(error @ np.linalg.solve(cov, error))


def mark_noise(limb: list[Array]) -> Array:
    """(2, 2) covariance of a mark, px^2, that slides along the limb between two points; round without one."""
    R = np.eye(2) * ACROSS**2
    if limb:
        along = (limb[1] - limb[0]) / max(float(np.hypot(*(limb[1] - limb[0]))), 1e-9)
        R += (ALONG**2 - ACROSS**2) * np.outer(along, along)
    return R


def nees(found: Array) -> float:
    """Mean of the distances; 2 is right."""
    return float(found.mean())


def inside(found: Array) -> float:
    """Share of marks inside the two-sigma ellipse, NaN of none; 1 - exp(-2) = 0.865 is right."""
    return float((found <= TWO_SIGMA).mean()) if len(found) else np.nan
