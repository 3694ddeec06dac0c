"""Approximate Viterbi: the best switching path, then smoothing along it.

Pavlović et al. (1999), equations 2 to 12, read with these corrections: the cost of a transition is minus the
log of the innovation's likelihood (equation 6, constants kept, so that -J is a log-likelihood), covariances
are those at time t, and J_0 is the same with the first frame's prior. Of every state only the best
predecessor is kept, so the path may differ from the exact best one; its cost is the exact -log p(Y, S*).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array, Gaussian, apply, transpose
from dynamics.kalman import log_likelihood, predict, smooth, update
from dynamics.posterior import Posterior
from dynamics.slds import SLDS

BATCH = 64  # sequences filtered at a time: beyond this the stacks leave the cache and nothing is gained


def viterbi(slds: SLDS, y: Array) -> Posterior:
    """The best path through one sequence y (T, M); NaN entries were not measured."""
    return viterbi_all(slds, [y])[0]


def viterbi_all(slds: SLDS, ys: Sequence[Array]) -> list[Posterior]:
    """The best path through each of several sequences; their lengths T >= 1 may differ, NaN: not measured."""
    order = np.argsort([len(y) for y in ys], kind="stable")
    posteriors: dict[int, Posterior] = {}
    for first in range(0, len(ys), BATCH):
        chosen = order[first : first + BATCH]
        for n, posterior in zip(chosen, _batch(slds, [ys[n] for n in chosen]), strict=True):
            posteriors[int(n)] = posterior
    return [posteriors[n] for n in range(len(ys))]


@dataclass
class _Forward:
    """Filtered beliefs (T, B, K), back-pointers (T, B, K) and final costs (B, K)."""

    beliefs: list[Gaussian]
    back: NDArray[np.intp]
    cost: Array


def _batch(slds: SLDS, ys: Sequence[Array]) -> list[Posterior]:
    lengths = np.array([len(y) for y in ys])
    padded = np.full((len(ys), lengths.max(), len(slds.names)), np.nan)
    for row, y in zip(padded, ys, strict=True):
        row[: len(y)] = y
    forward = _filter(slds, padded, lengths)
    path = _backtrace(forward, lengths)
    states, lag = _smooth(slds, forward.beliefs, path, lengths)
    posteriors = []
    for n, T in enumerate(lengths):
        s = path[n, :T]
        prob = np.eye(slds.K)[s]
        posteriors.append(
            Posterior(
                prob=prob,
                pair=prob[:-1, :, None] * prob[1:, None, :],
                states=Gaussian(states.mean[n, :T], states.cov[n, :T]),
                lag=lag[n, : T - 1],
                log_evidence=-float(forward.cost[n].min()),
                path=s,
            )
        )
    return posteriors


def _filter(slds: SLDS, y: Array, lengths: NDArray[np.intp]) -> _Forward:
    B, T, _ = y.shape
    K = slds.K
    shape = (B, K, slds.A.shape[-1])
    start = Gaussian(np.broadcast_to(slds.mean0, shape), np.broadcast_to(slds.cov0, (*shape, shape[-1])))
    belief, log_lik = update(start, y[:, 0, None], slds.C, slds.R)
    cost = -slds.log_pi0 - log_lik
    beliefs, back = [belief], np.zeros((T, B, K), dtype=np.intp)
    back[:] = np.arange(K)
    for t in range(1, T):
        alive = t < lengths
        total = _transition_costs(slds, belief, cost, y[:, t])
        best = total.argmin(-1)
        best = np.where(np.isfinite(total.min(-1)), best, np.arange(K))
        chosen = belief[np.arange(B)[:, None], best]
        updated, _ = update(predict(chosen, slds.A, slds.b, slds.Q), y[:, t, None], slds.C, slds.R)
        belief = Gaussian(
            np.where(alive[:, None, None], updated.mean, belief.mean),
            np.where(alive[:, None, None, None], updated.cov, belief.cov),
        )
        cost = np.where(alive[:, None], total.min(-1), cost)
        back[t] = np.where(alive[:, None], best, back[t])
        beliefs.append(belief)
    return _Forward(beliefs, back, cost)


def _transition_costs(slds: SLDS, belief: Gaussian, cost: Array, y: Array) -> Array:
    """(B, K, K) cost of being in state i now, from state j before: equation 6 on top of the partial cost.

    Only the innovation is needed to choose: e = y - G x_j - C b_i and S = G P_j G' + C Q_i C' + R, G = C A_i.
    """
    G = slds.C @ slds.A
    W = slds.C @ slds.Q @ transpose(slds.C) + slds.R
    seen = ~np.isnan(y)
    predicted = apply(G[:, None], belief.mean[:, None]) + apply(slds.C, slds.b)[:, None]
    e = np.where(seen[:, None, None], np.nan_to_num(y)[:, None, None] - predicted, 0.0)
    S = G[:, None] @ belief.cov[:, None] @ transpose(G[:, None]) + W[:, None]
    if not seen.all():
        both = seen[:, :, None] & seen[:, None, :]
        S = np.where(both[:, None, None], S, np.eye(y.shape[-1]))
    total: Array = cost[:, None] - slds.log_Pi.T - log_likelihood(e, S, seen.sum(-1)[:, None, None])
    return total


def _backtrace(forward: _Forward, lengths: NDArray[np.intp]) -> NDArray[np.intp]:
    T, B, _ = forward.back.shape
    path = np.empty((B, T), dtype=np.intp)
    path[:, -1] = forward.cost.argmin(-1)
    for t in range(T - 1, 0, -1):
        path[:, t - 1] = forward.back[t, np.arange(B), path[:, t]]
    return path


def _smooth(
    slds: SLDS, beliefs: list[Gaussian], path: NDArray[np.intp], lengths: NDArray[np.intp]
) -> tuple[Gaussian, Array]:
    """RTS along each path: mean (B, T, N), cov (B, T, N, N) and lag covariances (B, T-1, N, N)."""
    B, T = path.shape
    rows = np.arange(B)
    later = beliefs[-1][rows, path[:, -1]]
    means, covs, lags = [later.mean], [later.cov], []
    for t in range(T - 2, -1, -1):
        filtered, s = beliefs[t][rows, path[:, t]], path[:, t + 1]
        smoothed, lag = smooth(filtered, later, slds.A[s], slds.b[s], slds.Q[s])
        ended = t + 1 >= lengths
        later = Gaussian(
            np.where(ended[:, None], filtered.mean, smoothed.mean),
            np.where(ended[:, None, None], filtered.cov, smoothed.cov),
        )
        means.append(later.mean)
        covs.append(later.cov)
        lags.append(lag)
    N = slds.A.shape[-1]
    stacked = np.stack(lags[::-1], axis=1) if lags else np.zeros((B, 0, N, N))
    return Gaussian(np.stack(means[::-1], axis=1), np.stack(covs[::-1], axis=1)), stacked
