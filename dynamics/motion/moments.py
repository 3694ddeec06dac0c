"""Moments of a learned motion: of a run of frames in one switching state, and of all states together.

They need mean0 and cov0 to describe the motion anywhere in it, as `em.anywhere` leaves them.
"""

from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array, Gaussian, apply, collapse, transpose
from dynamics.kalman import update
from dynamics.learning.regression import maximum_likelihood, solve
from dynamics.region import regions
from dynamics.slds import SLDS


def stationary(Pi: Array) -> Array:
    """(K,) the share of time spent in each state: the left eigenvector of Pi to eigenvalue 1."""
    K = len(Pi)
    system = np.vstack([Pi.T - np.eye(K), np.ones(K)])
    share: Array = np.linalg.lstsq(system, np.append(np.zeros(K), 1.0), rcond=None)[0]
    return np.maximum(share, 1e-12)


def run_moments(slds: SLDS, k: int, run: int) -> tuple[Array, Array]:
    """Joint moments of the poses of `run` frames in state k, oldest first."""
    d, N = len(slds.names), slds.A.shape[-1]
    mean = [slds.mean0[k]]
    maps = [np.eye(N, N + (run - slds.order) * d)]
    root = np.zeros((N, d))
    root[:d] = np.linalg.cholesky(slds.Q[k][:d, :d])
    for t in range(run - slds.order):
        noise = np.zeros((N, N + (run - slds.order) * d))
        noise[:, N + t * d : N + (t + 1) * d] = root
        mean.append(slds.A[k] @ mean[-1] + slds.b[k])
        maps.append(slds.A[k] @ maps[-1] + noise)
    poses = [m[:d] for m in mean]
    rows = [m[:d] for m in maps]
    if slds.order == 2:
        poses.insert(0, mean[0][d:])
        rows.insert(0, maps[0][d:])
    whole = np.eye(N + (run - slds.order) * d)
    whole[:N, :N] = slds.cov0[k]
    stack = np.vstack(rows)
    return np.concatenate(poses), stack @ whole @ stack.T


def by_motion(slds: SLDS) -> SLDS:
    """The same motions with one switching state each: what is left when the switch within one is not known.

    The dynamics are the M-step's regression on the moments of a step, averaged over the states of a motion.
    """
    motions = tuple(dict.fromkeys(slds.labels))
    belongs = np.array([[label == motion for label in slds.labels] for motion in motions], dtype=float)
    weights = belongs * slds.pi0
    weights /= weights.sum(1, keepdims=True)
    V = np.tensordot(belongs, _step_moments(slds), 1)
    A, b, Q = solve(V, V[:, -1, -1], slds.layout, maximum_likelihood(slds.layout))
    states = Gaussian(np.broadcast_to(slds.mean0, (len(motions), *slds.mean0.shape)), slds.cov0)
    whole = collapse(weights, states)
    Pi = weights @ slds.Pi @ belongs.T
    return replace(
        slds,
        pi0=belongs @ slds.pi0,
        Pi=Pi / Pi.sum(1, keepdims=True),
        A=A,
        b=b,
        Q=Q,
        mean0=whole.mean,
        cov0=whole.cov,
        labels=motions,
    )


def _step_moments(slds: SLDS) -> Array:
    """(K, d + N + 1, d + N + 1) E[v v' s_t(k)] of v = [pose_t; x_{t-1}; 1] anywhere in the motions.

    x_{t-1} lies in the region of some state j, and where it goes on in state k, in the part of it that A_k
    leads into the region of k (the recurrent switch of `dynamics.region`).
    """
    K, N = slds.b.shape
    d = len(slds.names)
    reach = regions(slds)
    every = Gaussian(np.broadcast_to(slds.mean0[:, None], (K, K, N)), slds.cov0[:, None])
    entered = reach.mean - slds.b @ reach.regard.T
    before, log_lik = update(every, entered, reach.regard @ slds.A, reach.cov)
    log_joint = slds.log_Pi + log_lik
    share = slds.pi0[:, None] * np.exp(log_joint - np.logaddexp.reduce(log_joint, axis=1, keepdims=True))
    lead = np.concatenate([slds.A[:, :d], np.broadcast_to(np.eye(N), (K, N, N))], axis=1)
    mean = apply(lead, before.mean) + np.pad(slds.b[:, :d], ((0, 0), (0, N)))
    cov = lead @ before.cov @ transpose(lead)
    cov[..., :d, :d] += slds.Q[:, :d, :d]
    v = np.concatenate([mean, np.ones((K, K, 1))], axis=-1)
    moments = v[..., :, None] * v[..., None, :]
    moments[..., :-1, :-1] += cov
    return np.asarray((share[..., None, None] * moments).sum(0))
