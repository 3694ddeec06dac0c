"""A hidden Markov model with Gaussian poses: switching states without dynamics, the plain rival.

    Pr(s_t = j | s_{t-1} = i) = Pi[i, j],    y_t ~ N(mean[s_t], cov[s_t])

Learned by Baum-Welch (Rabiner 1989, section V) from a k-means start, with an inverse-Wishart prior on the
covariances scaled from the data and a Dirichlet prior on Pi, so that no state shrinks onto a few frames.
Entries of a pose that were not measured are left out of its density, and enter the covariances by their
expectation given the measured ones. The 1999 paper starts its SLDS from such a model.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from dynamics.chain import ChainPosterior, best_path_all, blocks, forward_backward_all
from dynamics.gaussian import LOG_2PI, Array, Gaussian, frozen, symmetric, transpose
from dynamics.kalman import update
from dynamics.learning.fill import fill
from dynamics.learning.prior import STILL

TRIES = 10  # k-means runs, the tightest is the start: single ones left learning in a poor place 1 time in 10


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
        if len(self.labels) != K:
            raise ValueError(f"every state needs a label; got {len(self.labels)} for {K} states")
        for name, rows in (("pi0", self.pi0[None]), ("Pi", self.Pi)):
            wrong = (rows < 0).any(1) | (np.abs(rows.sum(1) - 1.0) > 1e-6)
            for i in np.flatnonzero(wrong):
                raise ValueError(
                    f"{name} rows must be probabilities that sum to 1; row {i} sums to {rows[i].sum():.6f}"
                )
        if not self.fps > 0:
            raise ValueError(f"fps must be positive; got {self.fps}")


@dataclass(frozen=True)
class HMMPosterior(ChainPosterior):
    """path (T,) is the best path as a whole; where single frames matter take prob."""

    path: NDArray[np.intp]


@dataclass(frozen=True)
class HMMOptions:
    """How to learn.

    states     : how many
    rounds     : EM rounds at most
    tolerance  : stop when the penalised value rises by less than this share
    prior      : strength of all priors; 0 is maximum likelihood
    stickiness : Dirichlet counts added to every state's staying
    seed       : of the k-means start
    """

    states: int = 4
    rounds: int = 50
    tolerance: float = 1e-5
    prior: float = 1.0
    stickiness: float = 2.0
    seed: int = 0


@dataclass(frozen=True)
class HMMFit:
    """A learned model, its log evidence plus log prior after every round, and why learning stopped."""

    hmm: HMM
    values: tuple[float, ...]
    stopped: str


def hmm_all(hmm: HMM, ys: Sequence[Array]) -> list[HMMPosterior]:
    """The posterior of each sequence (T, M), T >= 1; NaN entries were not measured."""
    if not len(ys):
        return []
    liks = np.split(_expected(hmm, np.concatenate(ys)).log_lik, _cuts(ys))
    with np.errstate(divide="ignore"):
        log_pi0, log_Pi = np.log(hmm.pi0), np.log(hmm.Pi)
    chains = forward_backward_all(log_pi0, log_Pi, liks)
    paths = best_path_all(log_pi0, log_Pi, liks)
    return [
        HMMPosterior(chain.prob, chain.pair, chain.log_evidence, path)
        for chain, (path, _) in zip(chains, paths, strict=True)
    ]


def learn_hmm(
    ys: Sequence[Array],
    *,
    names: Sequence[str],
    fps: float,
    label: str,
    options: HMMOptions = HMMOptions(),
    weights: Array | None = None,
) -> HMMFit:
    """Learn the states of one motion's poses.

    Args:
        ys: sequences (T, M), T >= 1; NaN entries were not measured.
        names: the M freedoms.
        fps: frames a second of the sequences.
        label: name of the motion, given to every state.
        weights: how much each sequence counts (mean 1), e.g. to balance subjects.

    Raises:
        ValueError: no sequences, ones of another shape, or a freedom that was never measured.
    """
    _check(ys, names)
    w = np.ones(len(ys)) if weights is None else weights / weights.mean()
    y = np.concatenate(ys)
    spread = np.nanvar(y, axis=0) + STILL
    prior = _Prior(
        cov=options.prior * 0.1 * spread,
        count=options.prior * (len(names) + 2.0),
        pi0=np.full(options.states, 0.1 * options.prior),
        Pi=options.prior * (0.1 + options.stickiness * np.eye(options.states)),
    )
    hmm = _first(ys, w, prior, spread, tuple(names), label, fps, options)
    best, stopped = hmm, f"reached {options.rounds} rounds"
    values: list[float] = []
    for _ in range(options.rounds):
        posteriors = hmm_all(hmm, ys)
        value = sum(wn * p.log_evidence for wn, p in zip(w, posteriors, strict=True)) + _log_prior(hmm, prior)
        values.append(float(value))
        rise = values[-1] - values[-2] if len(values) > 1 else np.inf
        best = hmm if rise > 0 else best
        if rise < options.tolerance * abs(value):
            stopped = "rose by less than the tolerance"
            break
        hmm = _maximise(hmm, ys, [p.prob for p in posteriors], [p.pair for p in posteriors], w, prior)
    return HMMFit(best, tuple(values), stopped)


def combine_hmms(models: Sequence[HMM], crossing: float = 1e-3) -> HMM:
    """Models of several motions as one.

    A state leaves its own motion with probability `crossing` a frame, to any state of the others alike.

    Raises:
        ValueError: the models speak of other freedoms or rates.
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
class _Prior:
    """cov (M,) diagonal of the inverse-Wishart scale and its count; Dirichlet counts pi0 (K,), Pi (K,K)."""

    cov: Array
    count: float
    pi0: Array
    Pi: Array


@dataclass(frozen=True)
class _Expected:
    """Of T frames under every state: log_lik (T,K) of what was measured; the whole pose given that, mean
    (T,K,M), and cov (G,K,M,M) of the G frames `gappy` that miss something."""

    log_lik: Array
    mean: Array
    cov: Array
    gappy: NDArray[np.intp]


def _expected(hmm: HMM, y: Array) -> _Expected:
    K, M = hmm.mean.shape
    seen = ~np.isnan(y)
    whole, gappy = np.flatnonzero(seen.all(1)), np.flatnonzero(~seen.all(1))
    log_lik, mean = np.empty((len(y), K)), np.repeat(y[:, None], K, axis=1)
    root = np.linalg.cholesky(hmm.cov)
    white = np.linalg.solve(root, transpose(y[whole] - hmm.mean[:, None]))
    log_det = 2.0 * np.log(np.diagonal(root, axis1=-2, axis2=-1)).sum(-1)
    log_lik[whole] = -0.5 * ((white**2).sum(1).T + log_det + M * LOG_2PI)
    # A pose is a measurement of itself without noise.
    states = Gaussian(hmm.mean, hmm.cov)
    filled, log_lik[gappy] = update(states, y[gappy][:, None], np.eye(M), np.zeros((M, M)))
    mean[gappy] = filled.mean
    return _Expected(log_lik, mean, filled.cov, gappy)


def _maximise(
    hmm: HMM, ys: Sequence[Array], probs: Sequence[Array], pairs: Sequence[Array], w: Array, prior: _Prior
) -> HMM:
    """The M-step; a state that is never visited keeps what it had where the prior leaves it nothing."""
    expected = _expected(hmm, np.concatenate(ys))
    prob = np.concatenate([wn * p for wn, p in zip(w, probs, strict=True)])
    n = prob.sum(0)
    visited = n > 1e-9
    share = prob / np.where(visited, n, 1.0)
    mean = np.where(visited[:, None], (share[..., None] * expected.mean).sum(0), hmm.mean)
    apart = np.sqrt(prob)[..., None] * (expected.mean - mean)
    scatter = transpose(apart.swapaxes(0, 1)) @ apart.swapaxes(0, 1) + np.diag(prior.cov)
    scatter += (prob[expected.gappy][..., None, None] * expected.cov).sum(0)
    count = n + prior.count
    cov = symmetric(scatter) / np.where(count > 1e-9, count, 1.0)[:, None, None]
    first = sum(wn * p[0] for wn, p in zip(w, probs, strict=True))
    steps = sum(wn * p.sum(0) for wn, p in zip(w, pairs, strict=True))
    return replace(
        hmm,
        pi0=_rows((first + prior.pi0)[None], hmm.pi0)[0],
        Pi=_rows(steps + prior.Pi, hmm.Pi),
        mean=mean,
        cov=np.where((count > 1e-9)[:, None, None], cov, hmm.cov),
    )


def _rows(counts: Array, fallback: Array) -> Array:
    totals = counts.sum(-1, keepdims=True)
    return np.where(totals > 0, counts / np.where(totals > 0, totals, 1.0), fallback)


def _log_prior(hmm: HMM, prior: _Prior) -> float:
    """Up to a constant."""
    log_det = np.linalg.slogdet(hmm.cov)[1].sum()
    scale = np.trace(np.linalg.solve(hmm.cov, np.diag(prior.cov)), axis1=-2, axis2=-1).sum()
    log_Pi, log_pi0 = np.log(np.maximum(hmm.Pi, 1e-300)), np.log(np.maximum(hmm.pi0, 1e-300))
    switches = (prior.Pi * log_Pi).sum() + (prior.pi0 * log_pi0).sum()
    return float(switches - 0.5 * (prior.count * log_det + scale))


def _first(
    ys: Sequence[Array],
    w: Array,
    prior: _Prior,
    spread: Array,
    names: tuple[str, ...],
    label: str,
    fps: float,
    options: HMMOptions,
) -> HMM:
    """The model that the k-means clusters of the poses give."""
    K = options.states
    alike = HMM(
        pi0=np.full(K, 1.0 / K),
        Pi=np.full((K, K), 1.0 / K),
        mean=np.tile(np.nanmean(np.concatenate(ys), axis=0), (K, 1)),
        cov=np.tile(np.diag(spread), (K, 1, 1)),
        names=names,
        labels=(label,) * K,
        fps=fps,
    )
    probs = np.split(np.eye(K)[_clusters(ys, K, options.seed)], _cuts(ys))
    pairs = [prob[:-1, :, None] * prob[1:, None] for prob in probs]
    return _maximise(alike, ys, probs, pairs, w, prior)


def _clusters(ys: Sequence[Array], K: int, seed: int) -> NDArray[np.intp]:
    """The k-means cluster of every frame, each freedom divided by its spread and gaps interpolated."""
    y = np.concatenate(fill(ys))
    spread = y.std(axis=0)
    moves = spread > 1e-9 * np.abs(y).max(axis=0)  # what changes by rounding only must not be blown up
    scaled = y[:, moves] / spread[moves]
    poses = np.unique(scaled, axis=0)
    if len(poses) < K:
        return np.zeros(len(y), dtype=np.intp)
    rng = np.random.default_rng(seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a cluster that empties is a state not visited
        tries = [kmeans2(poses, K, minit="++", seed=rng)[0] for _ in range(TRIES)]
    squares = [((scaled[:, None] - centres) ** 2).sum(-1) for centres in tries]
    nearest = min(squares, key=lambda square: float(square.min(1).sum()))
    return np.asarray(nearest.argmin(1))


def _cuts(ys: Sequence[Array]) -> NDArray[np.intp]:
    return np.cumsum([len(y) for y in ys])[:-1]


def _check(ys: Sequence[Array], names: Sequence[str]) -> None:
    if not len(ys):
        raise ValueError("learning needs at least one sequence; got none")
    for n, y in enumerate(ys):
        if y.ndim != 2 or y.shape[1] != len(names) or len(y) < 1:
            raise ValueError(f"sequence {n} must be (T, {len(names)}) with T >= 1; got {y.shape}")
    never = np.isnan(np.concatenate(ys)).all(0)
    if never.any():
        raise ValueError(f"freedom {names[int(never.argmax())]!r} was never measured; leave it out")
