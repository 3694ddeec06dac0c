"""The same motion at another frame rate.

Every state's own Gaussian over [q_t, q_{t-1}] (mean0, cov0 as `em.anywhere` leaves them) and its dynamics
give the joint Gaussian of a run of frames. Poses at the new rate are cubic interpolations of those frames, so
their joint moments follow in closed form, and the M-step's own regression turns these into A, b and Q. There
is no matrix logarithm, which gait dynamics (with real negative eigenvalues) often have not got.
"""

from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array, symmetric
from dynamics.learning.regression import maximum_likelihood, solve
from dynamics.motion.moments import run_moments, stationary
from dynamics.slds import SLDS


def at_rate(slds: SLDS, fps: float) -> SLDS:
    """The system with one step standing for 1/fps seconds; ValueError unless that is a quarter to four times
    the old rate.

    Its mean0 and cov0 must describe the motion anywhere in it.
    """
    step = slds.fps / fps
    if not 0.25 <= step <= 4.0:
        raise ValueError(f"cannot go from {slds.fps:g} to {fps:g} frames a second; learn again at that rate")
    if abs(step - 1.0) < 1e-3:
        return replace(slds, fps=fps)
    times = [1.0 + lag * step for lag in range(slds.order, -1, -1)]
    run = int(np.ceil(slds.order * step)) + 4
    return replace(_regressed(slds, times, run), Pi=_dwell(slds.Pi, step), fps=fps)


def backwards(slds: SLDS) -> SLDS:
    """The same motion with time running the other way, for frames before the marked one."""
    times = [1.0 + lag for lag in range(slds.order + 1)]
    share = stationary(slds.Pi)
    Pi = (share[:, None] * slds.Pi).T / np.maximum(share @ slds.Pi, 1e-300)[:, None]
    return replace(_regressed(slds, times, slds.order + 4), Pi=Pi / Pi.sum(1, keepdims=True))


def _regressed(slds: SLDS, times: list[float], run: int) -> SLDS:
    """Model regressed from the joint moments of the poses at these times of a run of frames, newest first."""
    layout, d = slds.layout, slds.layout.d
    pick = np.kron(np.stack([_cubic(time, run) for time in times]), np.eye(d))
    relative = layout.from_here
    V, mean0, cov0 = [], [], []
    for k in range(slds.K):
        mean, cov = run_moments(slds, k, run)
        mean, cov = pick @ mean, symmetric(pick @ cov @ pick.T)
        v = np.append(mean, 1.0)
        moment = np.outer(v, v)
        moment[:-1, :-1] += cov
        V.append(moment)
        here = slice(0, layout.N)
        mean0.append(relative @ mean[here])
        cov0.append(symmetric(relative @ cov[here, here] @ relative.T))
    A, b, Q = solve(np.stack(V), np.ones(slds.K), layout, maximum_likelihood(layout))
    floor = np.diag(np.full(layout.N, 1e-6))
    return replace(
        slds, A=A, b=b, Q=_floored(Q, slds.Q, d), mean0=np.stack(mean0), cov0=np.stack(cov0) + floor
    )


def _cubic(time: float, run: int) -> Array:
    """(run,) weights of cubic Lagrange interpolation at a time between frames 0 .. run - 1."""
    first = int(np.clip(np.floor(time) - 1, 0, run - 4))
    nodes = np.arange(first, first + 4)
    weights = np.zeros(run)
    for i in nodes:
        others = nodes[nodes != i]
        weights[i] = np.prod((time - others) / (i - others))
    return weights


def _floored(Q: Array, old: Array, d: int) -> Array:
    """Interpolated frames are smoother than filmed ones: a hundredth of the old variance is added."""
    out = Q.copy()
    least = 1e-2 * np.diagonal(old[:, :d, :d], axis1=1, axis2=2)
    out[:, np.arange(d), np.arange(d)] += least
    return out


def _dwell(Pi: Array, step: float) -> Array:
    """Transition probabilities over `step` old frames, with the old distribution of dwell times."""
    if len(Pi) == 1:
        return Pi
    stay = np.clip(np.diag(Pi), 1e-9, 1.0 - 1e-12)
    leave = 1.0 - stay**step
    out = Pi * (leave / (1.0 - stay))[:, None]
    out[np.diag_indices(len(Pi))] = 1.0 - leave
    return np.asarray(out / out.sum(1, keepdims=True))
