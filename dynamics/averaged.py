"""The Gaussian chain of poses when each frame's switching state is only known on average.

The half of structured variational inference (Pavlović et al. 2000, equations for q(X); Ghahramani and Hinton)
that finds log q(X) = E_q(S) log p(X, S, Y) + const. With w_t(i) = q(s_t = i), <F>_t = sum_i w_t(i) F_i, and
u_t the rows of x_t that are noisy (its pose; at second order the others repeat the last), q(X) is a Markov
chain

    q(u_t | x_{t-1}) = N(Ah_t x_{t-1} + .., H_t^-1),  H_t = <Q^-1>_t + L_t's pose block,
    Ah_t = H_t^-1 (<Q^-1 A>_t - [L_t's cross block, 0]),  q(x_0) = N(.., H_0^-1),  H_0 = <cov0^-1>_0 + L_0,

where L_t is the information of the frames from t on about x_t. With F_t = [Ah_t; I 0] (first order: Ah_t),

    L_{t-1} = C'R^-1 C + sum_i w_t(i) (A_i - Ah_t)' Q_i^-1 (A_i - Ah_t) + F_t' L_t F_t,

squares only, so rounding leaves it semidefinite. The paper's linear system with the same C and R is this
without C'R^-1 C, filtered and smoothed afterwards; with it, moments simply follow forwards,
P_t = F_t P_{t-1} F_t' + H_t^-1. Means are found as steps from a mean that is at hand, so that places far from
the origin cost no digits. A step, with e_i the error of the mean under state i, gives state i

    <log p(u_t | x_{t-1}, s_t = i)> = -1/2 (e_i'Q_i^-1 e_i + tr (A_i - Ah_t)'Q_i^-1 (A_i - Ah_t) P_{t-1}
                                            + tr Q_i^-1 H_t^-1 + log |2 pi Q_i|);

the paper's equation 3 lacks the 1/2. H_t gives the entropy of q(X) too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from dynamics.chain import side_by_side
from dynamics.gaussian import LOG_2PI, Array, Flags, Ints, apply, inverse_root, symmetric, transpose
from dynamics.slds import SLDS


@dataclass(frozen=True)
class System:
    """The constants of an SLDS; white: multiplied by the inverse root of the noise's covariance.

    white (K,d,d) of Q's pose block, white_A (K,d,N), white_b (K,d), log_det (K,) log |2 pi Q|; of the first
    frame white0 (K,N,N), white_mean0 (K,N), log_det0 (K,).
    """

    white: Array
    white_A: Array  # noqa: N815
    white_b: Array
    log_det: Array
    white0: Array
    white_mean0: Array
    log_det0: Array


@dataclass(frozen=True)
class Data:
    """B sequences side by side, T frames of the longest first.

    white_y (T,B,M) and white_C (T,B,M,N): by the measured part of R, zero where nothing was measured
    information (T,B,N,N): C'R^-1 C of what was measured; log_det (T,B): log |2 pi R| of it
    hints (T,B,K): further log likelihood of each switching state
    within (T,B): whether the sequence has this frame
    """

    white_y: Array
    white_C: Array  # noqa: N815
    information: Array
    log_det: Array
    hints: Array
    within: Flags

    def of(self, rows: Ints) -> "Data":
        return Data(*(getattr(self, part.name)[:, rows] for part in fields(self)))


@dataclass(frozen=True)
class Poses:
    """q(X) and what follows from it; values beyond a sequence's end are finite but meaningless.

    mean (T,B,N), cov (T,B,N,N), lag (T-1,B,N,N) Cov(x_{t+1}, x_t)
    told (T,B,K): expected log density of each switching state's step
    value (B,): E log p(Y | X) + H[q(X)]
    """

    mean: Array
    cov: Array
    lag: Array
    told: Array
    value: Array


def averaged(system: System, data: Data, prob: Array, mean: Array) -> Poses:
    """The best q(X) for the switching states' probabilities (T, B, K), stepping from any mean (T, B, N).

    A second-order mean repeats the pose before exactly. The nearer the answer, the less rounding costs.
    """
    Ah, noise, offset, apart, first = _backward(system, data, prob, mean)
    mean, cov, lag = _forward(Ah, noise, offset, first, mean)
    N, K, d = mean.shape[-1], *system.white_b.shape
    error0, errors = _errors(system, mean)
    told = np.empty(prob.shape)
    spread = _traces(system.white0.reshape(K * N, N), cov[0], K)
    told[0] = -0.5 * ((error0**2).sum(-1) + spread + system.log_det0)
    spread = _traces(system.white.reshape(K * d, d), noise, K) + _traces(apart, cov[:-1], K)
    told[1:] = -0.5 * ((errors**2).sum(-1) + spread + system.log_det)
    residual = data.white_y - apply(data.white_C, mean)
    value = -((residual**2).sum(-1) + (data.information * cov).sum((-1, -2)) + data.log_det)
    value[0] += np.linalg.slogdet(cov[0])[1] + N * (1.0 + LOG_2PI)
    value[1:] += np.linalg.slogdet(noise)[1] + d * (1.0 + LOG_2PI)
    return Poses(mean, cov, lag, told, 0.5 * np.where(data.within, value, 0.0).sum(0))


def whitened(slds: SLDS) -> System:
    """The constants of an SLDS. LinAlgError: cov0 or the pose's block of Q is not positive definite;
    ValueError: the state holds more than poses."""
    d, N = len(slds.names), slds.A.shape[-1]
    if slds.drifts:
        raise ValueError(
            f"the state must hold 1 or 2 poses of {d} freedoms and nothing else; it has {N} entries"
        )
    white, log_det = inverse_root(slds.Q[:, :d, :d])
    white0, log_det0 = inverse_root(slds.cov0)
    return System(
        white=white,
        white_A=white @ slds.A[:, :d],
        white_b=apply(white, slds.b[:, :d]),
        log_det=log_det,
        white0=white0,
        white_mean0=apply(white0, slds.mean0),
        log_det0=log_det0,
    )


def beside(slds: SLDS, ys: Sequence[Array], hints: Sequence[Array] | None) -> Data:
    """Sequences (T, M) side by side, NaN where not measured. LinAlgError: R is not positive definite."""
    y, lengths = side_by_side(ys, np.nan)
    T, B, M = y.shape
    seen = ~np.isnan(y)
    patterns, which = np.unique(seen.reshape(T * B, M), axis=0, return_inverse=True)
    which = which.reshape(T, B)
    both = patterns[:, :, None] & patterns[:, None, :]
    white, log_det = inverse_root(np.where(both, slds.R, np.eye(M)))
    white_C = white @ np.where(patterns[:, :, None], slds.C, 0.0)
    more = np.zeros((T, B, slds.K)) if hints is None else side_by_side(hints, 0.0)[0]
    return Data(
        white_y=apply(white[which], np.where(seen, y, 0.0)),
        white_C=white_C[which],
        information=(transpose(white_C) @ white_C)[which],
        log_det=(log_det - (~patterns).sum(-1) * LOG_2PI)[which],
        hints=more,
        within=np.arange(T)[:, None] < lengths,
    )


def _backward(
    system: System, data: Data, prob: Array, mean: Array
) -> tuple[Array, Array, Array, Array, tuple[Array, Array]]:
    """The steps, from the information and information vector of all later frames, the last frame first.

    Ah (T-1,B,d,N), noise H^-1 (T-1,B,d,d), offset (T-1,B,d) of the mean's step, the stacked whitened A_i - Ah
    (T-1,B,K d,N); and of the first frame's mean (B,N,N) and (B,N).
    """
    T, B, N = mean.shape
    K, d = system.white_b.shape
    white, white_A = system.white.reshape(K * d, d), system.white_A.reshape(K * d, N)
    # Beyond a sequence's end all weights are 0, so no information comes back; noise of 1 keeps H regular.
    w = np.where(data.within[1:, :, None], prob[1:], 0.0)
    root_w = np.repeat(np.sqrt(w), d, axis=-1)[..., None]
    precision = _average(w, transpose(system.white) @ system.white)
    precision += np.where(data.within[1:], 0.0, 1.0)[..., None, None] * np.eye(d)
    to_pose = _average(w, transpose(system.white) @ system.white_A)
    error0, errors = _errors(system, mean)
    weighted = (w[..., None] * errors).reshape(T - 1, B, K * d)
    pull_pose, pull_before = weighted @ white, weighted @ white_A
    measured = apply(transpose(data.white_C), data.white_y - apply(data.white_C, mean))

    Ah, noise = np.empty((T - 1, B, d, N)), np.empty((T - 1, B, d, d))
    offset, apart = np.empty((T - 1, B, d)), np.empty((T - 1, B, K * d, N))
    F, right = np.zeros((B, N, N)), np.zeros((B, d, N + d + 1))
    F[:, d:, : N - d] = np.eye(N - d)
    right[:, :, N:-1] = np.eye(d)
    L, pull = data.information[-1], measured[-1]
    for t in range(T - 2, -1, -1):
        pull = np.concatenate([pull[:, :d] - pull_pose[t], pull[:, d:]], axis=1)
        right[:, :, :N] = to_pose[t]
        right[:, :, : N - d] -= L[:, :d, d:]
        right[:, :, -1] = pull[:, :d]
        solved = np.linalg.solve(precision[t] + L[:, :d, :d], right)
        Ah[t], noise[t], offset[t] = solved[:, :, :N], solved[:, :, N:-1], solved[:, :, -1]
        F[:, :d] = Ah[t]
        np.subtract(white_A, white @ Ah[t], out=apart[t])
        square = root_w[t] * apart[t]
        L = data.information[t] + symmetric(transpose(square) @ square + transpose(F) @ (L @ F))
        pull = measured[t] + pull_before[t] + apply(transpose(F), pull)
    L = L + _average(prob[0], transpose(system.white0) @ system.white0)
    pull = pull - (prob[0][:, :, None] * apply(transpose(system.white0), error0)).sum(1)
    return Ah, symmetric(noise), offset, apart, (L, pull)


def _forward(
    Ah: Array, noise: Array, offset: Array, first: tuple[Array, Array], mean: Array
) -> tuple[Array, Array, Array]:
    """Mean, covariance and lag of all frames, from the first on."""
    T, B, N = mean.shape
    d, (information, pull) = noise.shape[-1], first
    step, cov, lag = np.empty((T, B, N)), np.empty((T, B, N, N)), np.empty((T - 1, B, N, N))
    cov[0] = np.linalg.inv(information)
    cov[0] = symmetric(cov[0])
    step[0] = apply(cov[0], pull)
    for t in range(1, T):
        step[t, :, :d] = apply(Ah[t - 1], step[t - 1]) + offset[t - 1]
        step[t, :, d:] = step[t - 1, :, : N - d]
        lag[t - 1, :, :d] = Ah[t - 1] @ cov[t - 1]
        lag[t - 1, :, d:] = cov[t - 1, :, : N - d]
        cov[t, :, :d, :d] = symmetric(lag[t - 1, :, :d] @ transpose(Ah[t - 1])) + noise[t - 1]
        cov[t, :, :, d:] = lag[t - 1, :, :, : N - d]
        cov[t, :, d:, :d] = transpose(lag[t - 1, :, :d, : N - d])
    return mean + step, cov, lag


def _errors(system: System, mean: Array) -> tuple[Array, Array]:
    """Whitened errors of the mean under every switching state: (B,K,N) of the first frame, (T-1,B,K,d)."""
    T, B, N = mean.shape
    K, d = system.white_b.shape
    error0 = apply(system.white0, mean[0][:, None]) - system.white_mean0
    after = mean[1:, :, :d] @ system.white.reshape(K * d, d).T
    before = mean[:-1] @ system.white_A.reshape(K * d, N).T
    return error0, (after - before).reshape(T - 1, B, K, d) - system.white_b


def _traces(roots: Array, cov: Array, K: int) -> Array:
    """(..., K) tr(root cov root'), of K roots in one stack (..., K n, N)."""
    stacked = roots @ cov
    each = (*stacked.shape[:-2], K, stacked.shape[-2] * stacked.shape[-1] // K)
    roots = np.broadcast_to(roots, stacked.shape)
    return np.asarray(np.einsum("...n,...n->...", stacked.reshape(each), roots.reshape(each)))


def _average(w: Array, each: Array) -> Array:
    """(..., K) times (K, n, m) to (..., n, m)."""
    return (w @ each.reshape(len(each), -1)).reshape(*w.shape[:-1], *each.shape[1:])
