"""Hidden Markov models to test with, and what follows from them by a sum over all paths."""

from itertools import pairwise, product

import numpy as np

from dynamics.hmm import HMM
from tests.oracles import log_density, random_covariance


def random_hmm(K, rng, *, M=2, apart=1.5):
    return HMM(
        pi0=rng.dirichlet(np.full(K, 3.0)),
        Pi=0.7 * np.eye(K) + 0.3 * rng.dirichlet(np.ones(K), size=K),
        mean=apart * rng.normal(size=(K, M)),
        cov=np.stack([random_covariance(M, rng) for _ in range(K)]),
        names=tuple("abcdefgh"[:M]),
        labels=("random",) * K,
        fps=30.0,
    )


def density(hmm, k, pose):
    """log p of what was measured of a pose."""
    seen = ~np.isnan(pose)
    if not seen.any():
        return 0.0
    return log_density(pose[seen], hmm.mean[k, seen], hmm.cov[k][np.ix_(seen, seen)])


def enumerated(hmm, y):
    """prob, pair, log evidence and best path."""
    densities = np.array([[density(hmm, k, pose) for k in range(len(hmm.pi0))] for pose in y])
    with np.errstate(divide="ignore"):
        return of_all_paths(np.log(hmm.pi0), np.log(hmm.Pi), densities)


def of_all_paths(log_pi0, log_Pi, log_lik):
    """The same of a chain, by all K**T paths."""
    T, K = log_lik.shape
    paths = list(product(range(K), repeat=T))
    values = []
    for path in paths:
        value = log_pi0[path[0]] + log_lik[np.arange(T), path].sum()
        values.append(value + sum(log_Pi[i, j] for i, j in pairwise(path)))
    log_evidence = np.logaddexp.reduce(values)
    prob, pair = np.zeros((T, K)), np.zeros((T - 1, K, K))
    for path, weight in zip(paths, np.exp(np.array(values) - log_evidence), strict=True):
        prob[np.arange(T), path] += weight
        pair[np.arange(T - 1), path[:-1], path[1:]] += weight
    return prob, pair, log_evidence, paths[int(np.argmax(values))]
