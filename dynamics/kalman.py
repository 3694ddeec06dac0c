"""Predict, update, smooth: the only Kalman equations in the house, batched over leading axes.

Särkkä, Bayesian Filtering and Smoothing (2013), theorems 4.2 and 8.2, with an affine offset b.
"""

import numpy as np

from dynamics.gaussian import LOG_2PI, Array, Gaussian, apply, symmetric, transpose


def predict(prior: Gaussian, A: Array, b: Array, Q: Array) -> Gaussian:
    """The belief one frame on, x' = A x + b + v, v ~ N(0, Q); 1999 paper, equations 3 and 4."""
    return Gaussian(apply(A, prior.mean) + b, symmetric(A @ prior.cov @ transpose(A) + Q))


def innovation(prior: Gaussian, y: Array, C: Array, R: Array) -> tuple[Array, Array, Array, Array]:
    """What a measurement y = C x + w says beyond the prior; entries of y that are NaN were not measured.

    Args:
        prior: mean (..., N), cov (..., N, N).
        y: (..., M), NaN where missing.
        C: (..., M, N).
        R: (..., M, M).

    Returns:
        e (..., M), zero where missing; C and S = C P C' + R with missing rows cut off (zero rows of C, unit
        rows of S); R likewise.
    """
    seen = ~np.isnan(y)
    if not seen.all():
        both = seen[..., :, None] & seen[..., None, :]
        C = np.where(seen[..., None], C, 0.0)
        R = np.where(both, R, np.eye(y.shape[-1]))
    e = np.where(seen, np.nan_to_num(y) - apply(C, prior.mean), 0.0)
    return e, C, symmetric(C @ prior.cov @ transpose(C) + R), R


def log_likelihood(e: Array, S: Array, seen: Array) -> Array:
    """log N(e; 0, S) in nats over the entries that were measured; `seen` (...,) counts them."""
    root = np.linalg.cholesky(S)
    white = np.linalg.solve(root, e[..., None])[..., 0]
    log_det = 2.0 * np.log(np.diagonal(root, axis1=-2, axis2=-1)).sum(-1)
    density: Array = -0.5 * ((white**2).sum(-1) + log_det + seen * LOG_2PI)
    return density


def update(prior: Gaussian, y: Array, C: Array, R: Array) -> tuple[Gaussian, Array]:
    """Condition on one linear measurement, y = C x + w, w ~ N(0, R); NaN entries were not measured.

    The covariance is in Joseph form, which rounding does not turn indefinite.

    Returns:
        The posterior over x, and log N(y; C mean, S) in nats.

    Raises:
        numpy.linalg.LinAlgError: S is not positive definite.
    """
    e, C, S, R = innovation(prior, y, C, R)
    gain = transpose(np.linalg.solve(S, C @ prior.cov))
    I_gC = np.eye(prior.mean.shape[-1]) - gain @ C
    cov = I_gC @ prior.cov @ transpose(I_gC) + gain @ R @ transpose(gain)
    posterior = Gaussian(prior.mean + apply(gain, e), symmetric(cov))
    return posterior, log_likelihood(e, S, (~np.isnan(y)).sum(-1))


def update_information(prior: Gaussian, C: Array, information: Array, vector: Array) -> Gaussian:
    """Condition on a likelihood exp(-q'Lq / 2 + h'q) of q = C x, where L may be singular.

    The same posterior as `update` with R = L^-1 and y = L^-1 h where those exist: L = F F', so the
    measurement is F'q with unit noise, and directions that L does not see measure nothing.

    Args:
        prior: belief over x, mean (N,), cov (N, N).
        C: (M, N).
        information: (M, M) L, positive semidefinite.
        vector: (M,) h, in the range of L.
    """
    strength, axes = np.linalg.eigh(symmetric(information))
    told = strength > 1e-12 * max(float(strength[-1]), 1e-300)
    if not told.any():
        return prior
    factor = axes[:, told] * np.sqrt(strength[told])
    y = (axes[:, told].T @ vector) / np.sqrt(strength[told])
    return update(prior, y, factor.T @ C, np.eye(len(y)))[0]


def smooth(filtered: Gaussian, later: Gaussian, A: Array, b: Array, Q: Array) -> tuple[Gaussian, Array]:
    """Rauch-Tung-Striebel: the belief at t given all frames, from the one at t + 1.

    In the form that is a sum of positive semidefinite terms. The predicted covariance of a companion state
    may be singular to rounding; its diagonal is then raised by 1e-12 of its size.

    Args:
        filtered: belief at t given the frames up to t.
        later: belief at t + 1 given all frames.

    Returns:
        The belief at t given all frames, and Cov(x_{t+1}, x_t) (..., N, N).
    """
    predicted = predict(filtered, A, b, Q)
    size = np.diagonal(predicted.cov, axis1=-2, axis2=-1)
    P = predicted.cov + 1e-12 * np.eye(size.shape[-1]) * size[..., None, :]
    gain = transpose(np.linalg.solve(P, A @ filtered.cov))
    I_gA = np.eye(size.shape[-1]) - gain @ A
    mean = filtered.mean + apply(gain, later.mean - predicted.mean)
    cov = I_gA @ filtered.cov @ transpose(I_gA) + gain @ (Q + later.cov) @ transpose(gain)
    return Gaussian(mean, symmetric(cov)), later.cov @ transpose(gain)
