"""Where each switching state lives, and what a pose therefore says of the state.

A learned model's mean0 and cov0 are the moments of x over all frames of each switching state (`em.anywhere`):
its region. Its uses go beyond the papers, in which the switch depends on the last switch alone:

    a term for the pose   log N(y_t; C mean0_k, C cov0_k C' + R), flatter the noisier the measurement
    a recurrent switch    Pr(s_t = j | s_{t-1} = i, x_{t-1}) in proportion to Pi[i, j] N(x_j; mean0_j, cov0_j)
                          with x_j = A_j x_{t-1} + b_j: a state is entered where it leads into its region

(recurrent SLDS: Barber 2006; Linderman et al. 2017). Where the figure stands is left out of both.
"""

from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array, Gaussian, apply, inverse_root, log_density, symmetric, transpose
from dynamics.kalman import innovation, log_likelihood
from dynamics.slds import SLDS

POSE = 0.5  # weight of the pose's term; less than 1, as the dynamics count the pose already
CHUNK = 1000  # frames whose covariances are held at a time


def pose_hints(slds: SLDS, y: Array, weight: float = POSE) -> Array:
    """(T, K) the weighted term for poses y (T, M), NaN where not measured, of the freedoms that do not
    travel."""
    told = np.empty((len(y), slds.K))
    for first in range(0, len(y), CHUNK):
        rows = slice(first, first + CHUNK)
        seen = np.where(slds.travels, np.nan, y[rows])[:, None]
        e, _, S, _ = innovation(slds.start, seen, slds.C, slds.R)
        told[rows] = weight * log_likelihood(e, S, (~np.isnan(seen)).sum(-1))
    return told


@dataclass(frozen=True)
class Regions:
    """regard (N', N) leaves out the place; mean (K, N'), cov (K, N', N') of what is left, in each state."""

    regard: Array
    mean: Array
    cov: Array

    def distance(self, x: Array) -> Array:
        """(..., K) squared Mahalanobis distance of the states x (..., K or 1, N) from each region's mean."""
        white, _ = inverse_root(self.cov)
        return np.asarray((apply(white, apply(self.regard, x) - self.mean) ** 2).sum(-1))

    def log_density(self, x: Array) -> Array:
        """(..., K) log N of the states x (..., K or 1, N)."""
        return log_density(Gaussian(self.mean, self.cov), apply(self.regard, x))


def regions(slds: SLDS) -> Regions:
    """Distribution of the state in each switching state, by which the switch depends on the pose."""
    return _seen_by(slds, slds.layout.regard)


def pose_regions(slds: SLDS) -> Regions:
    """Like `regions`, of the present pose alone, without what travels and without its change."""
    return _seen_by(slds, slds.layout.pose[~slds.layout.travels])


def _seen_by(slds: SLDS, regard: Array) -> Regions:
    cov = regard @ slds.cov0 @ transpose(regard)
    # A region thinner than rounding would let no other state in.
    size = np.diagonal(cov, axis1=-2, axis2=-1).max(0)
    return Regions(regard, slds.mean0 @ regard.T, symmetric(cov) + 1e-6 * np.diag(size))
