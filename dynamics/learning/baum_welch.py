"""Learning a hidden Markov model by Baum-Welch (Rabiner 1989, section V) from a k-means start.

An inverse-Wishart prior on the covariances, scaled from the data, and a Dirichlet prior on Pi keep states
from shrinking onto a few frames. The 1999 paper starts its SLDS from such a model.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynamics.chain import split_as
from dynamics.gaussian import Array, symmetric, transpose
from dynamics.hmm import HMM, HMMPosterior, hmm_all
from dynamics.learning.initialise import clustered, scaled
from dynamics.learning.mstep import shares
from dynamics.learning.options import DEFAULTS, Options
from dynamics.learning.prior import STILL, inverse_wishart

ROUNDS = 50  # default number of rounds of EM
TRIES = 10  # k-means runs, of which the tightest is the start: a single run was a poor start 1 time in 10


@dataclass(frozen=True)
class HMMFit:
    """A learned model, and log evidence plus log prior after every round."""

    hmm: HMM
    values: tuple[float, ...]


def learn_hmm(
    ys: Sequence[Array],
    *,
    names: Sequence[str],
    fps: float,
    label: str,
    options: Options = DEFAULTS,
    weights: Array | None = None,
) -> HMMFit:
    """Learn the states of one motion's poses, sequences (T, M), T >= 1.

    Names, fps, label and weights are as for `em.learn`; of the options order and ridge do not matter.
    """
    w = np.ones(len(ys)) if weights is None else weights / weights.mean()
    y = np.concatenate(ys)
    spread = y.var(axis=0) + STILL
    prior = _Prior(
        cov=options.prior * 0.1 * spread,
        count=options.prior * (len(names) + 2.0),
        pi0=np.full(options.states, 0.1 * options.prior),
        Pi=options.prior * (0.1 + options.stickiness * np.eye(options.states)),
    )
    K = options.states
    alike = HMM(
        pi0=np.full(K, 1.0 / K),
        Pi=np.full((K, K), 1.0 / K),
        mean=np.tile(y.mean(axis=0), (K, 1)),
        cov=np.tile(np.diag(spread), (K, 1, 1)),
        names=tuple(names),
        labels=(label,) * K,
        fps=fps,
    )
    hmm = _maximise(alike, ys, _first(ys, K, options.seed), w, prior)
    best, values = hmm, list[float]()
    for _ in range(options.rounds):
        posteriors = hmm_all(hmm, ys)
        value = sum(wn * p.log_evidence for wn, p in zip(w, posteriors, strict=True)) + _log_prior(hmm, prior)
        values.append(float(value))
        rise = values[-1] - values[-2] if len(values) > 1 else np.inf
        best = hmm if rise > 0 else best
        if rise < options.tolerance * abs(value):
            break
        hmm = _maximise(hmm, ys, posteriors, w, prior)
    return HMMFit(best, tuple(values))


@dataclass(frozen=True)
class _Prior:
    """cov (M,) diagonal of the inverse-Wishart scale and its count; Dirichlet counts pi0 (K,), Pi (K,K)."""

    cov: Array
    count: float
    pi0: Array
    Pi: Array


def _maximise(
    hmm: HMM, ys: Sequence[Array], posteriors: Sequence[HMMPosterior], w: Array, prior: _Prior
) -> HMM:
    """The M-step; a state that is never visited keeps its parameters where the prior adds no counts."""
    y = np.concatenate(ys)[:, None]
    prob = np.concatenate([wn * p.prob for wn, p in zip(w, posteriors, strict=True)])
    n = prob.sum(0)
    visited = n > 1e-9
    share = prob / np.where(visited, n, 1.0)
    mean = np.where(visited[:, None], (share[..., None] * y).sum(0), hmm.mean)
    apart = np.sqrt(prob)[..., None] * (y - mean)
    scatter = transpose(apart.swapaxes(0, 1)) @ apart.swapaxes(0, 1) + np.diag(prior.cov)
    count = n + prior.count
    cov = symmetric(scatter) / np.where(count > 1e-9, count, 1.0)[:, None, None]
    first = sum(wn * p.prob[0] for wn, p in zip(w, posteriors, strict=True))
    steps = sum(wn * p.pair.sum(0) for wn, p in zip(w, posteriors, strict=True))
    return replace(
        hmm,
        pi0=shares((first + prior.pi0)[None], hmm.pi0)[0],
        Pi=shares(steps + prior.Pi, hmm.Pi),
        mean=mean,
        cov=np.where((count > 1e-9)[:, None, None], cov, hmm.cov),
    )


def _log_prior(hmm: HMM, prior: _Prior) -> float:
    """Log density of the prior over the parameters, up to a constant."""
    of_covs = sum(inverse_wishart(cov, np.diag(prior.cov), prior.count) for cov in hmm.cov)
    log_Pi, log_pi0 = np.log(np.maximum(hmm.Pi, 1e-300)), np.log(np.maximum(hmm.pi0, 1e-300))
    switches = (prior.Pi * log_Pi).sum() + (prior.pi0 * log_pi0).sum()
    return float(switches + of_covs)


def _first(ys: Sequence[Array], K: int, seed: int) -> list[HMMPosterior]:
    """Posteriors in which the state of every frame is its cluster by k-means with K clusters."""
    y = np.concatenate(ys)
    clusters = clustered(scaled(y, np.abs(y).max(axis=0)), K, np.random.default_rng(seed), TRIES)
    probs = split_as(np.eye(K)[clusters], ys)
    return [HMMPosterior(p, p.argmax(1), p[:-1, :, None] * p[1:, None], -np.inf) for p in probs]
