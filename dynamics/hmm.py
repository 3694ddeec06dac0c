"""A hidden Markov model with Gaussian poses: switching states without dynamics, the plain rival.

    Pr(s_t = j | s_{t-1} = i) = Pi[i, j],    y_t ~ N(mean[s_t], cov[s_t])

Entries of a pose that were not measured are left out of its density.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dynamics.chain import ChainPosterior, best_path_all, blocks, check_chain, forward_backward_all, split_as
from dynamics.gaussian import Array, Gaussian, frozen, inverse_root, transpose
from dynamics.kalman import update


@dataclass(frozen=True)
class HMM:
    """pi0 (K,), Pi (K,K), mean (K,M), cov (K,M,M).

    names  : the M measured freedoms
    labels : (K,) which motion each state belongs to
    fps    : frames a second that one step stands for
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
class HMMPosterior(ChainPosterior):
    """path (T,) is the best path as a whole; where single frames matter take prob."""

    path: NDArray[np.intp]


def hmm_all(hmm: HMM, ys: Sequence[Array]) -> list[HMMPosterior]:
    """The posterior of each sequence (T, M), T >= 1; NaN entries were not measured."""
    if not len(ys):
        return []
    liks = split_as(expected(hmm, np.concatenate(ys)).log_lik, ys)
    with np.errstate(divide="ignore"):
        log_pi0, log_Pi = np.log(hmm.pi0), np.log(hmm.Pi)
    chains = forward_backward_all(log_pi0, log_Pi, liks)
    paths = best_path_all(log_pi0, log_Pi, liks)
    return [
        HMMPosterior(chain.prob, chain.pair, chain.log_evidence, path)
        for chain, (path, _) in zip(chains, paths, strict=True)
    ]


def combine_hmms(models: Sequence[HMM], crossing: float = 1e-3) -> HMM:
    """Models of several motions as one; ValueError if they speak of other freedoms or rates.

    A state leaves its own motion with probability `crossing` a frame, to any state of the others alike.
    """
    first = models[0]
    if any((model.names, model.fps) != (first.names, first.fps) for model in models):
        raise ValueError("models to combine must share freedoms and frame rate; learn them alike")
    return replace(
        first,
        pi0=np.concatenate([model.pi0 for model in models]) / len(models),
        Pi=blocks([model.Pi for model in models], crossing),
        mean=np.concatenate([model.mean for model in models]),
        cov=np.concatenate([model.cov for model in models]),
        labels=tuple(label for model in models for label in model.labels),
    )


@dataclass(frozen=True)
class Expected:
    """Of T frames under every state: log_lik (T,K) of what was measured; the whole pose given that, mean
    (T,K,M), and cov (G,K,M,M) of the G frames `gappy` that miss something."""

    log_lik: Array
    mean: Array
    cov: Array
    gappy: NDArray[np.intp]


def expected(hmm: HMM, y: Array) -> Expected:
    """Of poses (T, M); NaN entries were not measured."""
    K, M = hmm.mean.shape
    seen = ~np.isnan(y)
    whole, gappy = np.flatnonzero(seen.all(1)), np.flatnonzero(~seen.all(1))
    log_lik, mean = np.empty((len(y), K)), np.repeat(y[:, None], K, axis=1)
    root, log_det = inverse_root(hmm.cov)
    white = root @ transpose(y[whole] - hmm.mean[:, None])
    log_lik[whole] = -0.5 * ((white**2).sum(1).T + log_det)
    # A pose is a measurement of itself without noise.
    states = Gaussian(hmm.mean, hmm.cov)
    filled, log_lik[gappy] = update(states, y[gappy][:, None], np.eye(M), np.zeros((M, M)))
    mean[gappy] = filled.mean
    return Expected(log_lik, mean, filled.cov, gappy)
