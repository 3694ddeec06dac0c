"""A lost figure is sought where it may have gone: the poses foreseen, shifted on a coarse grid."""

import numpy as np

from dynamics.gaussian import Array, Gaussian
from kinematics.spm import joints
from tracker.picture.pyramid import within
from tracker.registration.align import scan
from tracker.registration.field import Field

STEP = 0.1  # leg lengths: within the reach of the coarsest blur
SPREADS = 2.0  # standard deviations of the root either way
FARTHEST = np.array([1.5, 0.3])  # leg lengths at most, ahead and up
SEEN = 0.5  # share of the joints that must lie in the picture


def reach(priors: Gaussian) -> Array:
    """(2,) leg lengths either way in which the root is sought."""
    sd = np.sqrt(np.diagonal(priors.cov[:, :2, :2], axis1=1, axis2=2)).max(0)
    return np.asarray(np.minimum(SPREADS * sd, FARTHEST))


def sought(field: Field, priors: Gaussian, best: int) -> Array:
    """(H, D): the priors' means, all shifted to where that of the best fits the picture best."""
    q, cov = priors.mean[best], priors.cov[best, :2, :2]
    steps = [np.arange(-n, n + 1) * STEP for n in np.floor(reach(priors) / STEP)]
    shifts = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
    poses = np.repeat(q[None], len(shifts), axis=0)
    poses[:, :2] += shifts
    # What lies out of the picture cannot match badly.
    there = _share_seen(field, poses) >= SEEN
    if not there.any():
        return priors.mean
    poses, shifts = poses[there], shifts[there]
    far = 0.5 * (shifts * np.linalg.solve(cov, shifts.T).T).sum(1)
    starts = priors.mean.copy()
    starts[:, :2] += shifts[(scan(field, poses) + far).argmin()]
    return starts


def _share_seen(field: Field, poses: Array) -> Array:
    """(H,) share of the joints of poses (H, D) that lie in the part of the picture that is looked at."""
    level = field.levels[0]
    place = field.view.to_pixels(joints(field.figure, poses)) - np.asarray(level.corner)
    return np.asarray(within(place, level.planes.shape).mean(-1))
