"""A first guess of the switching states, for EM to climb from.

Three ways, all of which take every pose as measured exactly. "kmeans": clusters of poses and velocities.
"hmm": the states of a hidden Markov model of the same, as in the 1999 paper. "segments": dynamics fitted to
random segments, then labels and dynamics in turn, a switching autoregression by hard EM.

Oscillations that pass through the same poses cannot be told apart by where they are, only by how they move.
Measured on 18 sequences of 50 frames of such (8 freedoms, order 2, 4 states; mean of three draws), labels
right after EM from one start: k-means 0.41, hmm 0.64, segments 0.85, for about a seventh more time than
k-means. At first order, with offsets that tell states apart: 0.76, 0.84, 0.77. On captured walks and runs EM
ended higher from segments than from the others in all six fits; on subjects held out the starts differed by
less than a standard error.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dynamics.chain import best_path_all, split_as
from dynamics.gaussian import Array, Gaussian, inverse_root
from dynamics.hmm import hmm_all
from dynamics.layout import Layout
from dynamics.learning.baum_welch import ROUNDS as HMM_ROUNDS
from dynamics.learning.baum_welch import learn_hmm
from dynamics.learning.clusters import clustered, scaled
from dynamics.learning.fill import fill
from dynamics.learning.options import Options
from dynamics.learning.prior import data_prior
from dynamics.learning.regression import Ridge, solve
from dynamics.posterior import Posterior

SEGMENT = 10  # frames that dynamics are first fitted to
STAY = 0.95  # probability that labels of segments stay
TRIES, ROUNDS = 20, 10  # of segments: more tries raise the labels found by a few per cent


def first_guess(
    ys: Sequence[Array], layout: Layout, options: Options, rng: np.random.Generator
) -> list[Posterior]:
    """Posteriors of the switching states by the start that the options name.

    Args:
        ys: sequences (T, M), T >= 2; NaN entries are filled as `fill.fill` does.
        layout: of the states.
        options: states and start.
        rng: what every start draws from.
    """
    filled, K = fill(ys), options.states
    if K == 1 or options.start == "kmeans":
        return kmeans(filled, K, layout, rng)
    if options.start == "hmm":
        return hmm(filled, K, layout, rng)
    # With no prior at all a segment is shorter than it takes to fit the dynamics.
    prior = data_prior(ys, layout, replace(options, prior=max(options.prior, 1.0)))
    return segments(filled, K, layout, prior.ridge, rng)


def kmeans(ys: Sequence[Array], K: int, layout: Layout, rng: np.random.Generator) -> list[Posterior]:
    """Posteriors that take every frame's k-means cluster as its switching state.

    Args:
        ys: sequences (T, M) without gaps, T >= 2.
        K: how many clusters.
        layout: of the states.
    """
    features = _features(ys, layout)
    labels = split_as(clustered(np.concatenate(features), K, rng), ys)
    return [_labelled(y, s, K, layout.order) for y, s in zip(ys, labels, strict=True)]


def hmm(ys: Sequence[Array], K: int, layout: Layout, rng: np.random.Generator) -> list[Posterior]:
    """Posteriors that take the best path of a hidden Markov model learned here as the switching states.

    Arguments as in `kmeans`.
    """
    features = _features(ys, layout)
    if K == 1 or features[0].shape[1] == 0:
        return kmeans(ys, K, layout, rng)
    names = [f"feature {i}" for i in range(features[0].shape[1])]
    options = Options(states=K, rounds=HMM_ROUNDS, seed=int(rng.integers(2**31)))
    fit = learn_hmm(features, names=names, fps=1.0, label="start", options=options)
    paths = [posterior.path for posterior in hmm_all(fit.hmm, features)]
    return [_labelled(y, s, K, layout.order) for y, s in zip(ys, paths, strict=True)]


def segments(
    ys: Sequence[Array], K: int, layout: Layout, ridge: Ridge, rng: np.random.Generator
) -> list[Posterior]:
    """Posteriors that take every frame as measured exactly and label it by the dynamics it follows.

    Each state's dynamics are fitted to a random segment, then labels (the best path at a fixed probability of
    staying) and dynamics are fitted in turn. Of several tries, one of them from the k-means clusters, the
    most likely is kept.

    Args:
        ys: sequences (T, M) without gaps, T >= 2.
        K: how many states.
        layout: of the states.
        ridge: prior of the regression; one that determines it.
    """
    steps = [_steps(y, layout.order) for y in ys]
    v = np.concatenate(steps)
    if K == 1 or len(v) == 0:
        return [_labelled(y, np.zeros(len(y), dtype=np.intp), K, layout.order) for y in ys]
    log_pi0 = np.full(K, -np.log(K))
    log_Pi = np.log(np.where(np.eye(K) > 0, STAY, (1.0 - STAY) / (K - 1)))
    first = rng.integers(0, max(len(v) - SEGMENT, 0) + 1, size=(TRIES, K, 1))
    chosen = (np.arange(len(v)) >= first) & (np.arange(len(v)) < first + SEGMENT)
    clusters = [posterior.prob[layout.order :] for posterior in kmeans(ys, K, layout, rng)]
    chosen[0] = np.concatenate(clusters).T > 0
    for _ in range(ROUNDS):
        log_liks = [_refitted(v, each, layout, ridge) for each in chosen]
        parts = [part for log_lik in log_liks for part in split_as(log_lik, steps) if len(part)]
        paths = best_path_all(log_pi0, log_Pi, parts)
        values = np.array([value for _, value in paths]).reshape(TRIES, -1).sum(1)
        s = np.concatenate([path for path, _ in paths]).reshape(TRIES, -1)
        chosen = s[:, None] == np.arange(K)[:, None]
    labels = split_as(s[values.argmax()], steps)
    return [
        _labelled(y, _from_first(path, len(y)), K, layout.order) for y, path in zip(ys, labels, strict=True)
    ]


def _steps(y: Array, order: int) -> Array:
    """Rows [pose_t; x_{t-1}; 1]; at second order the first step starts from a pose that nobody measured."""
    x = _states(y, order)[order - 1 : -1]
    return np.hstack([y[order:], x, np.ones((len(x), 1))])


def _from_first(path: NDArray[np.intp], T: int) -> NDArray[np.intp]:
    """The path with the frames before it in its first state."""
    whole = np.zeros(T, dtype=np.intp)
    if len(path):
        whole[:] = path[0]
        whole[T - len(path) :] = path
    return whole


def _refitted(v: Array, chosen: NDArray[np.bool_], layout: Layout, ridge: Ridge) -> Array:
    """(n, K) log likelihood of n steps under dynamics fitted to those that each state has chosen (K, n)."""
    d = layout.d
    A, b, Q = solve((chosen[:, None] * v.T) @ v, chosen.sum(1).astype(float), layout, ridge)
    e = v[:, :d].T - A[:, :d] @ v[:, d:-1].T - b[:, :d, None]
    root, log_det = inverse_root(Q[:, :d, :d])
    log_lik: Array = -0.5 * (((root @ e) ** 2).sum(1) + log_det[:, None])
    return log_lik.T


def _features(ys: Sequence[Array], layout: Layout) -> list[Array]:
    """Poses and velocities, each divided by its spread."""
    stays = ~layout.travels
    raw = [np.hstack([y[:, stays], np.gradient(y, axis=0)]) for y in ys]
    size = np.abs(np.concatenate(ys)).max(axis=0)
    return split_as(scaled(np.concatenate(raw), np.hstack([size[stays], size])), ys)


def _labelled(y: Array, s: NDArray[np.intp], K: int, order: int) -> Posterior:
    """The posterior that is certain of these poses and switching states."""
    mean = _states(y, order)
    T, N = mean.shape
    prob = np.eye(K)[s]
    return Posterior(
        prob=prob,
        pair=prob[:-1, :, None] * prob[1:, None, :],
        states=Gaussian(mean, np.zeros((T, N, N))),
        lag=np.zeros((T - 1, N, N)),
        log_evidence=-np.inf,
        path=s,
    )


def _states(y: Array, order: int) -> Array:
    before = np.vstack([2.0 * y[:1] - y[1:2], y[:-1]])
    return y if order == 1 else np.hstack([y, before])
