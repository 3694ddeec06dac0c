"""Initial switching states for EM.

Two ways, both of which take every pose as measured exactly. "kmeans": clusters of poses and velocities.
"hmm": the states of a hidden Markov model of the same, as in the 1999 paper. Models of captured walks and
runs that were learned from either differed by less than a standard error on subjects held out.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dynamics.chain import split_as
from dynamics.gaussian import Array, Gaussian
from dynamics.hmm import hmm_all
from dynamics.layout import Layout
from dynamics.learning.baum_welch import ROUNDS, learn_hmm
from dynamics.learning.clusters import clustered, scaled
from dynamics.learning.fill import fill
from dynamics.learning.options import Options
from dynamics.posterior import Posterior


def first_guess(
    ys: Sequence[Array], layout: Layout, options: Options, rng: np.random.Generator
) -> list[Posterior]:
    """Posteriors of the switching states of sequences (T, M), T >= 2, by the start that the options name."""
    guess = hmm if options.start == "hmm" else kmeans
    return guess(fill(ys), options.states, layout, rng)


def kmeans(ys: Sequence[Array], K: int, layout: Layout, rng: np.random.Generator) -> list[Posterior]:
    """Posteriors that take every frame's k-means cluster of K as its switching state; (T, M) without gaps, T
    >= 2."""
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
    options = Options(states=K, rounds=ROUNDS, seed=int(rng.integers(2**31)))
    fit = learn_hmm(features, names=names, fps=1.0, label="start", options=options)
    paths = [posterior.path for posterior in hmm_all(fit.hmm, features)]
    return [_labelled(y, s, K, layout.order) for y, s in zip(ys, paths, strict=True)]


def _features(ys: Sequence[Array], layout: Layout) -> list[Array]:
    """Poses and velocities, each divided by its spread."""
    stays = ~layout.travels
    raw = [np.hstack([y[:, stays], np.gradient(y, axis=0)]) for y in ys]
    size = np.abs(np.concatenate(ys)).max(axis=0)
    return split_as(scaled(np.concatenate(raw), np.hstack([size[stays], size])), ys)


def _labelled(y: Array, s: NDArray[np.intp], K: int, order: int) -> Posterior:
    """Posterior that holds these poses and switching states for certain."""
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
