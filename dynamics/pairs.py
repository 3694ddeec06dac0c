"""Compiled: the filters' computations for every pair of switching states, j before and i now.

The equations are those of `dynamics.viterbi`, `dynamics.gpb2_filter` and `dynamics.kalman`. Arrays of all
pairs p = i K + j have the pair last, so that a processor factors several matrices at once; products are of
rows with rows, a b', whose inner loop runs through memory. Entries of y that are NaN were not measured: S has
unit rows there, C P zero rows.
"""

import math
from typing import Any

import numpy as np

from dynamics.compiled import compiled, part
from dynamics.gaussian import Array, Ints
from dynamics.slds import SLDS

System = tuple[Array, ...]  # result of `constants`
Pairs = tuple[Array, Array, Array, Array]  # see `_room`
Found = tuple[Any, ...]

# All in one file: numba's cache does not notice changes in other files.
COMPILED = compiled(error_model="numpy", fastmath={"contract"})
PART = part(error_model="numpy", fastmath={"contract"})
# Sums may be reordered, so that a processor adds several terms at a time.
ANY_ORDER = part(error_model="numpy", fastmath={"reassoc", "contract", "nsz"})


def constants(slds: SLDS, C: Array, R: Array) -> System:
    """A, b, Q, C, R, and for every state G = C A, C b, C Q, C Q C' + R; C and R may omit measurements."""
    A, b, Q = slds.A, slds.b, slds.Q
    parts = A, b, Q, C, R, C @ A, b @ C.T, C @ Q, C @ Q @ C.T + R
    # Copies are writable; for read-only arrays numba would compile everything a second time.
    return tuple(np.array(part, order="C") for part in parts)


@COMPILED
def viterbi_rows(system: System, log_Pi: Array, y: Array, extra: Array, before: Ints, found: Found) -> None:
    """The best step to each state in all rows of `dynamics.frames.Frames` that have one before them.

    Args:
        extra: (rows, K) further log likelihood.
        before: (rows,) the row a frame earlier; a first frame's is its own.
        found: mean (rows, K, N), cov (rows, K, N, N), cost (rows, K), the state before (rows, K): filled.
    """
    A, b, Q, C, R, _, _, CQ, _ = system
    mean, cov, cost, back = found
    (M, N), K = C.shape, len(b)
    pairs, Z = _room(K, M, N), np.empty((M, N))
    GP, L, surprise, _ = pairs
    for row in range(len(y)):
        r = before[row]
        if r == row:
            continue
        _innovate(system, mean[r], cov[r], y[row], pairs)
        for i in range(K):
            best, least = 0, np.inf
            for j in range(K):
                total = cost[r, j] - log_Pi[j, i] + surprise[i * K + j]
                if total < least:
                    best, least = j, total
            p = i * K + best
            cost[row, i], back[row, i] = least - extra[row, i], best
            _step(A[i], b[i], mean[r, best], mean[row, i])
            _predict(A[i], Q[i], cov[r, best], cov[row, i])
            _whiten(A[i], CQ[i], y[row], L, p, GP[p], Z, mean[row, i])
            _condition(C, R, L, p, Z, cov[row, i])


@COMPILED
def gpb2_rows(system: System, log_switch: Array, y: Array, extra: Array, before: Ints, found: Found) -> None:
    """GPB2 in the rows that have one before them; the others are already filled.

    Args:
        log_switch: (1 or rows, K, K) log Pr(s_t = i | s_{t-1} = j), [j, i], one for all or by the row before.
        extra, before: as in `viterbi_rows`; the row before is negative where there is none.
        found: log_prob (rows, K), mean (rows, K, N), cov (rows, K, N, N), log W_ij (rows, K, K), log evidence
            (rows,): filled.
    """
    A, b, _, C, _, _, _, CQ, _ = system
    log_prob, mean, cov, log_shares, log_evidence = found
    (M, N), K = C.shape, len(b)
    pairs, Z, W = _room(K, M, N), np.empty((K * K, M, N)), np.empty((K, K))
    GP, L, surprise, x = pairs
    for row in range(len(y)):
        r = before[row]
        if r < 0 or r == row:
            continue
        _innovate(system, mean[r], cov[r], y[row], pairs)
        for i in range(K):
            for j in range(K):
                p = i * K + j
                _step(A[i], b[i], mean[r, j], x[p])
                _whiten(A[i], CQ[i], y[row], L, p, GP[p], Z[p], x[p])
                log_shares[row, i, j] = log_switch[r % len(log_switch), j, i] + log_prob[r, j] - surprise[p]
            log_prob[row, i] = extra[row, i] + _normalise(log_shares[row, i])
            for j in range(K):
                W[i, j] = math.exp(log_shares[row, i, j])
            _mix(W[i], x[i * K : i * K + K], mean[row, i])
        log_evidence[row] = _normalise(log_prob[row])
        _collapse(system, y[row], cov[r], W, pairs, Z, mean[row], cov[row])


@PART
def _room(K: int, M: int, N: int) -> Pairs:
    """Buffers for all pairs: G_i P_j, L of S = L L' with (L^-1 e)' below, surprise, mean of x_t."""
    P = K * K
    return np.empty((P, M, N)), np.zeros((M + 1, M, P)), np.empty(P), np.empty((P, N))


@ANY_ORDER
def _innovate(system: System, mean: Array, cov: Array, y: Array, pairs: Pairs) -> None:
    """The factored innovations of all pairs in a frame, from the states (K, N) before it."""
    _, _, _, _, _, G, Cb, _, noise = system
    K, M, N = G.shape
    GP, S, surprise, _ = pairs
    for i in range(K):
        for j in range(K):
            p = i * K + j
            _foresee(G[i], noise[i], cov[j], GP[p], S, p)
            for m in range(M):
                ahead = Cb[i, m]
                for n in range(N):
                    ahead += G[i, m, n] * mean[j, n]
                S[M, m, p] = y[m] - ahead
    _factor(y, S, surprise)


@ANY_ORDER
def _foresee(G: Array, noise: Array, cov: Array, GP: Array, S: Array, p: int) -> None:
    """Compute G P and S of pair p."""
    _times(G, cov, GP)
    M, N = G.shape
    for m in range(M):
        for k in range(m + 1):
            total = noise[m, k]
            for n in range(N):
                total += GP[m, n] * G[k, n]
            S[m, k, p] = total


@PART
def _factor(y: Array, S: Array, surprise: Array) -> None:
    """Factor every [S; e'] (M + 1, M, P) in place: S = L L' becomes L (lower triangle), e' becomes (L^-1 e)'.

    The surprise (P,) is e' S^-1 e / 2 + log |S| / 2.
    """
    _, M, P = S.shape
    for p in range(P):
        surprise[p] = 0.0
    for c in range(M):
        if math.isnan(y[c]):
            for p in range(P):
                for k in range(c):
                    S[c, k, p] = 0.0
                S[c, c, p] = 1.0
                for r in range(c + 1, M + 1):
                    S[r, c, p] = 0.0
        for k in range(c):
            for r in range(c, M + 1):
                for p in range(P):
                    S[r, c, p] -= S[r, k, p] * S[c, k, p]
        for p in range(P):
            if not S[c, c, p] > 0.0:
                raise np.linalg.LinAlgError("S = C P C' + R is not positive definite")
            surprise[p] += 0.5 * math.log(S[c, c, p])
        for p in range(P):
            S[c, c, p] = math.sqrt(S[c, c, p])
        for r in range(c + 1, M + 1):
            for p in range(P):
                S[r, c, p] /= S[c, c, p]
        for p in range(P):
            surprise[p] += 0.5 * S[M, c, p] ** 2


@PART
def _normalise(logs: Array) -> float:
    """The log sum of logs (K,), which are replaced by their log shares: equal where all are impossible."""
    most, total = -np.inf, 0.0
    for k in range(len(logs)):
        most = max(most, logs[k])
    if not most > -np.inf:
        for k in range(len(logs)):
            logs[k] = -math.log(len(logs))
        return -np.inf
    for k in range(len(logs)):
        total += math.exp(logs[k] - most)
    total = most + math.log(total)
    for k in range(len(logs)):
        logs[k] -= total
    return total


@PART
def _predict(A: Array, Q: Array, cov: Array, prior: Array) -> None:
    AP = np.empty_like(cov)
    _times(A, cov, AP)
    _times(AP, A, prior)
    _plus(Q, prior)


@PART
def _whiten(A: Array, CQ: Array, y: Array, L: Array, p: int, GP: Array, Z: Array, x: Array) -> None:
    """Z = L^-1 C P (M, N) of pair p, C P = (G P) A' + C Q; the predicted mean x becomes x + Z' L^-1 e."""
    M, N = Z.shape
    _times(GP, A, Z)
    _plus(CQ, Z)
    for m in range(M):
        if math.isnan(y[m]):
            for n in range(N):
                Z[m, n] = 0.0
        for k in range(m):
            for n in range(N):
                Z[m, n] -= L[m, k, p] * Z[k, n]
        scale = 1.0 / L[m, m, p]
        for n in range(N):
            Z[m, n] *= scale
            x[n] += Z[m, n] * L[M, m, p]


@PART
def _condition(C: Array, R: Array, L: Array, p: int, Z: Array, cov: Array) -> None:
    """Update the covariance by a measurement, in place; Z = L^-1 C P (M, N) becomes the transposed gain.

    In Joseph form as `dynamics.kalman.update`, with P - gain C P = P - Z'Z.
    """
    M, N = Z.shape
    D = np.empty((M, N))
    _add(-1.0, Z, Z, cov)
    for m in range(M - 1, -1, -1):
        for k in range(m + 1, M):
            for n in range(N):
                Z[m, n] -= L[k, m, p] * Z[k, n]
        scale = 1.0 / L[m, m, p]
        for n in range(N):
            Z[m, n] *= scale
    _times(C, cov, D)
    _add(-1.0, R, Z, D)
    _add(-1.0, D, Z, cov)
    _mirror(cov)


@PART
def _collapse(
    system: System, y: Array, before: Array, W: Array, pairs: Pairs, Z: Array, mean: Array, cov: Array
) -> None:
    """The covariances (K, N, N) after the collapse to one Gaussian a state, from those `before`.

    W (K, K) are the pairs' weights, Z (K K, M, N) their L^-1 C P; the mean (K, N) is collapsed already.
    """
    A, _, Q, C, R, G, _, CQ, noise = system
    GP, L, surprise, x = pairs
    (M, N), K = C.shape, len(A)
    S, mixed, gain_T, D = np.zeros((M + 1, M, K)), np.empty((N, N)), np.empty((M, N)), np.empty((M + 1, N))
    for i in range(K):
        _mix(W[i], before.reshape(K, -1), mixed.reshape(-1))
        _predict(A[i], Q[i], mixed, cov[i])
        _foresee(G[i], noise[i], mixed, GP[i], S, i)
    _factor(y, S, surprise[:K])
    for i in range(K):
        _whiten(A[i], CQ[i], y, S, i, GP[i], gain_T, mean[i])
        _condition(C, R, S, i, gain_T, cov[i])
        for j in range(K):
            p = i * K + j
            _part(L, p, gain_T, Z[p], D[:M])
            _add(-W[i, j], D[:M], D[:M], cov[i])
            for n in range(N):
                D[M, n] = x[p, n] - mean[i, n]
            _add(W[i, j], D[M:], D[M:], cov[i])
        _mirror(cov[i])


@PART
def _part(L: Array, p: int, gain_T: Array, Z: Array, D: Array) -> None:
    """D = L' gain' - Z of pair p, the difference of its gain from the common one."""
    M, N = Z.shape
    for m in range(M):
        for n in range(N):
            D[m, n] = L[m, m, p] * gain_T[m, n] - Z[m, n]
        for k in range(m + 1, M):
            for n in range(N):
                D[m, n] += L[k, m, p] * gain_T[k, n]


@PART
def _mix(weights: Array, each: Array, mixed: Array) -> None:
    for n in range(len(mixed)):
        mixed[n] = 0.0
    _add(1.0, weights.reshape(-1, 1), each, mixed.reshape(1, -1))


@PART
def _mirror(cov: Array) -> None:
    for n in range(len(cov)):
        for k in range(n):
            cov[n, k] = cov[k, n] = 0.5 * (cov[n, k] + cov[k, n])


@PART
def _add(factor: float, a: Array, b: Array, total: Array) -> None:
    """Add factor a' b to the total, four rows at a time, which takes a fourth of the loads and stores."""
    whole = len(a) // 4 * 4
    for n in range(len(total)):
        for r in range(0, whole, 4):
            a0, a1, a2, a3 = a[r, n], a[r + 1, n], a[r + 2, n], a[r + 3, n]
            for k in range(total.shape[1]):
                sum_of_four = a0 * b[r, k] + a1 * b[r + 1, k] + a2 * b[r + 2, k] + a3 * b[r + 3, k]
                total[n, k] += factor * sum_of_four
        for r in range(whole, len(a)):
            for k in range(total.shape[1]):
                total[n, k] += factor * a[r, n] * b[r, k]


@PART
def _plus(more: Array, total: Array) -> None:
    for r in range(len(total)):
        for c in range(total.shape[1]):
            total[r, c] += more[r, c]


@ANY_ORDER
def _step(A: Array, b: Array, x: Array, ahead: Array) -> None:
    """Write A x + b into `ahead`."""
    for r in range(len(A)):
        total = 0.0
        for k in range(len(x)):
            total += A[r, k] * x[k]
        ahead[r] = total + b[r]


@ANY_ORDER
def _times(a: Array, b: Array, product: Array) -> None:
    """Write a b' into `product`."""
    for r in range(len(a)):
        for c in range(len(b)):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[r, k] * b[c, k]
            product[r, c] = total
