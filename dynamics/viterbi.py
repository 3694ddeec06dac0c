"""Approximate Viterbi: the best switching path, then smoothing along it.

Pavlović et al. (1999), equations 2 to 12, read with these corrections: the cost of a transition is minus the
log of the innovation's likelihood (equation 6, constants kept, so that -J is a log-likelihood), covariances
are those at time t, and J_0 is the same with the first frame's prior. Of every state only the best
predecessor is kept, so the path may differ from the exact best one; its cost is the exact -log p(Y, S*).

Only the innovation is needed to choose the predecessor j of a state i. With G_i = C A_i,

    e_ji = y_t - C b_i - G_i x_j,   S_ji = G_i P_j G_i' + C Q_i C' + R,

and just the K chosen beliefs are predicted and updated in full (`dynamics.pairs`).
"""

from collections.abc import Sequence

import numpy as np

from dynamics.frames import Frames, in_batches
from dynamics.gaussian import LOG_2PI, Array, Gaussian, Ints
from dynamics.kalman import reverse, update
from dynamics.posterior import Posterior
from dynamics.slds import SLDS

CHUNK = 128  # backward steps computed at a time: more do not fit the processor's cache


def viterbi(slds: SLDS, y: Array, hints: Array | None = None) -> Posterior:
    """The best path through one sequence (T, M), T >= 1; NaN entries were not measured.

    `hints` (T, K) are added to the log likelihoods of the switching states, None adds nothing; ValueError if
    no path is possible.
    """
    return viterbi_all(slds, [y], None if hints is None else [hints])[0]


def viterbi_all(slds: SLDS, ys: Sequence[Array], hints: Sequence[Array] | None = None) -> list[Posterior]:
    """The best path through each of several sequences, as `viterbi`; their lengths may differ."""
    return in_batches(slds, ys, hints, lambda frames: _posteriors(slds, frames))


def best_log_p_all(slds: SLDS, ys: Sequence[Array]) -> list[float]:
    """The log evidence alone that `viterbi_all` finds for each sequence."""
    return in_batches(slds, ys, None, lambda frames: _best_log_p(forward(slds, frames)[2], frames).tolist())


def forward(slds: SLDS, frames: Frames) -> tuple[Gaussian, Ints, Array]:
    """The filter.

    Returns:
        x_t (rows, K) given y up to t and the best path to each state; the best predecessor (rows, K) of each
        state, meaningless in the first frame; and (rows, K) minus log p(y up to t, best path to each state).
    """
    from dynamics.pairs import constants, viterbi_rows  # slow to import

    K, N = slds.b.shape
    rows, now = len(frames.y), frames.at(0)
    extra = frames.hints - 0.5 * LOG_2PI * (~np.isnan(frames.y)).sum(-1)[:, None]
    beliefs = Gaussian(np.empty((rows, K, N)), np.empty((rows, K, N, N)))
    back, cost = np.zeros((rows, K), dtype=np.intp), np.empty((rows, K))
    beliefs[now], log_lik = update(slds.start, frames.y[now, None], slds.C, slds.R)
    cost[now] = -slds.log_pi0 - log_lik - frames.hints[now]
    found = beliefs.mean, beliefs.cov, cost, back
    viterbi_rows(constants(slds, slds.C, slds.R), slds.log_Pi, frames.y, extra, frames.before, found)
    return beliefs, back, cost


def _best_log_p(cost: Array, frames: Frames) -> Array:
    """log p(y, best path) of each sequence."""
    value = -cost[_last(frames)].min(-1)
    if not np.isfinite(value).all():
        raise ValueError("no switching path is possible; see pi0, Pi and hints")
    return np.asarray(value)


def _last(frames: Frames) -> Ints:
    return np.array([rows[-1] for rows in frames.sequences()])


def _posteriors(slds: SLDS, frames: Frames) -> list[Posterior]:
    beliefs, back, cost = forward(slds, frames)
    value = _best_log_p(cost, frames)
    path = _backtrace(back, cost, frames)
    states, lag = _smooth(slds, beliefs, path, frames)
    return [
        Posterior.on_path(path[rows], slds.K, states[rows], lag[rows[1:]], float(log_p))
        for rows, log_p in zip(frames.sequences(), value, strict=True)
    ]


def _backtrace(back: Ints, cost: Array, frames: Frames) -> Ints:
    """(rows,) the switching states of each sequence's cheapest path."""
    path, last = np.empty(len(frames.y), dtype=np.intp), _last(frames)
    path[last] = cost[last].argmin(-1)
    for earlier, now in frames.back():
        chosen = path[now]
        path[earlier] = back[now][np.arange(len(chosen)), chosen]
    return path


def _smooth(slds: SLDS, beliefs: Gaussian, path: Ints, frames: Frames) -> tuple[Gaussian, Array]:
    """RTS along each path: the states (rows,), and Cov(x_t, x_{t-1}) in the row of t."""
    states = beliefs[np.arange(len(path)), path]
    lag = np.zeros_like(states.cov)
    for rows, steps in frames.chunks(CHUNK):
        s = path[rows]
        back = reverse(states[frames.before[rows]], slds.A[s], slds.b[s], slds.Q[s])
        for earlier, now in steps:
            states[earlier] = back[now.start - rows.start : now.stop - rows.start].step(states[now])
        lag[rows] = back.lag(states.cov[rows])
    return states, lag
