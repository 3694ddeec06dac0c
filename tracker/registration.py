"""Local template registration: hill-climb a pose until the templates match the frame.

Pavlović et al. (1999), section 4.2: from each predicted pose the search climbs to a mode of the likelihood
that the templates define. In the full mode each link and channel has its own brightness offset, every pixel a
robust (Cauchy) weight, nearer links hide farther ones, and the climb leans on the prediction: Gauss-Newton
steps on

    n/2 mean_p w_p |I(p(q)) - T_p - o|^2_rho / sigma^2  +  1/2 (q - m)' P^-1 (q - m)

What is handed on is the likelihood's own linearisation at the mode, so that the filter adds the prior once.
n is tempered: neighbouring pixels err together, and only a share of them counts as independent.
"""

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Gaussian
from kinematics.figure import Figure
from kinematics.spm import View, covering, jacobian, skeleton, surface
from tracker.sampling import Array, Level, sample
from tracker.settings import Settings
from tracker.template import Templates


class Outcome(Enum):
    """Why the search stopped."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "hit the iteration limit"
    LOST = "most template pixels left the frame"


@dataclass(frozen=True)
class Registration:
    """Where the templates settled in one frame.

    q           : (D,) pose at the last step
    information : (D, D) tempered J'WJ / sigma^2; singular where nothing visible constrains q
    vector      : (D,) information times the likelihood's linearised mode
    cost        : minus the tempered log likelihood at q, nats, over as many pixels for every pose
    residual    : root-mean-square residual, grey levels
    visible     : (P,) template points that lie in the frame and under no nearer link
    seen        : (levels, P, 3) colours at q, the offsets of light taken off
    match       : (P,) robust weight of each point, 0 where not visible
    outcome     : why the search stopped
    """

    q: Array
    information: Array
    vector: Array
    cost: float
    residual: float
    visible: NDArray[np.bool_]
    seen: Array
    match: Array
    outcome: Outcome


@dataclass(frozen=True)
class _Fit:
    """Templates against one level at one pose: residuals (P, 3), weights (P,), slope (P, 3, D), mean cost."""

    residual: Array
    match: Array
    slope: Array
    mean: float
    visible: NDArray[np.bool_]
    offset: Array


def align(
    templates: Templates,
    levels: list[Level],
    figure: Figure,
    view: View,
    prior: Gaussian,
    settings: Settings,
) -> Registration:
    """Climb from the prior's mean to a mode, coarse to fine."""
    scales = settings.iterations
    classic = settings.mode == "classic"
    precision = np.linalg.inv(prior.cov)
    q = prior.mean.copy()
    stopped = Outcome.CONVERGED
    for number, level in enumerate(levels):
        q, stopped = _climb(templates, number, level, figure, view, q, prior.mean, precision, settings)
    fit = _compare(templates, len(levels) - 1, levels[-1], figure, view, q, settings)
    information, gradient = _normal_equations(fit, settings)
    if fit.visible.mean() < 0.2:
        stopped = Outcome.LOST
    return Registration(
        q=q,
        information=information,
        vector=information @ q - gradient,
        cost=settings.image_weight * settings.tempering * len(templates.link) * fit.mean,
        residual=float(np.sqrt((fit.match[:, None] * fit.residual**2).sum() / max(3.0 * fit.match.sum(), 1e-9))),
        visible=fit.visible,
        seen=_colours(templates, levels, figure, view, q, fit),
        match=fit.match,
        outcome=stopped,
    )


def _climb(templates, number, level, figure, view, q, mean, precision, settings):
    fit = _compare(templates, number, level, figure, view, q, settings)
    n = settings.tempering * len(templates.link)
    cost = n * fit.mean + 0.5 * (q - mean) @ precision @ (q - mean)
    damping = 1e-3
    for _ in range(settings.iterations):
        information, gradient = _normal_equations(fit, settings)
        H = information + precision
        g = gradient + precision @ (q - mean)
        step = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
        trial = q + step
        fit_t = _compare(templates, number, level, figure, view, trial, settings)
        cost_t = n * fit_t.mean + 0.5 * (trial - mean) @ precision @ (trial - mean)
        if cost_t < cost:
            small = np.abs(step).max() < 2e-3
            q, fit, damping, gain = trial, fit_t, damping * 0.3, cost - cost_t
            cost = cost_t
            if small or gain < 1e-2:
                return q, Outcome.CONVERGED
        else:
            damping = max(damping * 10, 1e-2)
            if damping > 10:
                return q, Outcome.CONVERGED
    return q, Outcome.ITERATION_LIMIT


def _compare(templates, number, level, figure, view, q, settings) -> _Fit:
    bones = skeleton(figure, q)
    points = surface(bones, templates.link, templates.along, templates.across)
    values, gradients, inside = sample(level, view.to_pixels(points))
    visible = inside & ~covering(figure, bones, points, templates.link) & templates.known
    residual = values - templates.colours[number]
    offset = _offsets(residual, templates, visible, len(figure.links))
    residual = residual - offset[templates.link]
    size = (residual**2).sum(-1) / (3.0 * settings.noise**2)
    c2 = settings.robust**2
    weight = templates.weight * visible
    match = weight / (1.0 + size / c2)
    rho = c2 * np.log1p(size / c2)
    mean = 0.5 * float((weight * rho).sum() / max(weight.sum(), 1e-9))
    moved = jacobian(figure, bones, templates.link, templates.along, templates.across) * view.axes[:, None]
    slope = gradients @ moved
    return _Fit(residual, match, slope, mean, visible, offset)


def _offsets(residual, templates, visible, L):
    out = np.zeros((L, 3))
    for i in range(L):
        own = visible & (templates.link == i)
        if own.sum() > 5:
            out[i] = np.median(residual[own], axis=0)
    return out


def _normal_equations(fit: _Fit, settings: Settings) -> tuple[Array, Array]:
    scale = settings.tempering / (3.0 * settings.noise**2)
    flat = fit.slope.reshape(-1, fit.slope.shape[-1])
    weighted = (fit.match[:, None, None] * fit.slope).reshape(flat.shape)
    return scale * weighted.T @ flat, scale * weighted.T @ fit.residual.ravel()


def _colours(templates, levels, figure, view, q, fit):
    bones = skeleton(figure, q)
    pixels = view.to_pixels(surface(bones, templates.link, templates.along, templates.across))
    return np.stack([sample(level, pixels)[0] - fit.offset[templates.link] for level in levels])
