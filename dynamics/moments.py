"""Moments of a learned motion: of a run of frames in one switching state, and of all states together.

They need mean0 and cov0 to describe the motion anywhere in it, as `em.anywhere` leaves them.
"""

from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array, symmetric
from dynamics.regression import form, maximum_likelihood, solve
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

    The dynamics are the M-step's regression on the moments of one step, averaged over the states of a motion
    by the time spent in each.
    """
    share = stationary(slds.Pi)
    motions = tuple(dict.fromkeys(slds.labels))
    belongs = np.array([[label == motion for label in slds.labels] for motion in motions], dtype=float)
    weights = belongs * share
    weights /= weights.sum(1, keepdims=True)
    shape = form(slds.names, slds.travelling, slds.order)
    A, b, Q = solve(
        np.tensordot(weights, _step_moments(slds), 1), np.ones(len(motions)), shape, maximum_likelihood(shape)
    )
    mean0 = weights @ slds.mean0
    apart = slds.mean0 - mean0[:, None]
    spread = slds.cov0 + apart[..., :, None] * apart[..., None, :]
    Pi = weights @ slds.Pi @ belongs.T
    return replace(
        slds,
        pi0=belongs @ slds.pi0,
        Pi=Pi / Pi.sum(1, keepdims=True),
        A=A,
        b=b,
        Q=Q,
        mean0=mean0,
        cov0=symmetric((weights[..., None, None] * spread).sum(1)),
        labels=motions,
    )


def _step_moments(slds: SLDS) -> Array:
    """(K, d + N + 1, d + N + 1) E[v v'] of v = [pose_t; x_{t-1}; 1] in each state; see `regression`."""
    d, frames = len(slds.names), slds.order + 1
    newest_first = np.arange(frames * d).reshape(frames, d)[::-1].ravel()
    moments = []
    for k in range(slds.K):
        mean, cov = run_moments(slds, k, frames)
        v = np.append(mean[newest_first], 1.0)
        moment = np.outer(v, v)
        moment[:-1, :-1] += cov[np.ix_(newest_first, newest_first)]
        moments.append(moment)
    return np.stack(moments)
