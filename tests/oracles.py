"""Slow, obvious twins of the fast code, written from the definitions and sharing no algebra with it.

The state path of a linear system with known switching states is one big Gaussian; conditioning it on the
measurements is the Kalman filter and smoother at once, and a sum over all K**T switching paths is the
exact posterior of a switching system.
"""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from scipy.stats import multivariate_normal

from dynamics.gaussian import Array, Gaussian
from dynamics.posterior import Posterior
from dynamics.slds import SLDS


def central_difference(f: Callable[[Array], Array | float], x: Array, step: float) -> Array:
    """The derivative of f at x, one column per entry of x."""
    x = np.asarray(x, dtype=float)
    columns = []
    for i in np.ndindex(x.shape):
        up, down = x.copy(), x.copy()
        up[i] += step
        down[i] -= step
        columns.append((np.asarray(f(up)) - np.asarray(f(down))) / (2.0 * step))
    return np.stack(columns, axis=-1)


def random_covariance(N: int, rng: np.random.Generator) -> Array:
    """A covariance with eigenvalues from about 0.1 to a few."""
    root = rng.normal(size=(N, N))
    return root @ root.T / N + 0.1 * np.eye(N)


def random_slds(
    K: int,
    *,
    rng: np.random.Generator,
    d: int = 2,
    order: int = 1,
    travelling: Sequence[str] = (),
    noise: float = 0.3,
    stay: float = 0.7,
) -> SLDS:
    """A switching system of d freedoms "a", "b", ...; stable but for the travelling ones."""
    N = order * d
    names = tuple("abcdefghijklmnop"[:d])
    moves = np.flatnonzero([name in travelling for name in names])
    A, Q = np.zeros((K, N, N)), np.zeros((K, N, N))
    for k in range(K):
        now, before = _oscillators(d, order, rng)
        # The dynamics see a travelling freedom by its change only, and carry its place over.
        now[:, moves] = 0.3 * now[:, moves] if order == 2 else 0.0
        before[:, moves] = -now[:, moves]
        now[moves, moves] += 1.0
        A[k, :d, :d] = now
        if order == 2:
            A[k, :d, d:] = before
            A[k, d:, :d] = np.eye(d)
        Q[k, :d, :d] = noise**2 * random_covariance(d, rng)
    Pi = stay * np.eye(K) + (1.0 - stay) * rng.dirichlet(np.ones(K), size=K)
    return SLDS(
        pi0=rng.dirichlet(np.full(K, 5.0)),
        Pi=Pi / Pi.sum(1, keepdims=True),
        A=A,
        b=np.hstack([0.3 * rng.normal(size=(K, d)), np.zeros((K, N - d))]),
        Q=Q,
        C=np.eye(d, N),
        R=noise**2 * random_covariance(d, rng),
        mean0=rng.normal(size=(K, N)),
        cov0=np.stack([random_covariance(N, rng) for _ in range(K)]),
        names=names,
        travelling=tuple(travelling),
        labels=("random",) * K,
        fps=30.0,
    )


def _oscillators(d: int, order: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Coefficients of the last pose and of the one before; damped, mixed by a random basis."""
    basis = np.linalg.qr(rng.normal(size=(d, d)))[0] * rng.uniform(0.7, 1.4, size=d)
    radius, turn = rng.uniform(0.7, 0.95, size=d), rng.uniform(0.2, 1.5, size=d)
    if order == 1:
        return basis @ np.diag(radius * np.cos(turn)) @ np.linalg.inv(basis), np.zeros((d, d))
    now, before = np.diag(2.0 * radius * np.cos(turn)), np.diag(-(radius**2))
    return basis @ now @ np.linalg.inv(basis), basis @ before @ np.linalg.inv(basis)


def condition(mean: Array, cov: Array, H: Array, noise: Array, y: Array) -> tuple[Array, Array, float]:
    """Moments of x given y = H x + w, w ~ N(0, noise), by the joint Gaussian of x and y; and log p(y).

    Entries of y that are NaN are left out.
    """
    seen = ~np.isnan(y)
    if not seen.any():
        return mean, cov, 0.0
    H, noise, y = H[seen], noise[np.ix_(seen, seen)], y[seen]
    cross = cov @ H.T
    S = H @ cross + noise
    S = 0.5 * (S + S.T)
    gain = cross @ np.linalg.inv(S)
    log_p = multivariate_normal(H @ mean, S).logpdf(y)
    return mean + gain @ (y - H @ mean), cov - gain @ cross.T, float(log_p)


def given_path(slds: SLDS, y: Array, path: Sequence[int]) -> tuple[Array, Array, float]:
    """Mean (T, N) and cov (T, N, T, N) of all states given y and the switching path; log p(y, path)."""
    T, N, M = len(y), slds.A.shape[-1], len(slds.C)
    mean, cov = np.zeros((T, N)), np.zeros((T, N, T, N))
    mean[0], cov[0, :, 0] = slds.mean0[path[0]], slds.cov0[path[0]]
    log_p = np.log(slds.pi0[path[0]]) if slds.pi0[path[0]] > 0 else -np.inf
    for t in range(1, T):
        s = path[t]
        log_p += np.log(slds.Pi[path[t - 1], s]) if slds.Pi[path[t - 1], s] > 0 else -np.inf
        A = slds.A[s]
        mean[t] = A @ mean[t - 1] + slds.b[s]
        for r in range(t):
            cov[t, :, r] = A @ cov[t - 1, :, r]
            cov[r, :, t] = cov[t, :, r].T
        cov[t, :, t] = A @ cov[t - 1, :, t - 1] @ A.T + slds.Q[s]
    H, noise = np.kron(np.eye(T), slds.C), np.kron(np.eye(T), slds.R)
    x, P, log_lik = condition(mean.ravel(), cov.reshape(T * N, T * N), H, noise, y.reshape(T * M))
    return x.reshape(T, N), P.reshape(T, N, T, N), log_p + log_lik


def sum_over_paths(slds: SLDS, y: Array) -> float:
    """log p(y) exactly."""
    return float(np.logaddexp.reduce([log_p for _, log_p in all_paths(slds, y)]))


def all_paths(slds: SLDS, y: Array) -> list[tuple[tuple[int, ...], float]]:
    """Every switching path with log p(y, path)."""
    return [(path, given_path(slds, y, path)[2]) for path in product(range(slds.K), repeat=len(y))]


def enumerated(slds: SLDS, y: Array) -> Posterior:
    """The exact posterior, by a sum over all paths."""
    T, K, N = len(y), slds.K, slds.A.shape[-1]
    paths = list(product(range(K), repeat=T))
    given = [given_path(slds, y, path) for path in paths]
    log_p = np.array([log_joint for _, _, log_joint in given])
    log_evidence = float(np.logaddexp.reduce(log_p))
    weights = np.exp(log_p - log_evidence)
    prob, pair = np.zeros((T, K)), np.zeros((T - 1, K, K))
    for path, w in zip(paths, weights, strict=True):
        for t in range(T):
            prob[t, path[t]] += w
        for t in range(T - 1):
            pair[t, path[t], path[t + 1]] += w

    def moments(pick: Callable[[tuple[int, ...]], bool], ts: list[int]) -> tuple[Array, Array]:
        """Of [x_t for t in ts] over the paths that are picked."""
        n = len(ts) * N
        total, first, second = 0.0, np.zeros(n), np.zeros((n, n))
        for path, w, (mean, cov, _) in zip(paths, weights, given, strict=True):
            if pick(path) and w > 0:
                m, P = mean[ts].ravel(), cov[ts][:, :, ts].reshape(n, n)
                total += w
                first += w * m
                second += w * (P + np.outer(m, m))
        if total == 0.0:  # a state that cannot be has no moments; any will do
            return first, np.eye(n)
        m = first / total
        return m, second / total - np.outer(m, m)

    states = [moments(lambda path: True, [t]) for t in range(T)]
    both = [moments(lambda path: True, [t + 1, t]) for t in range(T - 1)]
    starts = [moments(lambda path, k=k: path[0] == k, [0]) for k in range(K)]
    steps = [
        [moments(lambda path, t=t, k=k: path[t + 1] == k, [t + 1, t]) for k in range(K)] for t in range(T - 1)
    ]
    return Posterior(
        prob=prob,
        pair=pair,
        states=Gaussian(np.stack([m for m, _ in states]), np.stack([P for _, P in states])),
        lag=np.stack([P[:N, N:] for _, P in both]) if both else np.zeros((0, N, N)),
        log_evidence=log_evidence,
        path=np.array(paths[int(log_p.argmax())]),
        starts=Gaussian(np.stack([m for m, _ in starts]), np.stack([P for _, P in starts])),
        steps=Gaussian(
            np.array([[m for m, _ in row] for row in steps]).reshape(T - 1, K, 2 * N),
            np.array([[P for _, P in row] for row in steps]).reshape(T - 1, K, 2 * N, 2 * N),
        ),
    )


def single(infer: Callable[..., list[Posterior]]) -> Callable[..., Posterior]:
    """An inference, of one sequence."""

    def of_one(slds: SLDS, y: Array, hints: Array | None = None, **options: object) -> Posterior:
        return infer(slds, [y], None if hints is None else [hints], **options)[0]

    return of_one


def enumerated_all(slds: SLDS, ys: Sequence[Array]) -> list[Posterior]:
    """The exact posterior of each sequence."""
    return [enumerated(slds, y) for y in ys]


def expected_log_joint(
    slds: SLDS, ys: Sequence[Array], posteriors: Sequence[Posterior], weights: Array
) -> float:
    """E log p(X, S, Y) under the posteriors, term by term; given the past, only the pose is random."""
    d = len(slds.names)
    total = 0.0
    for y, p, w in zip(ys, posteriors, weights, strict=True):
        start, steps = p.start_moments(), p.step_moments()
        for k in range(slds.K):
            at = k if len(start.mean) > 1 else 0
            density = _expected_log_density(start.mean[at] - slds.mean0[k], start.cov[at], slds.cov0[k])
            total += w * p.prob[0, k] * (np.log(slds.pi0[k]) + density)
            residual = np.hstack([np.eye(slds.A.shape[-1]), -slds.A[k]])[:d]
            for t in range(len(y) - 1):
                at = k if steps.mean.shape[1] > 1 else 0
                e = residual @ steps.mean[t, at] - slds.b[k, :d]
                spread = residual @ steps.cov[t, at] @ residual.T
                total += w * p.prob[t + 1, k] * _expected_log_density(e, spread, slds.Q[k, :d, :d])
        total += w * float((p.pair.sum(0) * np.log(slds.Pi)).sum())
        for t in range(len(y)):
            e = y[t] - slds.C @ p.states.mean[t]
            total += w * _expected_log_density(e, slds.C @ p.states.cov[t] @ slds.C.T, slds.R)
    return float(total)


def _expected_log_density(mean: Array, cov: Array, noise: Array) -> float:
    """E log N(e; 0, noise) of e with these moments."""
    spread = np.trace(np.linalg.inv(noise) @ cov)
    return float(multivariate_normal(np.zeros(len(mean)), noise).logpdf(mean) - 0.5 * spread)
