"""Compiled: what the filters work out for every switching state j before and i now.

The equations are those of `dynamics.viterbi`, `dynamics.gpb2_filter` and `dynamics.kalman`. Arrays of all
pairs p = i K + j have the pair last, so that a processor factors several matrices at once; products are of
rows with rows, a b', whose inner loop runs through memory. Entries of y that are NaN were not measured: S has
unit rows there, C P zero rows.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynamics.compiled import compiled
from dynamics.gaussian import Array
from dynamics.slds import SLDS

System = tuple[Any, ...]  # what `constants` gives
# Of all pairs: G_i P_j (K K, M, N), L of S = L L' (M, M, K K), L^-1 e (M, K K), surprise (K K,), x (K K, N).
Pairs = tuple[Array, Array, Array, Array, Array]

# All in one file: the cache of compiled code does not notice that another has changed.
COMPILED = compiled(error_model="numpy", fastmath={"contract"})
# Where order does not matter, so that a processor adds up several terms at a time.
ANY_ORDER = compiled(error_model="numpy", fastmath={"reassoc", "contract", "nsz"})


def constants(slds: SLDS, C: Array, R: Array) -> System:
    """What is the same at every frame; C and R may leave measurements out.

    How many entries of a state move on, the others being those of the state before, from its first on; A, b,
    Q, C, R; and of every state G = C A, C b, C Q and C Q C' + R.
    """
    A, b, Q, d = slds.A, slds.b, slds.Q, slds.layout.d
    repeats = (A[:, d:] == np.eye(*A[0, d:].shape)).all() and not b[:, d:].any() and not Q[:, d:].any()
    parts = A, b, Q, C, R, C @ A, b @ C.T, C @ Q, C @ Q @ C.T + R
    # Copies can be written to; of arrays that cannot, everything would be compiled once more.
    return d if repeats else len(A[0]), *(np.array(part, order="C") for part in parts)


@COMPILED
def viterbi_rows(
    system: System,
    log_Pi: Array,
    y: Array,
    extra: Array,
    before: NDArray[np.intp],
    found: tuple[Array, Array, Array, NDArray[np.intp]],
) -> None:
    """The best step to each state in all rows of `dynamics.frames.Frames` that have one before them.

    Args:
        extra: (rows, K) further log likelihood.
        before: (rows,) the row a frame earlier; a first frame's is its own.
        found: mean (rows, K, N), cov (rows, K, N, N), cost (rows, K), the state before (rows, K): filled.
    """
    moving, A, b, Q, C, R, _, _, CQ, _ = system
    mean, cov, cost, back = found
    (M, N), K = C.shape, len(b)
    pairs = _room(K, M, N)
    GP, L, e, surprise, _ = pairs
    x, prior, CP = np.empty(N), np.empty((N, N)), np.empty((M, N))
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
            cost[row, i], back[row, i] = least - extra[row, i], best
            _carry(A[i], b[i], mean[r, best], x)
            _predict(moving, A[i], Q[i], cov[r, best], prior)
            _cross(moving, A[i], CQ[i], y[row], GP[i * K + best], CP)
            _condition(C, R, L, e, i * K + best, x, prior, CP, cov[row, i])
            mean[row, i] = x


@COMPILED
def gpb2_rows(
    system: System,
    log_switch: Array,
    y: Array,
    extra: Array,
    before: NDArray[np.intp],
    found: tuple[Array, ...],
) -> None:
    """GPB2 in the rows that have one before them; the others are there already.

    Args:
        log_switch: (1 or rows, K, K) log Pr(s_t = i | s_{t-1} = j), [j, i], one for all or by the row before.
        extra, before: as in `viterbi_rows`; the row before is negative where there is none.
        found: log_prob (rows, K), mean (rows, K, N), cov (rows, K, N, N), log W_ij (rows, K, K), log evidence
            (rows,): filled.
    """
    moving, A, b, _, C, _, _, _, CQ, _ = system
    (M, N), K = C.shape, len(b)
    log_prob, mean, cov, log_shares, log_evidence = found
    pairs, Z = _room(K, M, N), np.empty((K * K, M, N))
    GP, L, e, surprise, x = pairs
    for row in range(len(y)):
        r = before[row]
        if r < 0 or r == row:
            continue
        _innovate(system, mean[r], cov[r], y[row], pairs)
        for i in range(K):
            for j in range(K):
                p = i * K + j
                _carry(A[i], b[i], mean[r, j], x[p])
                _cross(moving, A[i], CQ[i], y[row], GP[p], Z[p])
                _whiten(L, e, p, Z[p], x[p])
                log_shares[row, i, j] = log_switch[r % len(log_switch), j, i] + log_prob[r, j] - surprise[p]
            log_prob[row, i] = extra[row, i] + _normalise(log_shares[row, i])
            _mix(np.exp(log_shares[row, i]), x[i * K :], mean[row, i])
        log_evidence[row] = _normalise(log_prob[row])
        _collapse(system, y[row], cov[r], np.exp(log_shares[row]), pairs, Z, mean[row], cov[row])


@COMPILED
def _room(K: int, M: int, N: int) -> Pairs:
    P = K * K
    return np.empty((P, M, N)), np.zeros((M, M, P)), np.empty((M, P)), np.empty(P), np.empty((P, N))


@ANY_ORDER
def _innovate(system: System, mean: Array, cov: Array, y: Array, pairs: Pairs) -> None:
    """All innovations of a frame, factored, from the states (K, N) before it."""
    G, Cb, noise = system[6], system[7], system[9]
    K, M, N = G.shape
    GP, S, e, surprise, _ = pairs
    GPG = np.empty((M, M))
    for i in range(K):
        for j in range(K):
            p = i * K + j
            _times(G[i], cov[j], GP[p])
            _square(GP[p], G[i], GPG)
            for m in range(M):
                ahead = Cb[i, m]
                for n in range(N):
                    ahead += G[i, m, n] * mean[j, n]
                e[m, p] = y[m] - ahead
                for k in range(m + 1):
                    S[m, k, p] = GPG[m, k] + noise[i, m, k]
    _leave_out(y, S, e)
    _factor(S, e, surprise)


@COMPILED
def _leave_out(y: Array, S: Array, e: Array) -> None:
    for m in range(len(y)):
        if math.isnan(y[m]):
            S[m, :m], S[m, m], S[m + 1 :, m], e[m] = 0.0, 1.0, 0.0, 0.0


@COMPILED
def _factor(S: Array, e: Array, surprise: Array) -> None:
    """Put L of every S = L L' (M, M, P), lower triangles, in its place, L^-1 e (M, P) in that of e, and
    e' S^-1 e / 2 + log |S| / 2 into the surprise (P,)."""
    M, P = e.shape
    surprise[:] = 0.0
    for c in range(M):
        for k in range(c):
            for r in range(c, M):
                for p in range(P):
                    S[r, c, p] -= S[r, k, p] * S[c, k, p]
            for p in range(P):
                e[c, p] -= S[c, k, p] * e[k, p]
        for p in range(P):
            if not S[c, c, p] > 0.0:
                raise np.linalg.LinAlgError("S = C P C' + R is not positive definite")
            surprise[p] += 0.5 * math.log(S[c, c, p])
        for p in range(P):
            S[c, c, p] = math.sqrt(S[c, c, p])
            e[c, p] /= S[c, c, p]
            surprise[p] += 0.5 * e[c, p] ** 2
        for r in range(c + 1, M):
            for p in range(P):
                S[r, c, p] /= S[c, c, p]


@COMPILED
def _normalise(logs: Array) -> float:
    """The log sum of logs (K,), of which the log shares take the place: equal where nothing is possible."""
    most = logs.max()
    if not most > -np.inf:
        logs[:] = -math.log(len(logs))
        return -np.inf
    total: float = most + math.log(np.exp(logs - most).sum())
    logs -= total
    return total


@ANY_ORDER
def _carry(A: Array, b: Array, mean: Array, x: Array) -> None:
    for n in range(len(b)):
        x[n] = b[n]
        for k in range(len(b)):
            x[n] += A[n, k] * mean[k]


@COMPILED
def _predict(moving: int, A: Array, Q: Array, cov: Array, prior: Array) -> None:
    """A P A' + Q."""
    N = len(cov)
    AP = np.empty((moving, N))
    _times(A[:moving], cov, AP)
    _square(AP, A[:moving], prior)
    for n in range(moving):
        for k in range(moving):
            prior[n, k] += Q[n, k]
    for n in range(moving, N):
        for k in range(moving):
            prior[n, k] = prior[k, n] = AP[k, n - moving]
        for k in range(moving, N):
            prior[n, k] = cov[n - moving, k - moving]


@COMPILED
def _whiten(L: Array, e: Array, p: int, Z: Array, x: Array) -> None:
    """From C P (M, N) of pair p to Z = L^-1 C P, and from the predicted mean x to x + Z' L^-1 e."""
    M, N = Z.shape
    for m in range(M):
        for k in range(m):
            for n in range(N):
                Z[m, n] -= L[m, k, p] * Z[k, n]
        scale = 1.0 / L[m, m, p]
        for n in range(N):
            Z[m, n] *= scale
            x[n] += Z[m, n] * e[m, p]


@COMPILED
def _cross(moving: int, A: Array, CQ: Array, y: Array, GP: Array, CP: Array) -> None:
    """C P_ij of a pair from its G_i P_j."""
    _times(GP, A[:moving], CP)
    for m in range(len(CP)):
        for n in range(moving):
            CP[m, n] += CQ[m, n]
        for n in range(moving, len(A)):
            CP[m, n] = GP[m, n - moving]
    _blank(y, CP)


@COMPILED
def _blank(y: Array, CP: Array) -> None:
    for m in range(len(y)):
        if math.isnan(y[m]):
            CP[m] = 0.0


@COMPILED
def _collapse(
    system: System, y: Array, before: Array, W: Array, pairs: Pairs, Z: Array, mean: Array, cov: Array
) -> None:
    """The covariances (K, N, N) of one Gaussian a state, from those `before`.

    W (K, K) are the pairs' weights, Z (K K, M, N) their L^-1 C P, and the mean (K, N) is there.
    """
    moving, A, _, Q, C, R = system[:6]
    (M, N), K = C.shape, len(A)
    prior, CP, S = np.empty((K, N, N)), np.empty((K, M, N)), np.zeros((M, M, K))
    mixed, CPC, e, surprise = np.empty((N, N)), np.empty((M, M)), np.zeros((M, K)), np.empty(K)
    for i in range(K):
        _mix(W[i], before.reshape(K, N * N), mixed.reshape(N * N))
        _predict(moving, A[i], Q[i], mixed, prior[i])
        _times(C, prior[i], CP[i])
        _square(CP[i], C, CPC)
        S[:, :, i] = CPC + R
        _blank(y, CP[i])
    _leave_out(y, S, e)
    _factor(S, e, surprise)
    for i in range(K):
        _condition(C, R, S, e, i, mean[i], prior[i], CP[i], cov[i])
        _spread(W[i], i * K, CP[i], pairs, Z, mean[i], cov[i])


@COMPILED
def _spread(W: Array, first: int, gain_T: Array, pairs: Pairs, Z: Array, mean: Array, cov: Array) -> None:
    """Add the spread of the means x_ij|t, less what the gains differ by: of the pairs from `first` on."""
    _, L, _, _, x = pairs
    M, N = gain_T.shape
    rows = -(-len(W) * (M + 1) // 4) * 4
    apart, weighed = np.zeros((rows, N)), np.zeros((rows, N))
    for j in range(len(W)):
        r = j * (M + 1)
        _part(L, first + j, gain_T, Z[first + j], apart[r : r + M])
        for n in range(N):
            apart[r + M, n] = x[first + j, n] - mean[n]
        for m in range(M + 1):
            weight = W[j] if m == M else -W[j]
            for n in range(N):
                weighed[r + m, n] = weight * apart[r + m, n]
    _add(weighed, apart, cov)


@COMPILED
def _mix(weights: Array, each: Array, mixed: Array) -> None:
    mixed[:] = 0.0
    for j in range(len(weights)):
        for n in range(len(mixed)):
            mixed[n] += weights[j] * each[j, n]


@COMPILED
def _add(a: Array, b: Array, total: Array) -> None:
    """Add a' b, of a multiple of four rows."""
    for r in range(0, len(a), 4):
        for n in range(len(total)):
            a0, a1, a2, a3 = a[r, n], a[r + 1, n], a[r + 2, n], a[r + 3, n]
            for k in range(len(total)):
                total[n, k] += a0 * b[r, k] + a1 * b[r + 1, k] + a2 * b[r + 2, k] + a3 * b[r + 3, k]


@COMPILED
def _part(L: Array, p: int, gain_T: Array, Z: Array, D: Array) -> None:
    """D = L' gain' - Z of pair p, by which its gain differs."""
    M, N = Z.shape
    for m in range(M):
        for n in range(N):
            D[m, n] = L[m, m, p] * gain_T[m, n] - Z[m, n]
        for k in range(m + 1, M):
            for n in range(N):
                D[m, n] += L[k, m, p] * gain_T[k, n]


@COMPILED
def _condition(
    C: Array, R: Array, L: Array, e: Array, p: int, x: Array, prior: Array, Z: Array, cov: Array
) -> None:
    """Update mean x (N,) in its place, and the covariance; Z is C P (M, N) before and the gain' after.

    In Joseph form as `dynamics.kalman.condition`, with P - gain C P = P - Z'Z.
    """
    M, N = C.shape
    gain, D, gain_R, fall = np.empty((N, M)), np.empty((N, M)), np.empty((N, M)), np.empty((N, N))
    _whiten(L, e, p, Z, x)
    gain[:] = Z.T
    _square(gain, gain, fall)
    prior -= fall
    for m in range(M - 1, -1, -1):
        for k in range(m + 1, M):
            for n in range(N):
                Z[m, n] -= L[k, m, p] * Z[k, n]
        scale = 1.0 / L[m, m, p]
        for n in range(N):
            Z[m, n] *= scale
    gain[:] = Z.T
    _times(prior, C, D)
    _times(gain, R, gain_R)
    D -= gain_R
    _square(D, gain, fall)
    for n in range(N):
        for k in range(N):
            cov[n, k] = prior[n, k] - fall[n, k]


@ANY_ORDER
def _times(a: Array, b: Array, product: Array) -> None:
    """a b'."""
    for r in range(len(a)):
        for c in range(len(b)):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[r, k] * b[c, k]
            product[r, c] = total


@ANY_ORDER
def _square(a: Array, b: Array, product: Array) -> None:
    """a b' where that is symmetric."""
    for r in range(len(a)):
        for c in range(r + 1):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[r, k] * b[c, k]
            product[r, c] = product[c, r] = total
