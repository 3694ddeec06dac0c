"""The priors of learning, scaled from the data so that units do not matter.

Inverse-Wishart on Q, on R and on the first frame's covariance, Dirichlet on Pi and pi0, and a ridge of the
regression towards constant velocity (matrix-normal given Q).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array
from dynamics.layout import Layout
from dynamics.learning.options import Options
from dynamics.learning.regression import Ridge
from dynamics.slds import SLDS

STILL = 1e-10  # least variance, for freedoms that never move: (1e-5 leg lengths or radians) squared


@dataclass(frozen=True)
class Prior:
    """Priors scaled from the data; see `data_prior`.

    ridge : of the regression
    R     : (M,) diagonal of the inverse-Wishart scale of R, and its count
    start : (N,) diagonal of the inverse-Wishart scale of the first frame's covariance
    alpha : Dirichlet counts added to every transition, and `sticky` more to those from a state to itself
    """

    ridge: Ridge
    R: Array
    R_count: float
    start: Array
    start_count: float
    alpha: float
    sticky: float


def data_prior(ys: Sequence[Array], layout: Layout, options: Options) -> Prior:
    """Priors scaled from the spread of the poses; all zero at strength 0."""
    d, N = layout.d, layout.N
    spread, change = changes(ys, 0), changes(ys, layout.order)
    speed = (np.concatenate([np.diff(y, axis=0) for y in ys]) ** 2).mean(axis=0)
    x = np.concatenate(ys if layout.order == 1 else [np.hstack([y[1:], y[:-1]]) for y in ys])
    size = ((x @ layout.regard.T) ** 2).mean(axis=0)
    regressors = np.append(np.where(size > 0, size, 1.0), 1.0)
    frames = sum(len(y) for y in ys)
    strength = options.prior * options.ridge * regressors * frames / (4.0 * options.states)
    # A travelling freedom starts near its first place, however far it goes.
    places = np.where(layout.travels, np.minimum(spread, speed + STILL), spread)
    return Prior(
        ridge=Ridge(strength, options.prior * 0.1 * change, options.prior * (d + 2.0)),
        R=options.prior * 0.03 * np.minimum(spread, change),
        R_count=options.prior * (d + 11.0),
        start=options.prior * 0.1 * np.tile(places, layout.order),
        start_count=options.prior * (N + 2.0),
        alpha=0.1 * options.prior,
        sticky=options.stickiness * options.prior,
    )


def changes(ys: Sequence[Array], order: int) -> Array:
    """(d,) variance of the change that the dynamics must explain: of velocity, or at first order of place."""
    return np.asarray(np.concatenate([np.diff(y, n=order, axis=0) for y in ys]).var(axis=0) + STILL)


def log_prior(slds: SLDS, prior: Prior) -> float:
    """The log prior density up to a constant: what the M-step adds to the expected log joint."""
    layout, d = slds.layout, slds.layout.d
    total = 0.0
    if prior.ridge.count > 0:
        for A, b, Q in zip(slds.A, slds.b, slds.Q, strict=True):
            free = A[:d] - layout.carry
            B = np.hstack([free @ np.linalg.pinv(layout.regard), b[:d, None]]) - layout.steady
            scatter = (B * prior.ridge.strength) @ B.T + np.diag(prior.ridge.noise)
            count = prior.ridge.count + np.count_nonzero(prior.ridge.strength)
            total += inverse_wishart(Q[:d, :d], scatter, count)
        for cov in slds.cov0:
            total += inverse_wishart(cov, np.diag(prior.start), prior.start_count)
        total += inverse_wishart(slds.R, np.diag(prior.R), prior.R_count)
        Pi, pi0 = np.maximum(slds.Pi, 1e-300), np.maximum(slds.pi0, 1e-300)
        total += float(((prior.alpha + prior.sticky * np.eye(slds.K)) * np.log(Pi)).sum())
        total += float((prior.alpha * np.log(pi0)).sum())
    return total


def inverse_wishart(cov: Array, scatter: Array, count: float) -> float:
    """Log density of a covariance (M, M), up to a constant."""
    return float(-0.5 * (count * np.linalg.slogdet(cov)[1] + np.trace(np.linalg.solve(cov, scatter))))
