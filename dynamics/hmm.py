"""A hidden Markov model with Gaussian poses: switching states without dynamics, the papers' baseline.

    Pr(s_t = j | s_{t-1} = i) = Pi[i, j],    y_t ~ N(mean[s_t], cov[s_t])

Entries of a pose that were not measured are left out of its density.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynamics.chain import (
    CROSSING,
    batches,
    best_paths,
    blocks,
    check_chain,
    forward_backward,
    in_order,
    joined,
    side_by_side,
    split_as,
)
from dynamics.gaussian import Array, Gaussian, frozen, inverse_root, transpose
from dynamics.kalman import update
from dynamics.posterior import Switching

ARRAYS = 8  # of pairs of states that are held at a time


@dataclass(frozen=True)
class HMM:
    """pi0 (K,), Pi (K,K), mean (K,M), cov (K,M,M).

    names  : the M measured freedoms
    labels : (K,) which motion each state belongs to
    fps    : frames a second, one step each
    """

    pi0: Array
    Pi: Array
    mean: Array
    cov: Array
    names: tuple[str, ...]
    labels: tuple[str, ...]
    fps: float

    def __post_init__(self) -> None:
        K, M = len(self.mean), len(self.names)
        for name, shape in {"pi0": (K,), "Pi": (K, K), "mean": (K, M), "cov": (K, M, M)}.items():
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape))
        check_chain(self.pi0, self.Pi, self.labels, self.fps)


@dataclass(frozen=True)
class HMMPosterior(Switching):
    """The posterior over the states of one sequence of T frames.

    path         : (T,) the best path as a whole; `prob` is better for single frames
    pair         : (T-1, K, K) Pr(s_t = i, s_{t+1} = j)
    log_evidence : log of the sum over all paths, nats
    """

    pair: Array
    log_evidence: float


def hmm_all(hmm: HMM, ys: Sequence[Array]) -> list[HMMPosterior]:
    """The posterior of each sequence (T, M), T >= 1; NaN entries were not measured."""
    chosen = batches(ys, ARRAYS * hmm.Pi.size)
    return in_order(chosen, (_side_by_side(hmm, [ys[n] for n in numbers]) for numbers in chosen))


def _side_by_side(hmm: HMM, ys: Sequence[Array]) -> Iterator[HMMPosterior]:
    log_lik, lengths = side_by_side(split_as(log_likelihoods(hmm, np.concatenate(ys)), ys), 0.0)
    with np.errstate(divide="ignore"):
        log_pi0, log_Pi = np.log(hmm.pi0), np.log(hmm.Pi)
    prob, pair, log_evidence = forward_backward(log_pi0, log_Pi, log_lik, lengths)
    path = best_paths(log_pi0, log_Pi, log_lik, lengths)
    for n, T in enumerate(lengths):
        own = prob[:T, n].copy(), path[:T, n].copy(), pair[: T - 1, n].copy()
        yield HMMPosterior(*own, float(log_evidence[n]))


def combine_hmms(models: Sequence[HMM], crossing: float = CROSSING) -> HMM:
    """Models of several motions as one; ValueError if their freedoms or rates differ.

    A state leaves its own motion with probability `crossing` a frame, with equal odds to any state of others.
    """
    if len({(model.names, model.fps) for model in models}) > 1:
        raise ValueError("models to combine must share freedoms and frame rate; learn them alike")
    return replace(
        models[0],
        **joined(models, ("mean", "cov")),
        pi0=np.concatenate([model.pi0 for model in models]) / len(models),
        Pi=blocks([model.Pi for model in models], crossing),
    )


def log_likelihoods(hmm: HMM, y: Array) -> Array:
    """(T, K) log density of poses (T, M) under every state, nats; NaN entries were not measured."""
    K, M = hmm.mean.shape
    whole = ~np.isnan(y).any(1)
    log_lik = np.empty((len(y), K))
    root, log_det = inverse_root(hmm.cov)
    white = root @ transpose(y[whole] - hmm.mean[:, None])
    log_lik[whole] = -0.5 * ((white**2).sum(1).T + log_det)
    # A pose is a measurement of itself without noise.
    states = Gaussian(hmm.mean, hmm.cov)
    _, log_lik[~whole] = update(states, y[~whole][:, None], np.eye(M), np.zeros((M, M)))
    return log_lik
