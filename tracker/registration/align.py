"""Local template registration: hill-climb a pose until the templates match the frame.

Pavlović et al. (1999), section 4.2: from each predicted pose the search climbs to a mode of the likelihood
that the templates define. In the full mode each link and channel has its own brightness offset o, every point
a robust (Cauchy) weight, nearer links hide farther ones, and the climb leans on the prediction: damped
Gauss-Newton steps, on coarse and then on fine blurs, on

    n mean_p rho(|I(p(q)) - T_p - o|^2 / sigma^2) / 2  +  (q - m)' P^-1 (q - m) / 2

The classic mode is the papers': grey templates of the first frame, plain squares, no prior in the climb but
on the lengths, which the papers' figure did not leave free.

A point that shows the scene as it was seen without the figure may be covered by it: its likelihood is a
mixture of the template's and the scene's, so where the template does not match there, it neither pulls nor
measures.

n is tempered: neighbouring pixels err together, and only a share of them counts. The mean makes poses that
hide different points comparable. Between hypotheses the image speaks by how much better the visible points
match as the figure's than as what lies behind it or, where that is unknown, than they usually do. What is
handed on is the likelihood's own linearisation at the mode, so that the filter adds the prior once.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array, Gaussian, apply, transpose
from kinematics.figure import Figure
from kinematics.spm import Index, Skeleton, View, covering, motions, skeleton, surface
from tracker.picture.backdrop import FRONT, UNKNOWN, UNSEEN, Scenery
from tracker.picture.pyramid import Level, sample, within
from tracker.registration.kernel import lay
from tracker.registration.records import Behind, Laid, Lens, Noise, Points, Shape
from tracker.registration.templates import Templates, hiding
from tracker.settings import Settings

COARSE = 2  # every so manieth point is looked at where the blur makes neighbours alike
STANDS_OUT = 0.7  # share of a link of an unknown look that must differ from the scene to be learned
FEWEST = 6  # points of a link that an offset of light is worked out from
SMALL_STEP = 2e-3  # radians or leg lengths: well under a tenth of a pixel
SMALL_GAIN = 1e-2  # nats
NO_FRONT = np.zeros((1, 1, 3), np.float32)
STANDING_OUT = np.array([FRONT, 0.0, 0.0], np.float32)
LONGEST_STEP = 0.5  # radians, leg lengths or log units: where the linearisation has long ended
FIRST_DAMPING, HEAVIEST = 1e-3, 10.0  # beyond the heaviest no step helps


class Outcome(Enum):
    """Why the search stopped."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "hit the iteration limit"
    OUTSIDE = "most template points left the part of the frame that was looked at"


@dataclass(frozen=True)
class Registration:
    """Where the templates settled in one frame.

    q           : (D,) pose at the last step
    information : (D, D) tempered J'WJ / sigma^2; singular where nothing visible constrains q
    vector      : (D,) information times the likelihood's linearised mode
    cost        : minus the tempered log likelihood at q, nats, against what lies behind
    misfit      : mean over the visible points of half the robust squared residual, in units of the noise
    shown       : share of the points within the outlines in the frame that nothing hides or covers
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
    misfit: float
    shown: float
    residual: float
    match: Array
    offset: Array
    inside: float
    outcome: Outcome


@dataclass(frozen=True)
class Field:
    """What poses are compared with in one frame.

    levels  : of the frame, coarse to fine, as many as the templates have colours for
    scenery : how much the frame differs from what lies behind the figure
    """

    templates: Templates
    levels: Sequence[Level]
    figure: Figure
    view: View
    settings: Settings
    scenery: Scenery = UNSEEN

    def seen(self, found: Registration) -> Array:
        """(levels, P, 3) what the frame shows where the points settled, the offsets of light taken off."""
        templates = self.templates
        shown = np.stack([sample(level, self.pixels(found))[0] for level in self.levels])
        offset = np.where(templates.strange[:, None], templates.light, found.offset)
        return np.asarray(shown - offset[templates.link])

    def bare(self, found: Registration) -> float:
        """Share of the points within the outlines at which the frame shows just what lies behind."""
        return float(self.scenery.plain(self.pixels(found)[self.templates.inner]).mean())

    def new(self, found: Registration) -> NDArray[np.bool_]:
        """(P,) which points not known yet the frame shows, on links in full sight."""
        templates, pixels = self.templates, self.pixels(found)
        links = self._in_sight(found) & ~templates.strange
        if templates.strange.any():
            # A link of an unknown look is where it stands out, if it hangs on one in sight.
            parents = np.array(self.figure.parents)
            links |= templates.strange & (parents >= 0) & links[parents] & self._standing_out(pixels)
        sought = np.flatnonzero(~templates.known & links[templates.link])
        sought = sought[self._in_part(pixels[sought]) & ~self.scenery.plain(pixels[sought])]
        new = np.zeros(len(templates.link), dtype=bool)
        if len(sought):
            new[sought[~self._hidden(found, sought)]] = True
        return new

    def _hidden(self, found: Registration, sought: Index) -> NDArray[np.bool_]:
        """Whether a nearer link lies over some of the points."""
        templates, bones = self.templates, skeleton(self.figure, found.q)
        link = templates.link[sought]
        points = surface(bones, link, templates.along[sought], templates.across[sought])
        return covering(self.figure, bones, points, link, hiding(self.levels[-1], self.view, self.settings))

    def _in_part(self, pixels: Array) -> NDArray[np.bool_]:
        """Whether pixels (N, 2) lie in the part of the frame that is looked at."""
        level = self.levels[-1]
        return within(pixels - np.asarray(level.corner), level.planes.shape)

    def _standing_out(self, pixels: Array) -> NDArray[np.bool_]:
        """(L,) whether most of a link is known to differ from the scene."""
        out = self._in_part(pixels) & self.scenery.outstanding(pixels)
        return np.asarray(self._share(out, self.templates.weight == 1.0) >= STANDS_OUT)

    def _in_sight(self, found: Registration) -> NDArray[np.bool_]:
        """(L,) whether most of what is known of a link is seen, and matches."""
        seen = self.templates.known & (found.match > 0.0)
        match = np.bincount(self.templates.link, found.match * seen, len(self.figure.links))
        number = np.bincount(self.templates.link, seen, len(self.figure.links))
        fair = match >= self.settings.in_sight * np.maximum(number, 1.0)
        return np.asarray(fair & (self._share(seen, self.templates.known) > 0.5))

    def _share(self, those: NDArray[np.bool_], of: NDArray[np.bool_]) -> Array:
        """(L,) share of some points of each link."""
        link, L = self.templates.link, len(self.figure.links)
        return np.asarray(np.bincount(link, those & of, L) / np.maximum(np.bincount(link, of, L), 1.0))

    def pixels(self, found: Registration) -> Array:
        """(P, 2) where the points settled."""
        return self.view.to_pixels(self.templates.places(self.figure, found.q))


def align(field: Field, priors: Gaussian, starts: Array | None = None) -> list[Registration]:
    """Climb to a mode, coarse to fine, and linearise the likelihood there.

    From each prior's mean (H, D), or from `starts` (H, D) where given.
    """
    search = _Search(field, priors)
    q = priors.mean if starts is None else starts
    for number in range(len(field.levels)):
        fit, outcomes = search.climb(number, q)
        q = fit.q
    information, gradient = search.normal_equations(fit)
    inside, cost = fit.laid.inside.mean(1), search.evidence(fit)
    weight = field.templates.weight * fit.laid.match
    square = (weight[..., None] * fit.laid.residual**2).sum((1, 2)) / np.maximum(3.0 * weight.sum(1), 1e-9)
    return [
        Registration(
            q=q[h],
            information=information[h],
            vector=information[h] @ q[h] - gradient[h],
            cost=float(field.settings.image_weight * cost[h]),
            misfit=float(fit.laid.mean[h]),
            shown=float(fit.laid.shown[h]),
            residual=float(np.sqrt(square[h])),
            match=fit.laid.match[h],
            offset=fit.laid.offset[h],
            inside=float(inside[h]),
            outcome=Outcome.OUTSIDE if inside[h] < field.settings.least_inside else outcomes[h],
        )
        for h in range(len(q))
    ]


def scan(field: Field, poses: Array) -> Array:
    """(H,) minus the tempered log likelihood of poses (H, D) at the coarsest blur, nats; none climbs."""
    anything = Gaussian(poses[:1], np.eye(poses.shape[1])[None])
    search = _Search(field, anything)
    return search.evidence(search.compare(0, poses))


@dataclass(frozen=True)
class _Fit:
    """The templates laid on one level at H poses q (H, D), the links as these lay them."""

    q: Array
    bones: Skeleton
    laid: Laid

    def __getitem__(self, rows: NDArray[np.intp]) -> "_Fit":
        """Those of some poses."""
        q, *parts = (part[rows] for part in self._parts)
        return _Fit(q, Skeleton(*parts[:4]), Laid(*parts[4:]))

    def take(self, other: Self, mine: Sequence[int] | NDArray[np.intp], rows: NDArray[np.intp]) -> None:
        """Put rows of another in the place of mine."""
        for part, theirs in zip(self._parts, other._parts, strict=True):
            part[mine] = theirs[rows]

    @property
    def _parts(self) -> tuple[NDArray[Any], ...]:
        bones = self.bones
        return self.q, bones.start, bones.direction, bones.length, bones.size, *self.laid


class _Search:
    """A climb's fixed data."""

    def __init__(self, field: Field, priors: Gaussian) -> None:
        templates, figure, settings = field.templates, field.figure, field.settings
        self.field, self.figure, self.settings = field, figure, settings
        self.full = settings.mode == "full"
        self.mean = priors.mean
        inverse = np.linalg.inv(priors.cov) if self.full else _lengths_only(priors.cov, figure)
        self.precision: Array = np.asarray(inverse, dtype=np.float64)
        self.count = settings.tempering * len(templates.link)
        self.low, self.high = figure.limits
        self.stiffness = self.full / np.radians(settings.limit_give) ** 2
        layout = figure.layout
        self.shape = Shape(layout.layer, layout.width, layout.taper)
        # A foot, which does not breathe, is too small to stand out for certain.
        levels, self.strange = field.levels, templates.strange & self.full & layout.breathes
        self.fronts = [field.scenery.front(level) if self.strange.any() else NO_FRONT for level in levels]
        self.points = [self.points_at(number) for number in range(len(templates.colours))]
        self.noise = Noise(
            variance=settings.noise**2,
            light=settings.light,
            scale=settings.robust**2 if self.full else np.inf,
            out_of_sight=settings.out_of_sight,
            in_sight=settings.in_sight,
            fewest=FEWEST,
            layered=self.full,
            margin=0.0,
            covered=settings.covered if self.full else 0.0,
        )

    def points_at(self, number: int) -> Points:
        """The templates' points with their colours at one blur, of the coarser ones a part."""
        templates = self.field.templates
        coarse = self.full and number < len(templates.colours) - 1
        kept = np.arange(0, len(templates.link), COARSE if coarse else 1)
        strange = self.strange[templates.link[kept]]
        return Points(
            np.searchsorted(templates.link[kept], np.arange(len(self.figure.links) + 1)),
            templates.along[kept],
            templates.across[kept],
            templates.weight[kept],
            np.where(strange[:, None], STANDING_OUT, templates.colours[number][kept]),
            templates.known[kept] | (strange & (templates.weight[kept] == 1.0)),
            templates.light,
            self.strange,
        )

    def climb(self, number: int, q: Array) -> tuple[_Fit, list[Outcome]]:
        """Levenberg-Marquardt at one blur, all poses side by side."""
        fit = found = self.compare(number, q.copy())
        rows, damping = np.arange(len(q)), np.full(len(q), FIRST_DAMPING)
        cost = self.objective(fit, rows)
        for _ in range(self.settings.iterations):
            step = self.step(fit, rows, damping)
            trial = self.compare(number, fit.q + step)
            gain = cost - self.objective(trial, rows)
            better = gain > 0.0
            if not better.all():
                worse = np.flatnonzero(~better)
                trial.take(fit, worse, worse)
            fit, cost = trial, cost - np.maximum(gain, 0.0)
            damping = np.where(better, 0.3 * damping, np.maximum(10.0 * damping, 1e-2))
            small = (gain < SMALL_GAIN) | (np.abs(step).max(1) < SMALL_STEP)
            ended = np.where(better, small, damping > HEAVIEST)
            if ended.any():
                done, on = np.flatnonzero(ended), np.flatnonzero(~ended)
                found.take(fit, rows[done], done)
                rows, damping, cost, fit = rows[on], damping[on], cost[on], fit[on]
            if not len(rows):
                break
        outcomes = [Outcome.CONVERGED] * len(q)
        for h in rows:
            outcomes[h] = Outcome.ITERATION_LIMIT
        found.take(fit, rows, np.arange(len(rows)))
        return found, outcomes

    def step(self, fit: _Fit, rows: NDArray[np.intp], damping: Array) -> Array:
        """Damped Gauss-Newton steps (H, D) of a fit of some rows."""
        H, gradient = self.normal_equations(fit)
        precision = self.precision[rows]
        H += precision
        slope = gradient + apply(precision, fit.q - self.mean[rows])
        # A link seen end-on or hidden leaves its freedoms without information, hence the damping.
        diagonal = np.einsum("hii->hi", H)
        diagonal += damping[:, None] * diagonal + 1e-9
        step = -np.linalg.solve(H, slope[..., None])[..., 0]
        return np.asarray(step * (LONGEST_STEP / np.maximum(np.abs(step).max(1), LONGEST_STEP))[:, None])

    def objective(self, fit: _Fit, rows: NDArray[np.intp]) -> Array:
        """(H,) what the climb lowers, nats."""
        away, (excess, stiffness) = fit.q - self.mean[rows], self.beyond(fit.q)
        leaning = (away * apply(self.precision[rows], away)).sum(1) + (stiffness * excess**2).sum(1)
        return np.asarray(self.count * fit.laid.mean + 0.5 * leaning)

    def beyond(self, q: Array) -> tuple[Array, Array]:
        """How far each freedom is beyond its limits (H, D), and the stiffness that pulls it back, else 0."""
        excess = np.maximum(q - self.high, 0.0) + np.minimum(q - self.low, 0.0)
        return excess, self.stiffness * (excess != 0.0)

    def compare(self, number: int, q: Array) -> _Fit:
        """The templates laid on one level at poses."""
        level, view, scenery = self.field.levels[number], self.field.view, self.field.scenery
        bones = skeleton(self.figure, q)
        origin = np.asarray(view.origin) - level.corner
        lens = Lens(*origin.tolist(), *view.axes.tolist())
        parts = (bones.start, bones.direction, bones.length, bones.size)
        front = self.fronts[number]
        behind = Behind(scenery.differs, scenery.around, UNKNOWN, scenery.step, *level.corner, front)
        noise = self.noise._replace(margin=hiding(level, view, self.settings))
        return _Fit(q, bones, lay(level.planes, lens, *parts, self.points[number], self.shape, behind, noise))

    def evidence(self, fit: _Fit) -> Array:
        """(H,) minus the tempered log likelihood of what is seen of the figure, against what is behind."""
        return np.asarray(self.count * fit.laid.shown * (fit.laid.open - fit.laid.behind))

    def normal_equations(self, fit: _Fit) -> tuple[Array, Array]:
        """Tempered J'WJ / sigma^2 (H, D, D) and J'Wr / sigma^2 (H, D), the limits of the joints in them."""
        (H, D), moments = fit.q.shape, fit.laid.moments
        ways = motions(self.figure, fit.bones)
        scale = self.count / (fit.laid.match.shape[1] * 3.0 * self.settings.noise**2)
        turned = transpose(ways.reshape(H, -1, D))
        information = scale * (turned @ (moments @ ways).reshape(H, -1, D))
        gradient = scale * apply(turned, fit.laid.pull.reshape(H, -1))
        excess, stiffness = self.beyond(fit.q)
        np.einsum("hii->hi", information)[...] += stiffness
        return information, gradient + stiffness * excess


def _lengths_only(cov: Array, figure: Figure) -> Array:
    """(H, D, D) precision of scale and stretches alone."""
    precision = np.zeros_like(cov)
    n = figure.layout.scale
    precision[:, n:, n:] = np.linalg.inv(cov[:, n:, n:])
    return precision
