"""A belief of several hypotheses, each in its own switching state, and the S priors it proposes.

Pavlović et al. (1999), section 4.2: of the S^2 transitions the tracker follows, for every state i, only the
one from the predecessor j* = argmin_j J_j - log Pi(j, i).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from dynamics.gaussian import Array, Gaussian, Ints, collapse
from dynamics.kalman import predict, update
from dynamics.slds import SLDS


@dataclass(frozen=True)
class Belief:
    """H weighted Gaussians.

    states : mean (H, N), cov (H, N, N)
    cost   : (H,) minus log weight, nats; only differences matter
    s      : (H,) switching state of each
    parent : (H,) position of the hypothesis of the frame before that each comes from
    wider  : (H,) factor by which its predicted covariance was increased, 1 for none
    """

    states: Gaussian
    cost: Array
    s: Ints
    parent: Ints
    wider: Array

    @property
    def weights(self) -> Array:
        """(H,) probabilities of the hypotheses; they sum to 1."""
        w = np.exp(self.cost.min() - self.cost)
        return np.asarray(w / w.sum())

    @property
    def best(self) -> int:
        """Position of the most probable hypothesis."""
        return int(self.cost.argmin())

    def at(self, some: Sequence[int]) -> "Belief":
        """The belief reduced to some of its hypotheses, given by position."""
        return Belief(self.states[some], self.cost[some], self.s[some], self.parent[some], self.wider[some])

    def levelled(self) -> Self:
        """The belief with its costs shifted so that the best hypothesis costs 0."""
        return replace(self, cost=self.cost - self.cost.min())

    def merged(self) -> Gaussian:
        """The Gaussian with the mean and covariance of the mixture of all hypotheses."""
        return collapse(self.weights, self.states)


def first_belief(slds: SLDS, y: Array, R: Array) -> Belief:
    """One hypothesis a switching state, given a first pose y (M,) (NaN: unknown) of covariance R (M, M)."""
    states, log_lik = update(slds.start, y[None], slds.C, R)
    return of_every_state(slds, states, log_lik)


def of_every_state(slds: SLDS, states: Gaussian, log_lik: Array | float = 0.0) -> Belief:
    """One hypothesis (K, n) a switching state, as probable as in a first frame with log_lik (K,), nats."""
    every = np.arange(slds.K)
    return Belief(states, -slds.log_pi0 - log_lik, every, every, np.ones(slds.K))


def propose(slds: SLDS, belief: Belief, *, prune: float, most: int) -> Belief:
    """One prior for each switching state, from its best predecessor.

    The `most` cheapest of them are kept, within `prune` nats of the best.
    """
    total = belief.cost[:, None] - slds.log_Pi[belief.s]
    parent, cost = total.argmin(0), total.min(0)
    cheapest = np.argsort(cost, kind="stable")[:most]
    s = np.sort(cheapest[cost[cheapest] <= cost.min() + prune])
    states = predict(belief.states[parent[s]], slds.A[s], slds.b[s], slds.Q[s])
    return Belief(states, cost[s], s, parent[s], np.ones(len(s)))


def together(beliefs: Sequence[Belief]) -> Belief:
    """One belief with the hypotheses of several, concatenated."""
    mean, cov, *rest = zip(
        *((of.states.mean, of.states.cov, of.cost, of.s, of.parent, of.wider) for of in beliefs), strict=True
    )
    return Belief(Gaussian(np.concatenate(mean), np.concatenate(cov)), *map(np.concatenate, rest))


def either(beliefs: Sequence[Belief]) -> Belief:
    """One belief from several that are alternatives and differ only in their measurement.

    Each hypothesis becomes the Gaussian with the moments of its versions' mixture; its weight is their sum.
    """
    costs = np.stack([belief.cost for belief in beliefs], axis=1)
    cost = -np.logaddexp.reduce(-costs, axis=1)
    means = np.stack([belief.states.mean for belief in beliefs], axis=1)
    covs = np.stack([belief.states.cov for belief in beliefs], axis=1)
    states = collapse(np.exp(cost[:, None] - costs), Gaussian(means, covs))
    return replace(beliefs[0], states=states, cost=cost)
