"""Generalised pseudo-Bayes of second order (GPB2): filter and smoother with one Gaussian a switching state.

Kim (1994) and Murphy (1998), as in Pavlović et al. (2000), section 3.3; the filter is in
`dynamics.gpb2_filter`. Backwards in t, for the pairs k = s_{t+1}, j = s_t, with P_kj = A_k P_j A_k' + Q_k:

    J_kj    = P_j A_k' P_kj^-1,    x_kj|T = x_j + J_kj (x_k|T - x_kj),
    P_kj|T  = (I - J A_k) P_j (I - J A_k)' + J (Q_k + P_k|T) J',    Cov_kj(x_{t+1}, x_t) = P_k|T J_kj',

a sum of positive semidefinite terms; then the collapse over k. Two assumptions are approximate: that
x_{t+1} does not depend on s_t given s_{t+1} and all frames, and that
Pr(s_t = j | s_{t+1} = k, all frames) is what it is given the frames up to t + 1: the filter's own W_kj,
which cost nothing. The papers weigh by Pi[j, k] Pr(s_t = j | y_0..t), which leaves out y_{t+1} too; Barber
(2006) puts N(x_k|T; x_kj, P_kj) to that, one more factorisation for every pair. Against the sum over all
paths, Pr(s_t) was off by at most two thirds of Barber's error and half of the papers', at any noise.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from dynamics.frames import PAIRS, Frames, in_batches
from dynamics.gaussian import Array, Gaussian, collapse, joint, transpose
from dynamics.gpb2_filter import Step, filter_steps, normalised, run_filter
from dynamics.kalman import reverse
from dynamics.posterior import Posterior, Switching
from dynamics.slds import SLDS

# Of n steps: Pr(s_{t-1} = j, s_t = k) (n, K, K); [x_t; x_{t-1}] given each s_t (n, K);
# Cov(x_t, x_{t-1}) (n, N, N).
Moments = tuple[Array, Gaussian, Array]


def gpb2_all(slds: SLDS, ys: Sequence[Array], hints: Sequence[Array] | None = None) -> list[Posterior]:
    """The approximate posterior over each of several sequences (T, M), T >= 1; NaN entries were not measured.

    `hints`, (T, K) for each sequence, are added to the log likelihoods of the switching states; None adds
    nothing. ValueError if they leave no state possible.
    """

    def infer(frames: Frames) -> list[Posterior]:
        return _smooth(slds, frames, run_filter(slds, frames))

    return in_batches(slds, ys, hints, infer)


def switching_all(slds: SLDS, ys: Sequence[Array], hints: Sequence[Array] | None = None) -> list[Switching]:
    """The switching states alone; arguments and errors as `gpb2_all`.

    Their backward pass needs only the filter's weights, so x is neither kept nor smoothed.
    """

    def infer(frames: Frames) -> list[Switching]:
        rows, K = len(frames.y), slds.K
        prob, log_shares = np.empty((rows, K)), np.empty((rows, K, K))
        for step in filter_steps(slds, frames):
            prob[step.rows], log_shares[step.rows] = np.exp(step.log_prob), step.log_shares
        for earlier, now in frames.back():
            prob[earlier] = (prob[now, None, :] @ np.exp(log_shares[now]))[:, 0]
        return [Switching(prob[r], prob[r].argmax(-1)) for r in frames.sequences()]

    return in_batches(slds, ys, hints, infer)


def _smooth(slds: SLDS, frames: Frames, found: Step) -> list[Posterior]:
    """The posteriors, from the filter's result, which is overwritten by the smoother's."""
    rows, K, N = found.mean.shape
    pair, lag = np.empty((rows, K, K)), np.empty((rows, N, N))
    steps = Gaussian(np.empty((rows, K, 2 * N)), np.empty((rows, K, 2 * N, 2 * N)))
    for r, of_rows in _go_back(slds, frames, found):
        pair[r], steps[r], lag[r] = of_rows
    prob = np.exp(found.log_prob)
    states = collapse(prob, found.states)
    return [
        Posterior(
            prob=prob[r],
            pair=pair[r[1:]],
            states=states[r],
            lag=lag[r[1:]],
            log_evidence=float(found.log_evidence[r].sum()),
            path=prob[r].argmax(-1),
            starts=found.states[r[0]],
            steps=steps[r[1:]],
        )
        for r in frames.sequences()
    ]


def _go_back(slds: SLDS, frames: Frames, found: Step) -> Iterator[tuple[slice, Moments]]:
    """The backward pass, many frames at once; only the recursion itself goes frame by frame.

    `found` is overwritten. The moments of the steps that lead to the rows are given chunk by chunk.
    """
    for rows, back_to in frames.chunks(max(1, PAIRS // slds.K**2)):
        filtered = found.states[frames.before[rows], None]
        back = reverse(filtered, slds.A[:, None], slds.b[:, None], slds.Q[:, None])
        log_W = found.log_shares[rows]
        pairs = Gaussian(np.empty_like(back.rest.cov[..., 0]), np.empty_like(back.rest.cov))
        for earlier, now in back_to:
            here = slice(now.start - rows.start, now.stop - rows.start)
            log_prob, log_shares = normalised(found.log_prob[now, :, None] + log_W[here], axis=1)
            own = pairs[here] = back[here].step(found.states[now, :, None])
            of_each = Gaussian(own.mean.swapaxes(1, 2), own.cov.swapaxes(1, 2))
            found.states[earlier] = collapse(np.exp(log_shares).swapaxes(1, 2), of_each)
            found.log_prob[earlier] = log_prob[:, 0] - np.logaddexp.reduce(log_prob[:, 0], -1)[:, None]
        yield rows, _moments(found, rows, np.exp(log_W), back.gain, pairs)


def _moments(found: Step, rows: slice, W: Array, gain: Array, pairs: Gaussian) -> Moments:
    """The moments of the steps that lead to these rows; W and pairs (rows, K now, K before)."""
    prob, now, then = np.exp(found.log_prob[rows]), found.states[rows], collapse(W, pairs)
    N = now.mean.shape[-1]
    cross = now.cov @ transpose((W[..., None, None] * gain).sum(2))
    both = joint(now, then, cross)
    apart = both.mean - (prob[..., None] * both.mean).sum(1, keepdims=True)
    between = transpose(prob[..., None] * apart[..., :N]) @ apart[..., N:]
    return transpose(prob[..., None] * W), both, (prob[..., None, None] * cross).sum(1) + between
