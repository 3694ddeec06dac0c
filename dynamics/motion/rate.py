"""The same motion at another frame rate, and the moments of a learned motion.

Every state's own Gaussian over [q_t, q_{t-1}] (mean0, cov0 as `em.anywhere` leaves them) and its dynamics
give the joint Gaussian of a run of frames. Poses at the new rate are cubic interpolations of those frames, so
their joint moments follow in closed form, and the M-step's regression turns these into A, b and Q. A matrix
logarithm is not used: it often does not exist for gait dynamics, which have real negative eigenvalues.
"""

from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array, Gaussian, apply, collapse, transpose
from dynamics.kalman import update
from dynamics.learning.regression import maximum_likelihood, solve
from dynamics.region import regions
from dynamics.slds import SLDS

# Error of poses in a second, leg lengths or radians: nearly collinear successive poses have no regression.
UNSURE = 0.15
SAME = 5e-3  # difference of two rates, as a share, below which they count as one: 29.97 and 30


def at_rate(slds: SLDS, fps: float) -> SLDS:
    """The system with one step standing for 1/fps seconds; ValueError beyond a quarter to four times as
    many.

    Its mean0 and cov0 must describe the whole motion, as `em.anywhere` makes them.
    """
    step = slds.fps / fps
    if not 0.25 * (1.0 - SAME) <= step <= 4.0 * (1.0 + SAME):
        raise ValueError(f"cannot go from {slds.fps:g} to {fps:g} frames a second; learn again at that rate")
    if abs(step - 1.0) < SAME:
        return replace(slds, fps=fps)
    times = [1.0 + lag * step for lag in range(slds.order, -1, -1)]
    run = int(np.ceil(slds.order * step)) + 4
    newest = (slds.order - 1) * max(step, 1.0)
    here = [newest - lag * step for lag in range(slds.order)]
    return replace(_regressed(slds, times, here, run, fps), Pi=_dwell(slds.Pi, step), fps=fps)


def backwards(slds: SLDS) -> SLDS:
    """The same motion with time running the other way, for frames before the marked one."""
    times = [1.0 + lag for lag in range(slds.order + 1)]
    share = stationary(slds.Pi)
    Pi = (share[:, None] * slds.Pi).T / np.maximum(share @ slds.Pi, 1e-300)[:, None]
    here = [slds.order - 1.0 + lag for lag in range(slds.order)]
    reversed_ = _regressed(slds, times, here, slds.order + 4, slds.fps)
    return replace(reversed_, Pi=Pi / Pi.sum(1, keepdims=True))


def stationary(Pi: Array) -> Array:
    """(K,) the share of time spent in each state: the left eigenvector of Pi to eigenvalue 1."""
    K = len(Pi)
    system = np.vstack([Pi.T - np.eye(K), np.ones(K)])
    share: Array = np.linalg.lstsq(system, np.append(np.zeros(K), 1.0), rcond=None)[0]
    return np.maximum(share, 1e-12)


def run_moments(slds: SLDS, run: int) -> Gaussian:
    """Joint Gaussian of the poses of `run` successive frames, oldest first; mean (K, run M) by state."""
    d, (K, N) = len(slds.names), slds.b.shape
    n = N + (run - slds.order) * d
    whole = np.tile(np.eye(n), (K, 1, 1))
    whole[:, :N, :N] = slds.cov0
    root = np.linalg.cholesky(slds.Q[:, :d, :d])
    # The states of all frames as a linear function of the first one and the white noise of each step.
    mean, maps = [slds.mean0], [np.tile(np.eye(N, n), (K, 1, 1))]
    for start in range(N, n, d):
        mean.append(apply(slds.A, mean[-1]) + slds.b)
        maps.append(slds.A @ maps[-1])
        maps[-1][:, :d, start : start + d] = root
    poses = np.concatenate([mean[0][:, d:], *(m[:, :d] for m in mean)], axis=1)
    rows = np.concatenate([maps[0][:, d:], *(m[:, :d] for m in maps)], axis=1)
    return Gaussian(poses, rows @ whole @ transpose(rows))


def by_motion(slds: SLDS) -> SLDS:
    """The same motions with one switching state each, averaged over the switching states within a motion.

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


def _regressed(slds: SLDS, times: list[float], here: list[float], run: int, fps: float) -> SLDS:
    """The model regressed from the poses' joint moments at these times in a run of frames, newest first.

    Args:
        here: times of a state's poses as near as can be to the run's beginning, which is anywhere in the
            motion; later the poses are those of a figure that never switches.
        fps: frames a second of the result.
    """
    layout, d, frames = slds.layout, slds.layout.d, run_moments(slds, run)

    def at(moments: list[float]) -> Gaussian:
        pick = np.kron(np.stack([_cubic(time, run) for time in moments]), np.eye(d))
        return frames.through(pick.astype(np.float64))

    start, N = at(here).through(layout.from_here), layout.N
    poses = at(times)
    unsure = Gaussian(poses.mean, poses.cov + (UNSURE / fps) ** 2 * np.eye(poses.mean.shape[-1]))
    A, b, Q = solve(_with_one(unsure), np.ones(slds.K), layout, maximum_likelihood(layout))
    # Interpolated frames are smoother than filmed ones, hence a hundredth of the old variance is added.
    own = np.arange(d)
    Q[:, own, own] += 1e-2 * slds.Q[:, own, own]
    return replace(slds, A=A, b=b, Q=Q, mean0=start.mean, cov0=start.cov + 1e-6 * np.eye(N))


def _cubic(time: float, run: int) -> Array:
    """(run,) weights of cubic Lagrange interpolation at a time between frames 0 .. run - 1."""
    first = int(np.clip(np.floor(time) - 1, 0, run - 4))
    nodes = np.arange(first, first + 4)
    weights = np.zeros(run)
    for i in nodes:
        others = nodes[nodes != i]
        weights[i] = np.prod((time - others) / (i - others))
    return weights


def _dwell(Pi: Array, step: float) -> Array:
    """Transition probabilities over `step` old frames, with the old distribution of dwell times."""
    if len(Pi) == 1:
        return Pi
    stay = np.clip(np.diag(Pi), 1e-9, 1.0 - 1e-12)
    leave = 1.0 - stay**step
    out = Pi * (leave / (1.0 - stay))[:, None]
    out[np.diag_indices(len(Pi))] = 1.0 - leave
    return np.asarray(out / out.sum(1, keepdims=True))


def _step_moments(slds: SLDS) -> Array:
    """(K, d + N + 1, d + N + 1) E[v v' s_t(k)] of v = [pose_t; x_{t-1}; 1] anywhere in the motions.

    x_{t-1} is distributed as the region of a state j; if the next state is k, as the part of it that A_k
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
    return np.asarray((share[..., None, None] * _with_one(Gaussian(mean, cov))).sum(0))


def _with_one(of: Gaussian) -> Array:
    """(..., n + 1, n + 1) E[v v'] of v = [x; 1]."""
    v = np.concatenate([of.mean, np.ones((*of.mean.shape[:-1], 1))], axis=-1)
    moments = v[..., :, None] * v[..., None, :]
    moments[..., :-1, :-1] += of.cov
    return np.asarray(moments)
