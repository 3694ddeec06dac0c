"""The GPB2 filter: one Gaussian a switching state, collapsed over the state before.

Pavlović et al. (2000), section 3.3 (generalised pseudo-Bayes of second order), read with these corrections:
the first frame is updated like any other, the collapse over predecessors comes after all of them are known,
and it counts the spread of their means. Here j is the state before, i the state now.

For every pair l_ij = log N(e_ij; 0, S_ij) + log Pi[j, i] + log Pr(s_{t-1} = j | past), and the weights
W_ij = Pr(s_{t-1} = j | s_t = i, y_0..t) are the softmax of l_ij over j, never a ratio of probabilities that
may have underflowed. The collapse needs few N x N products. With G_i = C A_i,

    C P_ij = (G_i P_j) A_i' + C Q_i,    S_ij = (G_i P_j) G_i' + C Q_i C' + R = L L',
    Z_ij = L^-1 C P_ij,    x_ij|t = x_ij + Z_ij' L^-1 e_ij,    P_ij|t = P_ij - Z_ij' Z_ij.

Summed like this, P_ij|t cancels to nothing where R is small beside P. Joseph's form holds for any gain g:
P_ij|t = (I - gC) P_ij (I - gC)' + g R g' - (g - g_ij) S_ij (g - g_ij)', where g_ij = Z_ij' L^-1. So, with
P_i = sum_j W_ij P_ij = A_i (sum_j W_ij P_j) A_i' + Q_i, S_i = sum_j W_ij S_ij and g = P_i C' S_i^-1,

    sum_j W_ij P_ij|t = (I - gC) P_i (I - gC)' + g R g' - sum_j W_ij D_ij' D_ij,    D_ij = L' g' - Z_ij,

which takes away only what the gains differ by: least of all g for this one, nothing for one state.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynamics.frames import Frames, in_batches
from dynamics.gaussian import LOG_2PI, Array, Gaussian, inverse_triangular, symmetric, transpose
from dynamics.kalman import update
from dynamics.slds import SLDS

Switch = Callable[[Array], Array]  # (n, K, N) states given each s_{t-1} to (n, K, K) log Pr(s_t | s_{t-1})


class Step(NamedTuple):
    """The filter in n rows of `dynamics.frames.Frames`: one frame of the sequences still running, or all.

    log_prob     : (n, K) log Pr(s_t | y_0..t)
    states       : (n, K) x_t given each s_t
    log_shares   : (n, K, K) log W_ij, W_ij = Pr(s_{t-1} = j | s_t = i, y_0..t); 0 at the first frame
    log_evidence : (n,) log p(y_t | y_0..t-1)
    """

    rows: slice
    log_prob: Array
    states: Gaussian
    log_shares: Array
    log_evidence: Array


def gpb2_filter(slds: SLDS, y: Array) -> Step:
    """The filter alone over one sequence (T, M); errors as `gpb2_all`."""
    return in_batches(slds, [y], None, lambda frames: [run_filter(slds, frames)])[0]


def run_filter(slds: SLDS, frames: Frames) -> Step:
    """The filter over all rows, which are kept; ValueError where no switching state is possible."""
    rows, K, N = len(frames.y), slds.K, slds.A.shape[-1]
    states = Gaussian(np.empty((rows, K, N)), np.empty((rows, K, N, N)))
    whole = Step(slice(0, rows), np.empty((rows, K)), states, np.empty((rows, K, K)), np.empty(rows))
    for step in filter_steps(slds, frames):
        now = step.rows
        states.mean[now], states.cov[now] = step.states.mean, step.states.cov
        whole.log_prob[now], whole.log_shares[now] = step.log_prob, step.log_shares
        whole.log_evidence[now] = step.log_evidence
    return whole


def filter_steps(slds: SLDS, frames: Frames, switch: Switch | None = None) -> Iterator[Step]:
    """The filter frame by frame, with Pi or a switch that depends on the state before; ValueError where no
    switching state is possible."""
    first = frames.first.tolist()
    rows = _measured(frames)
    C, R, y = slds.C[rows], slds.R[np.ix_(rows, rows)], frames.y[:, rows]
    transitions = _transitions(slds, C, R)
    seen = ~np.isnan(y)
    whole = np.logical_and.reduceat(seen.all(-1), first[:-1]).tolist()
    further = frames.hints - 0.5 * LOG_2PI * seen.sum(-1)[:, None]
    step: Step | None = None
    for t in range(len(first) - 1):
        now = slice(first[t], first[t + 1])
        if step is None:
            found, log_lik = update(slds.start, y[now, None], C, R)
            belief = Gaussian(found.mean, np.broadcast_to(found.cov, (*found.mean.shape, slds.A.shape[-1])))
            log_joint = slds.log_pi0 + log_lik + frames.hints[now]
            before_each = np.zeros((len(log_joint), slds.K, slds.K))
            y = np.where(seen, y, 0.0)
        else:
            n = now.stop - now.start
            before = step.states[:n]
            pairs = _innovate(transitions, before, y[now], None if whole[t] else seen[now])
            log_switch = transitions.log_switch if switch is None else switch(before.mean).transpose(2, 0, 1)
            logs = pairs.log_lik + (log_switch + step.log_prob[:n])
            log_sum, log_shares = normalised(logs, axis=-1)
            log_joint = log_sum[..., 0].T + further[now]
            belief = _collapsed(transitions, before, pairs, np.exp(log_shares))
            before_each = log_shares.swapaxes(0, 1)
        log_evidence = np.logaddexp.reduce(log_joint, axis=-1)
        if not -np.inf < log_evidence.min():
            raise ValueError(f"no switching state is possible at frame {t}; see pi0, Pi, y and hints")
        step = Step(now, log_joint - log_evidence[:, None], belief, before_each, log_evidence)
        yield step


def _measured(frames: Frames) -> NDArray[np.bool_]:
    """(M,) the measurements that any row has; one at least. The others would only cost time."""
    measured = np.asarray(np.isfinite(frames.y).any(0))
    measured[0] |= not measured.any()
    return measured


class _Transitions(NamedTuple):
    """What the filter needs of the system at every frame, with the state now first.

    C, R  : of the rows that are measured
    G     : (K M, N) the rows of every C A_i
    right : (K, N, N+1+M) [A_i', 0, G_i'], takes [G_i P_j; x_j'] to [C P_ij, 0, S_ij; x_ij', 0, (C x_ij)']
    fixed : (K, 1, M+1, N+1+M) what that lacks of noise and offset
    log_switch : (K, 1, K) log Pi[j, i]
    A_t   : (K, N, N) A_i'
    sign  : (M+1, 1) -1 for what the gains differ by, 1 for what the means differ by
    """

    slds: SLDS
    C: Array
    R: Array
    G: Array
    right: Array
    fixed: Array
    log_switch: Array
    A_t: Array
    sign: Array


def _transitions(slds: SLDS, C: Array, R: Array) -> _Transitions:
    (M, N), K = C.shape, slds.K
    G = C @ slds.A
    fixed = np.zeros((K, 1, M + 1, N + 1 + M))
    fixed[:, 0, :M, :N] = C @ slds.Q
    fixed[:, 0, :M, N + 1 :] = C @ slds.Q @ C.T + R
    fixed[:, 0, M, :N] = slds.b
    fixed[:, 0, M, N + 1 :] = slds.b @ C.T
    A_t = np.ascontiguousarray(transpose(slds.A))
    right = np.concatenate([A_t, np.zeros((K, N, 1)), transpose(G)], axis=-1)
    sign = np.append(-np.ones(M), 1.0)[:, None]
    log_switch = np.ascontiguousarray(slds.log_Pi.T[:, None])
    return _Transitions(slds, C, R, G.reshape(K * M, N), right, fixed, log_switch, A_t, sign)


class _Pairs(NamedTuple):
    """Innovations of n sequences, leading axes (K now, n, K before).

    joint   : (..., M+1, N+1+M) [C P_ij, e, S_ij; x_ij|t', -, -], zero and unit rows where not measured
    root    : (..., M, M) L of S_ij = L L'
    white   : (..., M, N+1) L^-1 [C P_ij, e]
    log_lik : (...) log N(e; 0, S_ij) but for the powers of 2 pi
    """

    joint: Array
    root: NDArray[np.floating[Any]]
    white: Array
    log_lik: Array


def _innovate(
    transitions: _Transitions, states: Gaussian, y: Array, seen: NDArray[np.bool_] | None
) -> _Pairs:
    n, K, N = states.mean.shape
    M = y.shape[-1]
    left = np.empty((K, n, K, M + 1, N))
    left[..., :M, :] = (transitions.G @ states.cov).reshape(n, K, K, M, N).transpose(2, 0, 1, 3, 4)
    left[..., M, :] = states.mean
    joint = (left.reshape(K, -1, N) @ transitions.right).reshape(K, n * K, M + 1, -1)
    joint += transitions.fixed
    joint = joint.reshape(K, n, K, M + 1, -1)
    np.subtract(y[:, None], joint[..., M, N + 1 :], out=joint[..., :M, N])
    if seen is not None:
        both = (seen[:, :, None] & seen[:, None, :])[:, None]
        joint[..., :M, N + 1 :] = np.where(both, joint[..., :M, N + 1 :], np.eye(M))
        joint[..., :M, : N + 1] *= seen[:, None, :, None]
    root = np.linalg.cholesky(joint[..., :M, N + 1 :])
    white = inverse_triangular(root) @ joint[..., :M, : N + 1]
    told = (white[..., N:].swapaxes(-1, -2) @ white)[..., 0, :]  # what x_ij learns, and e' S^-1 e
    half_log_det = np.add.reduce(np.log(root.diagonal(axis1=-2, axis2=-1)), -1)
    mean = joint[..., M, :N]
    mean += told[..., :N]
    log_lik = -0.5 * told[..., N] - half_log_det
    return _Pairs(joint, root, white, log_lik)


def _collapsed(transitions: _Transitions, states: Gaussian, pairs: _Pairs, W: Array) -> Gaussian:
    """x_t given each s_t, leading axes (n, K); weights W (K now, n, K before)."""
    slds = transitions.slds
    K, n, _, M1, _ = pairs.joint.shape
    M, N = M1 - 1, states.mean.shape[-1]
    mixed = (W[..., None, :] @ pairs.joint.reshape(K, n, K, -1)).reshape(K, n, M1, -1)
    CP, S, mean = mixed[..., :M, :N], mixed[..., :M, N + 1 :], mixed[..., M, :N]
    gain_t = np.linalg.solve(S, CP)
    P = (W.transpose(1, 0, 2) @ states.cov.reshape(n, K, -1)).reshape(n, K, N, N)
    P = (slds.A @ P @ transitions.A_t + slds.Q).transpose(1, 0, 2, 3)

    # One product gives the spread of the means less what the gains differ by.
    apart = np.empty((K, n, K, M1, N))
    L_t = pairs.root.swapaxes(-1, -2)
    np.subtract(L_t @ gain_t[:, :, None], pairs.white[..., :N], out=apart[..., :M, :])
    np.subtract(pairs.joint[..., M, :N], mean[:, :, None], out=apart[..., M, :])
    weighed = (W[..., None, None] * transitions.sign) * apart
    cov = weighed.reshape(K, n, -1, N).swapaxes(-1, -2) @ apart.reshape(K, n, -1, N)

    gain = gain_t.swapaxes(-1, -2)
    left = P - gain @ CP
    cov += left - (left @ transitions.C.T - gain @ transitions.R) @ gain_t
    return Gaussian(mean.transpose(1, 0, 2), symmetric(cov).transpose(1, 0, 2, 3))


def normalised(logs: Array, axis: int) -> tuple[Array, Array]:
    """The log sum along an axis, which stays, and the log shares in it: equal where nothing is possible."""
    total = np.logaddexp.reduce(logs, axis=axis, keepdims=True)
    if total.min() > -np.inf:
        return total, logs - total
    never = np.isneginf(total)
    equal = -np.log(logs.shape[axis])
    return total, np.where(never, equal, logs - np.where(never, 0.0, total))
