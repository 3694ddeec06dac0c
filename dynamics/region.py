"""The region of poses of each switching state, and the evidence that a pose gives for the states.

A learned model's mean0 and cov0 are the moments of x over all frames of each switching state (`em.anywhere`):
its region. Its uses go beyond the papers, in which the switch depends on the last switch alone:

    a term for the pose   log N(y_t; C mean0_k, C cov0_k C' + R), flatter the noisier the measurement
    a recurrent switch    Pr(s_t = j | s_{t-1} = i, x_{t-1}) in proportion to Pi[i, j] N(x_j; mean0_j, cov0_j)
                          with x_j = A_j x_{t-1} + b_j: a state is entered where it leads into its region
    a step towards it     p(x_t | s_t = k, x_{t-1}) in proportion to N(x_t; x_k, Q_k) N(x_t; mean0_k, cov0_k)

(recurrent SLDS: Barber 2006; Linderman et al. 2017). None of them depends on where the figure stands.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynamics.gaussian import Array, apply, inverse_root, symmetric, transpose
from dynamics.kalman import innovation, log_likelihood
from dynamics.slds import SLDS

POSE = 0.5  # weight of the pose's term, also in a filter's switch; below 1 as the dynamics use the pose too
CHUNK = 1000  # frames whose covariances are in memory at a time


def pose_hints(slds: SLDS, y: Array, weight: float = POSE) -> Array:
    """(T, K) the weighted term for poses y (T, M), NaN where not measured, but for what travels."""
    told = np.empty((len(y), slds.K))
    for first in range(0, len(y), CHUNK):
        rows = slice(first, first + CHUNK)
        seen = np.where(slds.travels, np.nan, y[rows])[:, None]
        e, _, S, _ = innovation(slds.start, seen, slds.C, slds.R)
        told[rows] = weight * log_likelihood(e, S, (~np.isnan(seen)).sum(-1))
    return told


@dataclass(frozen=True)
class Regions:
    """regard (N', N) removes the place; mean (K, N') and cov (K, N', N') of the result in each state."""

    regard: Array
    mean: Array
    cov: Array

    def distance(self, x: Array) -> Array:
        """(..., K) squared Mahalanobis distance of the states x (..., K or 1, N) from each region's mean."""
        white, _ = self._root
        return np.asarray((apply(white, apply(self.regard, x) - self.mean) ** 2).sum(-1))

    def log_density(self, x: Array) -> Array:
        """(..., K) log density of the states x (..., K or 1, N) in each region; x K-fold or one for all."""
        return np.asarray(-0.5 * (self.distance(x) + self._root[1]))

    @cached_property
    def _root(self) -> tuple[Array, Array]:
        """Of cov, which is asked frame after frame."""
        return inverse_root(self.cov)


def regions(slds: SLDS) -> Regions:
    """Distribution of x in each switching state, on which the recurrent switch depends."""
    return _seen_by(slds, slds.layout.regard)


def log_switch(slds: SLDS, reach: Regions, x: Array, weight: float = 1.0) -> Array:
    """(..., K, K) log of the recurrent switch, [i, j] from i to j, given the states x (..., K or 1, N) before
    it, one for each i or one for all; `weight` is the power of the region's density."""
    ahead = apply(slds.A, x[..., None, :]) + slds.b
    log_p = slds.log_Pi + weight * reach.log_density(ahead)
    return np.asarray(log_p - np.logaddexp.reduce(log_p, axis=-1, keepdims=True))


def drawn(slds: SLDS, weight: float) -> SLDS:
    """The system whose steps are drawn towards the region of their state; `weight` is its power.

    With F = regard and mean m, cov V of the region, the product of both Gaussians is, for the gain g = Q F'
    (F Q F' + V / weight)^-1, one with A - g F A, b + g (m - F b) and Q - g F Q.
    """
    reach = regions(slds)
    FQ = reach.regard @ slds.Q
    gain = transpose(np.linalg.solve(FQ @ reach.regard.T + reach.cov / weight, FQ))
    b = slds.b + apply(gain, reach.mean - slds.b @ reach.regard.T)
    return replace(slds, A=slds.A - gain @ reach.regard @ slds.A, b=b, Q=symmetric(slds.Q - gain @ FQ))


def pose_regions(slds: SLDS) -> Regions:
    """Like `regions`, but of the present pose only, without travelling freedoms and without the velocity."""
    return _seen_by(slds, slds.layout.pose[~slds.layout.travels])


def _seen_by(slds: SLDS, regard: Array) -> Regions:
    cov = regard @ slds.cov0 @ transpose(regard)
    # A region thinner than rounding would exclude every other state.
    size = np.diagonal(cov, axis1=-2, axis2=-1).max(0)
    return Regions(regard, slds.mean0 @ regard.T, symmetric(cov) + 1e-6 * np.diag(size))
