"""Approximate Viterbi: the best switching path, then smoothing along it.

Pavlović et al. (1999), equations 2 to 12, read with these corrections: the cost of a transition is minus the
log of the innovation's likelihood (equation 6, constants kept, so that -J is a log-likelihood), covariances
are those at time t, and J_0 is the same with the first frame's prior. Of every state only the best
predecessor is kept, so the path may differ from the exact best one; its cost is the exact -log p(Y, S*).

Only the innovation is needed to choose the predecessor j of a state i. With G_i = C A_i,

    e_ji = y_t - C b_i - G_i x_j,   S_ji = G_i P_j G_i' + C Q_i C' + R,

and just the K chosen beliefs are predicted and updated in full. Time grows with K^2, memory with T.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynamics.frames import Frames, in_batches
from dynamics.gaussian import LOG_2PI, Array, Gaussian, apply, transpose
from dynamics.kalman import CORNER, condition, predict, reverse, surprise, update
from dynamics.posterior import Posterior
from dynamics.slds import SLDS

CHUNK = 128  # steps whose way back is computed at a time: more of them leave the cache


def viterbi(slds: SLDS, y: Array, hints: Array | None = None) -> Posterior:
    """The best path through one sequence (T, M), T >= 1; NaN entries were not measured.

    `hints` (T, K) are further log likelihood of each switching state, None zero; ValueError if they do not
    fit y or no path is possible.
    """
    return viterbi_all(slds, [y], None if hints is None else [hints])[0]


def viterbi_all(slds: SLDS, ys: Sequence[Array], hints: Sequence[Array] | None = None) -> list[Posterior]:
    """The best path through each of several sequences, as `viterbi`; their lengths may differ."""
    return in_batches(slds, ys, hints, lambda frames: _posteriors(slds, frames))


def best_log_p_all(slds: SLDS, ys: Sequence[Array]) -> list[float]:
    """The log evidence alone that `viterbi_all` finds for each sequence."""
    return in_batches(slds, ys, None, lambda frames: _best_log_p(forward(slds, frames), frames).tolist())


@dataclass(frozen=True)
class Forward:
    """What going forward leaves; rows as in `Frames`.

    beliefs : mean (rows, K, N), cov (rows, K, N, N) of x_t given y up to t and the best path to each state
    back    : (rows, K) the best predecessor of each state; of no meaning in the first frame
    cost    : (rows, K) minus log p(y up to t, best path to each state)
    """

    beliefs: Gaussian
    back: NDArray[np.intp]
    cost: Array


def forward(slds: SLDS, frames: Frames) -> Forward:
    """The filter: every state's best predecessor at every frame, and its belief."""
    K, N = slds.b.shape
    transitions = _Transitions(slds, frames)
    extra = frames.hints - 0.5 * LOG_2PI * (~np.isnan(frames.y)).sum(-1)[:, None]
    switch = -slds.log_Pi
    sequences, states = K * np.arange(len(frames.lengths))[:, None], np.arange(K)
    kept = np.empty((len(frames.y), K, N + 1, N))  # each mean in a row below its covariance
    mean, cov = kept[..., N, :], kept[..., :N, :]
    back, cost = np.zeros(extra.shape, dtype=np.intp), np.empty(extra.shape)

    now = frames.at(0)
    mean[now], cov[now] = slds.mean0, slds.cov0
    belief, log_lik = update(Gaussian(mean[now], cov[now]), frames.y[now, None], slds.C, slds.R)
    mean[now], cov[now], cost[now] = belief.mean, belief.cov, -slds.log_pi0 - log_lik - frames.hints[now]
    for earlier, now in _steps(frames):
        bordered, C = transitions.innovations(kept[earlier], now)
        total = cost[earlier, :, None] + switch + surprise(bordered)
        best = total.argmin(1)
        cost[now], back[now] = total.min(1) - extra[now], best

        place = sequences[: len(best)] + best
        chosen = kept[earlier].reshape(-1, N + 1, N).take(place, axis=0)
        innovation = bordered.reshape(-1, *bordered.shape[3:]).take(K * place + states, axis=0)
        prior = predict(Gaussian(chosen[..., N, :], chosen[..., :N, :]), slds.A, slds.b, slds.Q)
        belief = condition(prior, innovation[..., -1, :-1], C, innovation[..., :-1, :-1], slds.R)
        mean[now], cov[now] = belief.mean, belief.cov
    return Forward(Gaussian(mean, cov), back, cost)


class _Transitions:
    """The innovations of all transitions j to i at a frame, bordered as `surprise` takes them.

    With the mean in a row below the covariance, two products give e and S at once:

        [ S_ji   . ]   [ G_i   0 ] [ P_j  ]          [ C Q_i C' + R     .    ]
        [          ] = [         ] [      ] [G_i' 0] + [                       ]
        [ e_ji'  . ]   [  0   -1 ] [ x_j' ]          [ (y_t - C b_i)' CORNER ]
    """

    def __init__(self, slds: SLDS, frames: Frames) -> None:
        K, N = slds.b.shape
        M = len(slds.names)
        G = slds.C @ slds.A
        left, self._right = np.zeros((K, M + 1, N + 1)), np.zeros((K, N, M + 1))
        left[:, :M, :N], left[:, M, N] = G, -1.0
        self._left = left.reshape(K * (M + 1), N + 1)
        self._right[..., :M] = transpose(G)
        self._constant = np.full((len(frames.lengths), K, M + 1, M + 1), CORNER)
        self._constant[..., :M, :M] = slds.C @ slds.Q @ transpose(slds.C) + slds.R
        self._C, self._missing = slds.C, np.isnan(frames.y)
        self._target = np.where(self._missing, 0.0, frames.y)[:, None] - apply(slds.C, slds.b)
        counts = np.concatenate([[0], np.cumsum(self._missing.sum(-1))])
        self._missing_above = counts.tolist()

    def innovations(self, kept: Array, now: slice) -> tuple[Array, Array]:
        """(n, K, K, M+1, M+1), j before i, and C; where y_t is missing, S has unit rows and C zero rows."""
        n, K, _, N = kept.shape
        M = len(self._C)
        constant = self._constant[:n]
        constant[..., M, :M] = self._target[now]
        bordered: Array = (self._left @ kept).reshape(n, K, K, M + 1, N) @ self._right + constant[:, None]
        if self._missing_above[now.start] == self._missing_above[now.stop]:
            return bordered, self._C
        missing = self._missing[now]
        either = missing[:, :, None] | missing[:, None]
        np.copyto(bordered[..., :M, :M], np.eye(M), where=either[:, None, None])
        np.copyto(bordered[..., M, :M], 0.0, where=missing[:, None, None])
        return bordered, np.where(missing[:, None, :, None], 0.0, self._C)


def _steps(frames: Frames) -> list[tuple[slice, slice]]:
    """The rows of each frame but the first, after those of the same sequences a frame earlier."""
    return [(frames.earlier(now), now) for now in map(frames.at, range(1, len(frames.first) - 1))]


def _best_log_p(ahead: Forward, frames: Frames) -> Array:
    """log p(y, best path) of each sequence."""
    value = -ahead.cost[_last(frames)].min(-1)
    if not np.isfinite(value).all():
        raise ValueError("no switching path is possible; see pi0, Pi and hints")
    return np.asarray(value)


def _last(frames: Frames) -> NDArray[np.intp]:
    return np.array([rows[-1] for rows in frames.sequences()])


def _posteriors(slds: SLDS, frames: Frames) -> list[Posterior]:
    ahead = forward(slds, frames)
    value = _best_log_p(ahead, frames)
    path = _backtrace(ahead, frames, _last(frames))
    states, lag = _smooth(slds, ahead.beliefs, path, frames)
    return [
        Posterior.on_path(path[rows], slds.K, states[rows], lag[rows[1:]], float(log_p))
        for rows, log_p in zip(frames.sequences(), value, strict=True)
    ]


def _backtrace(ahead: Forward, frames: Frames, last: NDArray[np.intp]) -> NDArray[np.intp]:
    """(rows,) the switching states of each sequence's cheapest path, from its `last` row."""
    path = np.empty(len(frames.y), dtype=np.intp)
    path[last] = ahead.cost[last].argmin(-1)
    for earlier, now in reversed(_steps(frames)):
        chosen = path[now]
        path[earlier] = ahead.back[now][np.arange(len(chosen)), chosen]
    return path


def _smooth(slds: SLDS, beliefs: Gaussian, path: NDArray[np.intp], frames: Frames) -> tuple[Gaussian, Array]:
    """RTS along each path: the states (rows,), and Cov(x_t, x_{t-1}) in the row of t."""
    states = beliefs[np.arange(len(path)), path]
    lag = np.zeros_like(states.cov)
    steps = _steps(frames)
    for start, stop in frames.chunks(CHUNK):
        chunk = slice(frames.first[start], frames.first[stop])
        s = path[chunk]
        back = reverse(states[frames.before[chunk]], slds.A[s], slds.b[s], slds.Q[s])
        for earlier, now in reversed(steps[start - 1 : stop - 1]):
            smoothed = back[now.start - chunk.start : now.stop - chunk.start].step(states[now])
            states.mean[earlier], states.cov[earlier] = smoothed.mean, smoothed.cov
        lag[chunk] = back.lag(states.cov[chunk])
    return states, lag
