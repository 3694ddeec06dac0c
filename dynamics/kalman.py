"""Predict, update, smooth: the only Kalman equations in numpy, batched over leading axes.

Särkkä, Bayesian Filtering and Smoothing (2013), theorems 4.2 and 8.2, with an affine offset b.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dynamics.gaussian import LOG_2PI, Array, Gaussian, apply, symmetric, transpose

CORNER = 1e300  # corner of a bordered covariance: larger than any squared distance, otherwise without effect


def predict(prior: Gaussian, A: Array, b: Array, Q: Array) -> Gaussian:
    """The belief one frame on, x' = A x + b + v, v ~ N(0, Q); 1999 paper, equations 3 and 4."""
    return Gaussian(apply(A, prior.mean) + b, symmetric(A @ prior.cov @ transpose(A) + Q))


def innovation(prior: Gaussian, y: Array, C: Array, R: Array) -> tuple[Array, Array, Array, Array]:
    """The innovation of a measurement y = C x + w; entries of y (..., M) that are NaN were not measured.

    C is (..., M, N) and R (..., M, M). Gives e (..., M), zero where missing; C and S = C P C' + R with
    missing rows disabled (zero rows of C, unit rows of S); R likewise.
    """
    missing = np.isnan(y)
    if missing.any():
        either = missing[..., :, None] | missing[..., None, :]
        y = np.where(missing, 0.0, y)
        C = np.where(missing[..., None], 0.0, C)
        R = np.where(either, np.eye(y.shape[-1]), R)
    return y - apply(C, prior.mean), C, symmetric(C @ prior.cov @ transpose(C) + R), R


def log_likelihood(e: Array, S: Array, seen: Array) -> Array:
    """log N(e; 0, S) in nats over the entries that were measured; `seen` (...,) counts them. LinAlgError: S
    is not positive definite.

    The Cholesky factor of [[S, e], [e', CORNER]] holds that of S, L, and below it (L^-1 e)': one
    factorisation gives both terms.
    """
    M = e.shape[-1]
    bordered = np.full((*np.broadcast_shapes(e.shape[:-1], S.shape[:-2]), M + 1, M + 1), CORNER)
    bordered[..., :M, :M], bordered[..., M, :M] = S, e
    root = np.linalg.cholesky(bordered)
    diagonal = root.diagonal(axis1=-2, axis2=-1)[..., :-1]
    surprise = (0.5 * root[..., -1, :-1] ** 2 + np.log(diagonal)).sum(-1)
    density: Array = -surprise - 0.5 * LOG_2PI * seen
    return density


def update(prior: Gaussian, y: Array, C: Array, R: Array) -> tuple[Gaussian, Array]:
    """Condition on one linear measurement, y = C x + w, w ~ N(0, R); NaN entries were not measured.

    Gives the posterior over x and log N(y; C mean, S) in nats. LinAlgError: S is not positive definite.

    The covariance is in Joseph form, (I - gain C) P (I - gain C)' + gain R gain', which rounding does not
    turn indefinite; its left factor is multiplied out first, which takes the fewest products.
    """
    e, C, S, R = innovation(prior, y, C, R)
    cross = C @ prior.cov
    gain_T = np.linalg.solve(S, cross)
    gain = transpose(gain_T)
    left = prior.cov - gain @ cross
    cov = left - (left @ transpose(C) - gain @ R) @ gain_T
    posterior = Gaussian(prior.mean + apply(gain, e), symmetric(cov))
    return posterior, log_likelihood(e, S, (~np.isnan(y)).sum(-1))


def update_information(prior: Gaussian, C: Array, information: Array, vector: Array) -> Gaussian:
    """Condition on a likelihood exp(-q'Lq / 2 + h'q) of q = C x, C (M, N); L (..., M, M) may be singular, h
    (..., M) lies in its range.

    The same posterior as `update` with R = L^-1 and y = L^-1 h where those exist; directions in the
    null space of L are not measured. With S = C P C' and W = (I + S L)^-1 C P, the mean moves by W' (h - L C
    mean) and the covariance is (I - W' L C) P (I - W' L C)' + W' L W.
    """
    L, cross = symmetric(information), C @ prior.cov
    S = cross @ transpose(C)
    gain = transpose(np.linalg.solve(np.eye(S.shape[-1]) + S @ L, cross))
    back = gain @ L
    left = prior.cov - back @ cross
    cov = left - (left @ transpose(C) - gain) @ transpose(back)
    surprising = vector - apply(L, apply(C, prior.mean))
    return Gaussian(prior.mean + apply(gain, surprising), symmetric(cov))


def smooth(filtered: Gaussian, later: Gaussian, A: Array, b: Array, Q: Array) -> tuple[Gaussian, Array]:
    """Rauch-Tung-Striebel: the belief at t given all frames, from that given the frames up to t and the later
    one at t + 1; and Cov(x_{t+1}, x_t) (..., N, N)."""
    back = reverse(filtered, A, b, Q)
    return back.step(later), back.lag(later.cov)


@dataclass(frozen=True)
class Reverse:
    """The dynamics from t + 1 back to t, given the frames up to t.

    x_t = rest.mean + gain (x_{t+1} - ahead) + u, u ~ N(0, rest.cov), which depends on no later frame, so all
    frames can be processed at once.

    rest  : mean (..., N), cov (..., N, N)
    gain  : (..., N, N)
    ahead : (..., N) mean of x_{t+1} given the frames up to t
    """

    rest: Gaussian
    gain: Array
    ahead: Array

    def __getitem__(self, index: Any) -> "Reverse":
        return Reverse(self.rest[index], self.gain[index], self.ahead[index])

    def step(self, later: Gaussian) -> Gaussian:
        """The belief at t given all frames, from the one at t + 1."""
        mean = self.rest.mean + apply(self.gain, later.mean - self.ahead)
        return Gaussian(mean, symmetric(self.rest.cov + self.gain @ later.cov @ transpose(self.gain)))

    def lag(self, later: Array) -> Array:
        """Cov(x_{t+1}, x_t) given all frames, from Cov(x_{t+1}) given them."""
        return np.asarray(later @ transpose(self.gain))


def reverse(filtered: Gaussian, A: Array, b: Array, Q: Array) -> Reverse:
    """The reverse dynamics to t, from the belief at t given the frames up to t.

    The covariance is computed as a sum of positive semidefinite terms. The predicted covariance of a
    companion state may be singular to rounding; its diagonal is then raised by 1e-12 of its size.
    """
    predicted = predict(filtered, A, b, Q)
    size = np.diagonal(predicted.cov, axis1=-2, axis2=-1)
    P = predicted.cov + 1e-12 * np.eye(size.shape[-1]) * size[..., None, :]
    gain = transpose(np.linalg.solve(P, A @ filtered.cov))
    I_gA = np.eye(size.shape[-1]) - gain @ A
    cov = I_gA @ filtered.cov @ transpose(I_gA) + gain @ Q @ transpose(gain)
    return Reverse(Gaussian(filtered.mean, cov), gain, predicted.mean)
