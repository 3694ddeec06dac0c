"""Hidden Markov models to test with, and what follows from them by a sum over all paths."""

import numpy as np

from dynamics.hmm import HMM
from tests.oracles import every_path, log_density, random_covariance


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
    paths = every_path(K, T)
    values = log_pi0[paths[:, 0]] + log_lik[np.arange(T), paths].sum(1)
    values += log_Pi[paths[:, :-1], paths[:, 1:]].sum(1)
    log_evidence = np.logaddexp.reduce(values)
    weights, visits = np.exp(values - log_evidence), np.eye(K)[paths]
    pair = np.einsum("p,pti,ptj->tij", weights, visits[:, :-1], visits[:, 1:])
    return np.tensordot(weights, visits, 1), pair, log_evidence, paths[int(np.argmax(values))]
