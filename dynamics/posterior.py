"""The arguments and results that all inferences share."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array, Gaussian, Ints, joint
from dynamics.slds import SLDS


@dataclass(frozen=True)
class Switching:
    """The states of one sequence of T frames: prob (T, K) Pr(s_t), path (T,) the most probable states."""

    prob: Array
    path: Ints


@dataclass(frozen=True)
class Posterior(Switching):
    """The posterior over one sequence of T frames.

    pair         : (T-1, K, K) Pr(s_t = i, s_{t+1} = j)
    states       : mean (T, N), cov (T, N, N) of x_t
    lag          : (T-1, N, N) Cov(x_{t+1}, x_t)
    log_evidence : log p(Y), or this inference's bound or best-path value, nats
    starts       : x_0 given each s_0, leading axis K; None if it does not depend on s_0
    steps        : [x_{t+1}; x_t] given each s_{t+1}, leading axes (T-1, K); None if it does not depend on it
    """

    pair: Array
    states: Gaussian
    lag: Array
    log_evidence: float
    starts: Gaussian | None = None
    steps: Gaussian | None = None

    @classmethod
    def on_path(cls, path: Ints, K: int, states: Gaussian, lag: Array, log_evidence: float) -> "Posterior":
        """The posterior that takes one path of K switching states for certain."""
        prob = np.eye(K)[path]
        return cls(prob, path, prob[:-1, :, None] * prob[1:, None, :], states, lag, log_evidence)

    def step_moments(self) -> Gaussian:
        """[x_{t+1}; x_t] given each s_{t+1}: mean (T-1, K or 1, 2N), cov (T-1, K or 1, 2N, 2N)."""
        if self.steps is not None:
            return self.steps
        return joint(self.states[1:], self.states[:-1], self.lag)[:, None]

    def start_moments(self) -> Gaussian:
        """x_0 given each s_0, leading axis K or 1."""
        return self.starts if self.starts is not None else self.states[:1]


Infer = Callable[[SLDS, Sequence[Array]], list[Posterior]]
InferSwitching = Callable[[SLDS, Sequence[Array], Sequence[Array] | None], Sequence[Switching]]
