"""The M-step: parameters from expected moments.

Pavlović et al. (1999), section 2.3, with corrected limits of the sums (sums over steps have T - 1 terms and
never cross from one sequence to the next), an affine offset, weights per sequence and priors. All statistics
are computed before any parameter.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array, symmetric, transpose
from dynamics.learning.prior import Prior
from dynamics.learning.regression import solve
from dynamics.posterior import Posterior
from dynamics.slds import SLDS


def maximise(
    slds: SLDS, ys: Sequence[Array], posteriors: Sequence[Posterior], prior: Prior, weights: Array
) -> SLDS:
    """The parameters that maximise the expected log joint plus the log prior (C is fixed).

    A state that the posteriors never enter keeps its parameters where the priors add no counts.

    Args:
        slds, posteriors: the system, and its posterior for each sequence by any inference.
        ys, weights: sequences (T, M), and how much each counts.

    Raises:
        numpy.linalg.LinAlgError: without priors, if a state is entered less often than it has coefficients.
    """
    V, n = _step_statistics(posteriors, weights, len(slds.names))
    entered = n + prior.ridge.count > 0
    A, b, Q = slds.A.copy(), slds.b.copy(), slds.Q.copy()
    A[entered], b[entered], Q[entered] = solve(V[entered], n[entered], slds.layout, prior.ridge)
    mean0, cov0 = _start(posteriors, weights, prior)
    counts = sum(w * p.pair.sum(0) for w, p in zip(weights, posteriors, strict=True))
    counts = counts + prior.alpha + prior.sticky * np.eye(slds.K)
    first = sum(w * p.prob[0] for w, p in zip(weights, posteriors, strict=True)) + prior.alpha
    unborn = first + prior.start_count <= 1e-9
    return replace(
        slds,
        A=A,
        b=b,
        Q=Q,
        Pi=shares(counts, slds.Pi),
        pi0=shares(first[None], slds.pi0[None])[0],
        mean0=np.where(unborn[:, None], slds.mean0, mean0),
        cov0=np.where(unborn[:, None, None], slds.cov0, cov0),
        R=_measurement_noise(slds, ys, posteriors, weights, prior),
    )


def _step_statistics(posteriors: Sequence[Posterior], weights: Array, d: int) -> tuple[Array, Array]:
    """sum_t E[v v' s_t(k)] with v = [pose_t; x_{t-1}; 1], and the expected counts (K,)."""
    K, N = posteriors[0].prob.shape[1], posteriors[0].states.mean.shape[1]
    V, n = np.zeros((K, d + N + 1, d + N + 1)), np.zeros(K)
    spread = np.zeros((K, 1, 4 * N * N))
    pick = np.r_[0:d, N : 2 * N]
    for w, posterior in zip(weights, posteriors, strict=True):
        prob, steps = w * posterior.prob[1:], posterior.step_moments()
        mean = steps.mean[..., pick]
        v = np.concatenate([mean, np.ones((*mean.shape[:-1], 1))], axis=-1).swapaxes(0, 1)
        V += (prob.T[:, None] * transpose(v)) @ v
        spread += prob.T[:, None] @ steps.cov.reshape(*mean.shape[:-1], -1).swapaxes(0, 1)
        n += prob.sum(0)
    V[:, :-1, :-1] += spread.reshape(K, 2 * N, 2 * N)[:, pick[:, None], pick]
    return V, n


def _start(posteriors: Sequence[Posterior], weights: Array, prior: Prior) -> tuple[Array, Array]:
    """Mean and covariance of the first frame's state given each switching state."""
    K, N = posteriors[0].prob.shape[1], posteriors[0].states.mean.shape[1]
    n, total, square = np.zeros(K), np.zeros((K, N)), np.zeros((K, N, N))
    for w, posterior in zip(weights, posteriors, strict=True):
        prob, first = w * posterior.prob[0], posterior.start_moments()
        n += prob
        total += prob[:, None] * first.mean
        outer = first.mean[..., :, None] * first.mean[..., None, :]
        square += prob[:, None, None] * (first.cov + outer)
    # A state in which no sequence starts takes the mean of those in which some do, at the prior's covariance.
    born = n > 1e-9
    own, common = total / np.maximum(n, 1e-9)[:, None], total.sum(0) / max(n.sum(), 1e-9)
    mean = np.where(born[:, None], own, common)
    scatter = square - n[:, None, None] * mean[:, :, None] * mean[:, None, :]
    scatter = np.where(born[:, None, None], scatter, 0.0)
    count = np.maximum(n + prior.start_count, 1e-9)
    return mean, symmetric(scatter + np.diag(prior.start)) / count[:, None, None]


def _measurement_noise(
    slds: SLDS, ys: Sequence[Array], posteriors: Sequence[Posterior], weights: Array, prior: Prior
) -> Array:
    """R from the residuals of every frame."""
    w = np.repeat(weights, [len(y) for y in ys])
    e = np.concatenate(ys) - np.concatenate([p.states.mean for p in posteriors]) @ slds.C.T
    cov = np.tensordot(w, np.concatenate([p.states.cov for p in posteriors]), 1)
    scatter = np.diag(prior.R) + (w * e.T) @ e + slds.C @ cov @ slds.C.T
    return symmetric(scatter / (prior.R_count + w.sum()))


def shares(counts: Array, fallback: Array) -> Array:
    """The rows of counts (..., K) as probabilities; the fallback's row where all counts are 0."""
    totals = counts.sum(-1, keepdims=True)
    return np.where(totals > 0, counts / np.where(totals > 0, totals, 1.0), fallback)
