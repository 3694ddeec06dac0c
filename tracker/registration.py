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
from typing import Self

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array, Gaussian, apply
from kinematics.figure import Figure
from kinematics.spm import View, motions, skeleton, surface
from tracker.kernel import Laid, Lens, Noise, Points, Shape, lay
from tracker.sampling import Level, sample
from tracker.settings import Settings
from tracker.template import Templates

Rows = NDArray[np.intp] | slice
FEWEST = 6  # points of a link that an offset of light is worked out from
SMALL_STEP = 2e-3  # radians or leg lengths: well under a tenth of a pixel
SMALL_GAIN = 1e-2  # nats
LONGEST_STEP = 0.5  # radians, leg lengths or log units: where the linearisation has long ended
FIRST_DAMPING, HEAVIEST = 1e-3, 10.0  # beyond the heaviest no step helps


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
    offset      : (L, 3) brightness offset of each link and channel, grey levels
    inside      : share of the points that lie in the frame
    outcome     : why the search stopped
    """

    q: Array
    information: Array
    vector: Array
    cost: float
    residual: float
    match: Array
    offset: Array
    inside: float
    outcome: Outcome


def align(
    templates: Templates,
    levels: list[Level],
    figure: Figure,
    view: View,
    priors: Gaussian,
    settings: Settings,
) -> list[Registration]:
    """Climb from each prior's mean (H, D) to a mode, coarse to fine, and linearise the likelihood there."""
    search = _Search(templates, figure, view, priors, settings)
    q, outcomes = priors.mean, [Outcome.CONVERGED] * len(priors.mean)
    for number, level in enumerate(levels):
        q, outcomes = search.climb(number, level, q)
    fit = search.compare(len(levels) - 1, levels[-1], q)
    information, gradient = search.normal_equations(fit, slice(None))
    inside = fit.laid.inside.mean(1)
    weight = templates.weight * fit.laid.match
    square = (weight[..., None] * fit.laid.residual**2).sum((1, 2)) / np.maximum(3.0 * weight.sum(1), 1e-9)
    return [
        Registration(
            q=q[h],
            information=information[h],
            vector=information[h] @ q[h] - gradient[h],
            cost=settings.image_weight * search.count * fit.laid.mean[h],
            residual=float(np.sqrt(square[h])),
            match=fit.laid.match[h],
            offset=fit.laid.offset[h],
            inside=float(inside[h]),
            outcome=Outcome.OUTSIDE if inside[h] < settings.least_inside else outcomes[h],
        )
        for h in range(len(q))
    ]


def seen(templates: Templates, levels: list[Level], figure: Figure, view: View, found: Registration) -> Array:
    """(levels, P, 3) what the frame shows where the points settled, the offsets of light taken off."""
    pixels = view.to_pixels(
        surface(skeleton(figure, found.q), templates.link, templates.along, templates.across)
    )
    return np.stack([sample(level, pixels)[0] for level in levels]) - found.offset[templates.link]


@dataclass(frozen=True)
class _Fit:
    """The templates laid on one level at H poses q (H, D)."""

    q: Array
    laid: Laid

    def with_rows(self, rows: NDArray[np.intp], other: Self, taken: NDArray[np.bool_]) -> Self:
        """Some of these rows replaced by those of `other`, which has one for each of `rows`."""
        to = rows[taken]
        self.q[to] = other.q[taken]
        for mine, theirs in zip(self.laid, other.laid, strict=True):
            np.asarray(mine)[to] = np.asarray(theirs)[taken]
        return self


class _Search:
    """A climb's fixed data: templates, figure, view, priors, settings."""

    def __init__(
        self, templates: Templates, figure: Figure, view: View, priors: Gaussian, settings: Settings
    ) -> None:
        self.figure, self.view, self.settings = figure, view, settings
        self.full = settings.mode == "full"
        self.mean = priors.mean
        inverse = np.linalg.inv(priors.cov) if self.full else _lengths_only(priors.cov, figure)
        self.precision: Array = np.asarray(inverse, dtype=np.float64)
        self.count = settings.tempering * len(templates.link)
        self.low, self.high = figure.limits
        layout = figure.layout
        self.shape = Shape(layout.layer, layout.width, layout.taper)
        first = np.searchsorted(templates.link, np.arange(len(figure.links) + 1))
        self.points = [
            Points(first, templates.along, templates.across, templates.weight, colours, templates.known)
            for colours in templates.colours
        ]
        self.noise = Noise(
            variance=settings.noise**2,
            scale=settings.robust**2 if self.full else np.inf,
            out_of_sight=settings.out_of_sight,
            in_sight=settings.in_sight,
            fewest=FEWEST,
            layered=self.full,
            margin=0.0,
        )

    def climb(self, number: int, level: Level, q: Array) -> tuple[Array, list[Outcome]]:
        """Levenberg-Marquardt at one blur, all poses side by side."""
        fit = self.compare(number, level, q.copy())
        cost, damping = self.objective(fit, slice(None)), np.full(len(q), FIRST_DAMPING)
        climbing = np.arange(len(q))
        for _ in range(self.settings.iterations):
            step = self.step(fit, climbing, damping[climbing])
            trial = self.compare(number, level, fit.q[climbing] + step)
            gain = cost[climbing] - self.objective(trial, climbing)
            better = gain > 0.0
            fit = fit.with_rows(climbing, trial, better)
            cost[climbing[better]] -= gain[better]
            damping[climbing] = np.where(
                better, 0.3 * damping[climbing], np.maximum(10.0 * damping[climbing], 1e-2)
            )
            small = (gain < SMALL_GAIN) | (np.abs(step).max(1) < SMALL_STEP)
            climbing = climbing[~np.where(better, small, damping[climbing] > HEAVIEST)]
            if not len(climbing):
                break
        outcomes = [Outcome.CONVERGED] * len(q)
        for h in climbing:
            outcomes[h] = Outcome.ITERATION_LIMIT
        return fit.q, outcomes

    def step(self, fit: _Fit, rows: NDArray[np.intp], damping: Array) -> Array:
        """Damped Gauss-Newton steps of some rows."""
        information, gradient = self.normal_equations(fit, rows)
        H = information + self.precision[rows]
        slope = gradient + apply(self.precision[rows], fit.q[rows] - self.mean[rows])
        # A link seen end-on or hidden leaves its freedoms without information, hence the damping.
        diagonal = H.diagonal(axis1=1, axis2=2)
        damped = H + (damping[:, None] * diagonal + 1e-9)[:, None] * np.eye(H.shape[-1])
        step = -np.linalg.solve(damped, slope[..., None])[..., 0]
        return np.asarray(step * (LONGEST_STEP / np.maximum(np.abs(step).max(1), LONGEST_STEP))[:, None])

    def objective(self, fit: _Fit, rows: Rows) -> Array:
        """(H,) what the climb lowers, nats."""
        away, (excess, stiffness) = fit.q - self.mean[rows], self.beyond(fit.q)
        leaning = (away * apply(self.precision[rows], away)).sum(1) + (stiffness * excess**2).sum(1)
        return np.asarray(self.count * fit.laid.mean + 0.5 * leaning)

    def beyond(self, q: Array) -> tuple[Array, Array]:
        """How far each freedom is beyond its limits (H, D), and the stiffness that pulls it back, else 0."""
        excess = q - np.clip(q, self.low, self.high)
        stiffness = np.where(excess != 0.0, 1.0 / np.radians(self.settings.limit_give) ** 2, 0.0)
        return excess, stiffness * self.full

    def compare(self, number: int, level: Level, q: Array) -> _Fit:
        """The templates laid on one level at poses."""
        bones = skeleton(self.figure, q)
        origin = np.asarray(self.view.origin) - level.corner
        lens = Lens(*origin.tolist(), *self.view.axes.tolist())
        parts = (bones.start, bones.direction, bones.length, bones.size)
        noise = self.noise._replace(margin=self.settings.cover * level.sigma / self.view.unit)
        return _Fit(q, lay(level.planes, lens, *parts, self.points[number], self.shape, noise))

    def normal_equations(self, fit: _Fit, rows: Rows) -> tuple[Array, Array]:
        """Tempered J'WJ / sigma^2 and J'Wr / sigma^2 of some rows, and those of the limits of the joints."""
        q = fit.q[rows]
        ways = motions(self.figure, skeleton(self.figure, q))
        scale = self.settings.tempering / (3.0 * self.settings.noise**2)
        turned = np.swapaxes(ways, -1, -2)
        information = scale * (turned @ fit.laid.moments[rows] @ ways).sum(1)
        gradient = scale * apply(turned, fit.laid.pull[rows]).sum(1)
        excess, stiffness = self.beyond(q)
        information += stiffness[:, None] * np.eye(stiffness.shape[-1])
        return information, gradient + stiffness * excess


def _lengths_only(cov: Array, figure: Figure) -> Array:
    """(H, D, D) precision of scale and stretches alone."""
    precision = np.zeros_like(cov)
    n = figure.layout.scale
    precision[:, n:, n:] = np.linalg.inv(cov[:, n:, n:])
    return precision
