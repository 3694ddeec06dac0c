"""Slow, obvious twins of the fast code, written from the definitions and sharing no algebra with it.

The state path of a linear system with known switching states is one big Gaussian; conditioning it on the
measurements is the Kalman filter and smoother at once, and a sum over all K**T switching paths is the
exact posterior of a switching system.
"""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from dynamics.gaussian import Array, Gaussian, apply
from dynamics.posterior import Posterior
from dynamics.slds import SLDS

# The smoother raises the predicted covariance by 1e-12 of its size, and its inverse may be 1e3 larger.
SMOOTHED = 1e-9


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


def log_density(y: Array, mean: Array, cov: Array) -> Array:
    """log N(y; mean, cov) of each of a batch of Gaussians."""
    apart = np.asarray(y - mean)
    distance = (apart * np.linalg.solve(cov, apart[..., None])[..., 0]).sum(-1)
    return -0.5 * (distance + np.linalg.slogdet(cov)[1] + apart.shape[-1] * np.log(2.0 * np.pi))


def condition(mean: Array, cov: Array, H: Array, noise: Array, y: Array) -> tuple[Array, Array, Array]:
    """Moments of x given y = H x + w, w ~ N(0, noise), by the joint Gaussian of x and y; and log p(y).

    Of each of a batch of Gaussians. Entries of y that are NaN are left out.
    """
    seen = ~np.isnan(y)
    if not seen.any():
        return mean, cov, np.zeros(mean.shape[:-1])
    H, noise, y = H[seen], noise[np.ix_(seen, seen)], y[seen]
    cross = cov @ H.T
    S = H @ cross + noise
    S = 0.5 * (S + np.swapaxes(S, -1, -2))
    gain = cross @ np.linalg.inv(S)
    posterior = mean + (gain @ (y - mean @ H.T)[..., None])[..., 0]
    return posterior, cov - gain @ np.swapaxes(cross, -1, -2), log_density(y, mean @ H.T, S)


def given_path(slds: SLDS, y: Array, paths: Sequence[int] | Array) -> tuple[Array, Array, Array]:
    """Mean (..., T, N) and cov (..., T, N, T, N) of all states given y and a path or many; log p(y, path)."""
    T, N, M = len(y), slds.A.shape[-1], len(slds.C)
    paths = np.asarray(paths)
    mean, cov = np.zeros((*paths.shape, N)), np.zeros((*paths.shape, N, T, N))
    first = paths[..., 0]
    mean[..., 0, :], cov[..., 0, :, 0, :] = slds.mean0[first], slds.cov0[first]
    log_p = slds.log_pi0[first]
    for t in range(1, T):
        s, A = paths[..., t], slds.A[paths[..., t]]
        log_p = log_p + slds.log_Pi[paths[..., t - 1], s]
        mean[..., t, :] = (A @ mean[..., t - 1, :, None])[..., 0] + slds.b[s]
        for r in range(t):
            cov[..., t, :, r, :] = A @ cov[..., t - 1, :, r, :]
            cov[..., r, :, t, :] = np.swapaxes(cov[..., t, :, r, :], -1, -2)
        cov[..., t, :, t, :] = A @ cov[..., t - 1, :, t - 1, :] @ np.swapaxes(A, -1, -2) + slds.Q[s]
    H, noise = np.kron(np.eye(T), slds.C), np.kron(np.eye(T), slds.R)
    flat = cov.reshape(*paths.shape[:-1], T * N, T * N)
    x, P, log_lik = condition(mean.reshape(*paths.shape[:-1], T * N), flat, H, noise, y.reshape(T * M))
    return x.reshape(mean.shape), P.reshape(cov.shape), log_p + log_lik


def assert_gaussian(got: Gaussian, want: Gaussian, *, atol: float) -> None:
    """Mean and covariance are as wanted."""
    assert_allclose(got.mean, want.mean, atol=atol)
    assert_allclose(got.cov, want.cov, atol=atol)


def assert_same(one: Posterior, other: Posterior, *, atol: float = SMOOTHED, rel: float = 1e-9) -> None:
    """Two posteriors hold the same numbers."""
    assert one.log_evidence == pytest.approx(other.log_evidence, rel=rel, abs=rel)
    assert_array_equal(one.path, other.path)
    for name in ("prob", "pair", "lag"):
        assert_allclose(getattr(one, name), getattr(other, name), atol=atol, err_msg=name)
    assert_gaussian(one.states, other.states, atol=atol)
    assert_gaussian(one.start_moments(), other.start_moments(), atol=atol)
    assert_gaussian(one.step_moments(), other.step_moments(), atol=atol)


def assert_given_path(got: Posterior, slds: SLDS, y: Array, path: Sequence[int] | Array) -> None:
    """The states and the evidence are those of the joint Gaussian given one path."""
    mean, cov, log_p = given_path(slds, y, path)
    assert got.log_evidence == pytest.approx(log_p, rel=1e-11, abs=1e-11)
    alone = np.stack([cov[t, :, t] for t in range(len(y))])
    assert_gaussian(got.states, Gaussian(mean, alone), atol=SMOOTHED)
    assert got.lag.shape == (len(y) - 1, *cov.shape[1::2])
    for t in range(len(y) - 1):
        assert_allclose(got.lag[t], cov[t + 1, :, t], atol=SMOOTHED)


def every_path(K: int, T: int) -> Array:
    """(K**T, T) all switching paths."""
    return np.array(list(product(range(K), repeat=T)))


def sum_over_paths(slds: SLDS, y: Array) -> float:
    """log p(y) exactly."""
    return float(np.logaddexp.reduce(all_paths(slds, y)[1]))


def all_paths(slds: SLDS, y: Array) -> tuple[Array, Array]:
    """Every switching path (K**T, T), and log p(y, path) of each."""
    paths = every_path(slds.K, len(y))
    return paths, given_path(slds, y, paths)[2]


def mixed(weights: Array, mean: Array, cov: Array) -> Gaussian:
    """Moments of mixtures: weights (P, T, K) of P Gaussians (P, T, n) make Gaussians (T, K, n).

    A state that cannot be has no moments; any will do.
    """
    total = weights.sum(0)
    weights = weights / np.where(total > 0, total, 1.0)
    first = np.einsum("ptk,ptn->tkn", weights, mean)
    square = np.einsum("ptk,ptnm->tknm", weights, cov + mean[..., None] * mean[..., None, :])
    spread = square - first[..., None] * first[..., None, :]
    return Gaussian(first, np.where(total[..., None, None] > 0, spread, np.eye(mean.shape[-1])))


def mixture(weights: Array, means: Sequence[Array], covs: Sequence[Array]) -> Gaussian:
    """The moments of a mixture, by its raw second moments."""
    mean = sum(w * m for w, m in zip(weights, means, strict=True))
    square = sum(w * (V + np.outer(m, m)) for w, m, V in zip(weights, means, covs, strict=True))
    return Gaussian(mean, square - np.outer(mean, mean))


def enumerated(slds: SLDS, y: Array, hints: Array | None = None) -> Posterior:
    """The exact posterior, by a sum over all paths; hints (T, K) are log likelihoods of the states."""
    T, K, N = len(y), slds.K, slds.A.shape[-1]
    paths = every_path(K, T)
    mean, cov, log_p = given_path(slds, y, paths)
    if hints is not None:
        log_p = log_p + hints[np.arange(T), paths].sum(1)
    log_evidence = float(np.logaddexp.reduce(log_p))
    weights = np.exp(log_p - log_evidence)[:, None, None]
    visits = weights * (paths[..., None] == np.arange(K))
    alone = np.stack([cov[:, t, :, t] for t in range(T)], axis=1)
    states = mixed(np.repeat(weights, T, axis=1), mean, alone)
    starts = mixed(visits[:, :1], mean[:, :1], alone[:, :1])
    # A step is [x_t+1, x_t], as the frames stand in reverse order.
    step = np.concatenate([mean[:, 1:], mean[:, :-1]], axis=-1)
    spread = np.zeros((len(paths), T - 1, 2 * N, 2 * N))
    for t in range(T - 1):
        spread[:, t] = cov[:, [t + 1, t]][:, :, :, [t + 1, t]].reshape(-1, 2 * N, 2 * N)
    both = mixed(np.repeat(weights, T - 1, axis=1), step, spread)
    return Posterior(
        prob=visits.sum(0),
        pair=np.einsum("pti,ptj->tij", visits[:, :-1], visits[:, 1:] > 0),
        states=Gaussian(states.mean[:, 0], states.cov[:, 0]),
        lag=both.cov[:, 0, :N, N:],
        log_evidence=log_evidence,
        path=paths[int(log_p.argmax())],
        starts=Gaussian(starts.mean[0], starts.cov[0]),
        steps=mixed(visits[:, 1:], step, spread),
    )


def sample(slds: SLDS, T: int, rng: np.random.Generator) -> tuple[NDArray[np.intp], Array, Array]:
    """Draw switching states (T,), states (T, N) and measurements (T, M)."""
    N = slds.A.shape[-1]
    s, x = np.empty(T, dtype=np.intp), np.empty((T, N))
    for t in range(T):
        s[t] = rng.choice(slds.K, p=slds.pi0 if t == 0 else slds.Pi[s[t - 1]])
        mean, cov = (slds.mean0, slds.cov0) if t == 0 else (slds.b, slds.Q)
        x[t] = rng.multivariate_normal(mean[s[t]], cov[s[t]], method="svd", check_valid="ignore")
        if t > 0:
            x[t] += slds.A[s[t]] @ x[t - 1]
    w = rng.multivariate_normal(np.zeros(len(slds.C)), slds.R, T, method="svd", check_valid="ignore")
    return s, x, apply(slds.C, x) + w


def drawn(slds: SLDS, T: int, rng: np.random.Generator, *, gaps: bool = False) -> Array:
    """Poses (T, M) of a system; with gaps three in ten entries were not measured."""
    y = sample(slds, T, rng)[2]
    if gaps:
        y[rng.random(y.shape) < 0.3] = np.nan
    return y


def single(infer: Callable[..., list[Posterior]]) -> Callable[..., Posterior]:
    """An inference, of one sequence."""

    def of_one(slds: SLDS, y: Array, hints: Array | None = None, **options: object) -> Posterior:
        return infer(slds, [y], None if hints is None else [hints], **options)[0]

    return of_one


def enumerated_all(slds: SLDS, ys: Sequence[Array], hints: Sequence[Array] | None = None) -> list[Posterior]:
    """The exact posterior of each sequence."""
    return [enumerated(slds, *of_one) for of_one in zip(ys, hints or [None] * len(ys), strict=True)]


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
            seen = ~np.isnan(y[t])
            C, R = slds.C[seen], slds.R[np.ix_(seen, seen)]
            e = y[t, seen] - C @ p.states.mean[t]
            total += w * _expected_log_density(e, C @ p.states.cov[t] @ C.T, R)
    return float(total)


def _expected_log_density(mean: Array, cov: Array, noise: Array) -> float:
    """E log N(e; 0, noise) of e with these moments."""
    spread = np.trace(np.linalg.inv(noise) @ cov)
    return float(log_density(mean, np.zeros(len(mean)), noise) - 0.5 * spread)
