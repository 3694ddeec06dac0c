"""Local template registration: hill-climb a pose until the templates match the frame.

Pavlović et al. (1999), section 4.2: from each predicted pose the search climbs to a mode of the likelihood
that the templates define. In the full mode each link and channel has its own brightness offset o, every point
a robust (Cauchy) weight, nearer links hide farther ones, and the climb leans on the prediction: damped
Gauss-Newton steps, on coarse and then on fine blurs, on

    n mean_p rho(|I(p(q)) - T_p - o|^2 / sigma^2) / 2  +  (q - m)' P^-1 (q - m) / 2

The classic mode is the papers': grey templates of the first frame, plain squares, no prior in the climb but
on the lengths, which the papers' figure did not leave free.

n is tempered: neighbouring pixels err together, and only a share of them counts. The mean makes poses that
hide different points comparable. What is handed on is the likelihood's own linearisation at the mode, so that
the filter adds the prior once.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Gaussian
from kinematics.figure import Figure
from kinematics.spm import View, covering, jacobian, skeleton, surface
from tracker.sampling import Array, Level, sample
from tracker.settings import Settings
from tracker.template import Templates

FEWEST = 6  # points of a link that an offset of light is worked out from
SMALL_STEP = 2e-3  # radians or leg lengths: well under a tenth of a pixel
SMALL_GAIN = 1e-2  # nats
LONGEST_STEP = 0.5  # radians, leg lengths or log units: where the linearisation has long ended
HEAVIEST = 10.0  # damping beyond which no step helps


class Outcome(Enum):
    """Why the search stopped."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "hit the iteration limit"
    OUTSIDE = "most template points left the frame"


@dataclass(frozen=True)
class Registration:
    """Where the templates settled in one frame.

    q           : (D,) pose at the last step
    information : (D, D) tempered J'WJ / sigma^2; singular where nothing visible constrains q
    vector      : (D,) information times the likelihood's linearised mode
    cost        : minus the tempered log likelihood at q, nats, over as many points for every pose
    residual    : root-mean-square residual, grey levels
    match       : (P,) robust weight of each point without the rim's, 0 where not visible
    seen        : (levels, P, 3) colours at q, the offsets of light taken off
    inside      : share of the points that lie in the frame
    outcome     : why the search stopped
    """

    q: Array
    information: Array
    vector: Array
    cost: float
    residual: float
    match: Array
    seen: Array
    inside: float
    outcome: Outcome


def align(
    templates: Templates, levels: list[Level], figure: Figure, view: View, prior: Gaussian, settings: Settings
) -> Registration:
    """Climb from the prior's mean (D,) to a mode, coarse to fine, and linearise the likelihood there."""
    search = _Search(templates, figure, view, prior, settings)
    q = prior.mean.copy()
    outcome = Outcome.CONVERGED
    for number, level in enumerate(levels):
        q, outcome = search.climb(number, level, q)
    fit = search.compare(len(levels) - 1, levels[-1], q)
    information, gradient = search.normal_equations(fit)
    inside = float(fit.inside.mean())
    weight = templates.weight * fit.match
    return Registration(
        q=q,
        information=information,
        vector=information @ q - gradient,
        cost=settings.image_weight * search.count * fit.mean,
        residual=float(np.sqrt((weight[:, None] * fit.residual**2).sum() / max(3.0 * weight.sum(), 1e-9))),
        match=fit.match,
        seen=search.colours(levels, q, fit),
        inside=inside,
        outcome=Outcome.OUTSIDE if inside < settings.least_inside else outcome,
    )


@dataclass(frozen=True)
class _Fit:
    """The templates against one level at one pose.

    residual : (P, 3) grey levels, offsets taken off
    offset   : (L, 3) brightness offset of each link and channel
    match    : (P,) robust weight, 0 where not visible
    mean     : mean over the visible points of half the robust squared residual, in units of the noise
    inside   : (P,) whether the point lies in the frame
    gradient : (P, 3, 2) of the frame, grey levels per pixel
    """

    residual: Array
    offset: Array
    match: Array
    mean: float
    inside: NDArray[np.bool_]
    gradient: Array
    q: Array


class _Search:
    """One climb's fixed data: templates, figure, view, prior, settings."""

    def __init__(
        self, templates: Templates, figure: Figure, view: View, prior: Gaussian, settings: Settings
    ) -> None:
        self.templates, self.figure, self.view, self.settings = templates, figure, view, settings
        self.full = settings.mode == "full"
        self.mean = prior.mean
        self.precision = np.linalg.inv(prior.cov) if self.full else _lengths_only(prior.cov, figure)
        self.count = settings.tempering * len(templates.link)
        self.low, self.high = figure.limits

    def climb(self, number: int, level: Level, q: Array) -> tuple[Array, Outcome]:
        """Levenberg-Marquardt at one blur."""
        fit = self.compare(number, level, q)
        cost, damping = self.objective(fit), 1e-3
        for _ in range(self.settings.iterations):
            information, gradient = self.normal_equations(fit)
            H = information + self.precision
            slope = gradient + self.precision @ (fit.q - self.mean)
            # A link seen end-on or hidden leaves its freedoms without information, hence the damping.
            step = -np.linalg.solve(H + np.diag(damping * np.diag(H) + 1e-9), slope)
            step *= LONGEST_STEP / max(float(np.abs(step).max()), LONGEST_STEP)
            trial = self.compare(number, level, fit.q + step)
            gain = cost - self.objective(trial)
            if gain > 0.0:
                fit, cost, damping = trial, cost - gain, 0.3 * damping
                if gain < SMALL_GAIN or np.abs(step).max() < SMALL_STEP:
                    return fit.q, Outcome.CONVERGED
            else:
                damping = max(10.0 * damping, 1e-2)
                if damping > HEAVIEST:
                    return fit.q, Outcome.CONVERGED
        return fit.q, Outcome.ITERATION_LIMIT

    def objective(self, fit: _Fit) -> float:
        """What the climb lowers, nats."""
        away, (excess, stiffness) = fit.q - self.mean, self.beyond(fit.q)
        leaning = 0.5 * away @ self.precision @ away + 0.5 * stiffness @ excess**2
        return float(self.count * fit.mean + leaning)

    def beyond(self, q: Array) -> tuple[Array, Array]:
        """How far each freedom is beyond its limits, and the stiffness (D,) that pulls it back, 0 within."""
        excess = q - np.clip(q, self.low, self.high)
        stiffness = np.where(excess != 0.0, 1.0 / np.radians(self.settings.limit_give) ** 2, 0.0)
        return excess, stiffness * self.full

    def compare(self, number: int, level: Level, q: Array) -> _Fit:
        """The templates laid on one level at a pose."""
        t, settings = self.templates, self.settings
        bones = skeleton(self.figure, q)
        points = surface(bones, t.link, t.along, t.across)
        values, gradient, inside = sample(level, self.view.to_pixels(points))
        visible = inside & t.known
        residual = values - t.colours[number]
        offset = np.zeros((len(self.figure.links), 3))
        size_of_noise = 3.0 * settings.noise**2
        if self.full:
            visible &= ~covering(self.figure, bones, points, t.link)
            offset = _offsets(residual, t.link, visible, offset)
            residual = residual - offset[t.link]
            scale = settings.robust**2
            size = (residual**2).sum(-1) / size_of_noise
            match, rho = visible / (1.0 + size / scale), scale * np.log1p(size / scale)
            match = match * self.sight(match, visible)[t.link]
        else:
            match, rho = visible.astype(float), (residual**2).sum(-1) / size_of_noise
        weight = t.weight * visible
        mean = 0.5 * float((weight * rho).sum() / max(weight.sum(), 1e-9))
        return _Fit(residual, offset, match, mean, inside, gradient, q)

    def sight(self, match: Array, visible: NDArray[np.bool_]) -> Array:
        """(L,) how much of each link is in sight: 0 where what is seen does not match, as behind a bush."""
        t, low, high = self.templates, self.settings.out_of_sight, self.settings.in_sight
        weight = t.weight * visible
        seen = np.bincount(t.link, weight, len(self.figure.links))
        matched = np.bincount(t.link, weight * match, len(self.figure.links)) / np.maximum(seen, 1e-9)
        return np.clip((matched - low) / (high - low), 0.0, 1.0)

    def normal_equations(self, fit: _Fit) -> tuple[Array, Array]:
        """Tempered J'WJ / sigma^2 and J'Wr / sigma^2, and those of the limits of the joints."""
        t = self.templates
        bones = skeleton(self.figure, fit.q)
        moved = jacobian(self.figure, bones, t.link, t.along, t.across) * self.view.axes[:, None]
        slope = fit.gradient @ moved
        scale = self.settings.tempering / (3.0 * self.settings.noise**2)
        weighted = ((scale * t.weight * fit.match)[:, None, None] * slope).reshape(-1, slope.shape[-1]).T
        excess, stiffness = self.beyond(fit.q)
        information = weighted @ slope.reshape(-1, slope.shape[-1]) + np.diag(stiffness)
        return information, weighted @ fit.residual.ravel() + stiffness * excess

    def colours(self, levels: list[Level], q: Array, fit: _Fit) -> Array:
        """(levels, P, 3) what the frame shows at the points, the offsets of light taken off."""
        t = self.templates
        pixels = self.view.to_pixels(surface(skeleton(self.figure, q), t.link, t.along, t.across))
        return np.stack([sample(level, pixels)[0] - fit.offset[t.link] for level in levels])


def _lengths_only(cov: Array, figure: Figure) -> Array:
    """(D, D) precision of scale and stretches alone."""
    precision = np.zeros_like(cov)
    lengths = slice(len(figure.pose_freedoms), None)
    precision[lengths, lengths] = np.linalg.inv(cov[lengths, lengths])
    return precision


def _offsets(residual: Array, link: NDArray[np.intp], visible: NDArray[np.bool_], offset: Array) -> Array:
    """(L, 3) median residual of each link's visible points; 0 where too few are."""
    for i in range(len(offset)):
        own = visible & (link == i)
        if own.sum() >= FEWEST:
            offset[i] = np.median(residual[own], axis=0)
    return offset
