"""Local template registration: hill-climb a pose until the templates match the frame.

Pavlović et al. (1999), section 4.2: from each predicted pose the search climbs to a mode of the likelihood
that the templates define, by damped Gauss-Newton steps on coarse and then on fine blurs, down

    E(q)  +  (q - m)' P^-1 (q - m) / 2,

E as of `tracker.registration.objective`. In the full mode each link and channel has its own brightness
offset, every point a robust (Cauchy) weight, nearer links hide farther ones, and the climb leans on the
prediction; the classic mode (`tracker.registration.modes`) is the papers'. What is handed on is E at the
mode and E's own linearisation there, so that the filter adds the prior once.
"""

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array, Gaussian, apply
from kinematics.spm import joints, surface
from tracker.picture.pyramid import within
from tracker.registration.chain_rule import damped_steps
from tracker.registration.field import Field, Registration
from tracker.registration.objective import Fit, Objective

SMALL_STEP = 2e-3  # radians or leg lengths: well under a tenth of a pixel
SMALL_GAIN = 1e-2  # nats
LONGEST_STEP = 0.5  # radians, leg lengths or log units: where the linearisation has long ended
FIRST_DAMPING, HEAVIEST = 1e-3, 10.0  # beyond the heaviest no step helps
STEP = 0.1  # leg lengths: within the reach of the coarsest blur
SPREADS = 2.0  # standard deviations of the root either way
FARTHEST = np.array([1.5, 0.3])  # leg lengths at most, ahead and up
SEEN = 0.5  # share of the joints that must lie in the picture


def align(field: Field, priors: Gaussian, starts: Array | None = None) -> Registration:
    """Climb to a mode, coarse to fine, and linearise the likelihood there.

    From each prior's mean (H, D), or from `starts` (H, D) where given.
    """
    objective = Objective(field, priors)
    q = priors.mean if starts is None else starts
    for number in range(len(field.levels)):
        fit = _climb(objective, number, q)
        q = fit.q
    information, gradient = objective.slope(fit)
    laid, templates = fit.laid, field.templates
    places = surface(fit.bones, templates.link, templates.along, templates.across)
    return Registration(
        q=q,
        information=information,
        vector=np.stack([info @ pose for info, pose in zip(information, q, strict=True)]) - gradient,
        cost=field.settings.image_weight * objective.evidence(fit),
        misfit=laid.mean,
        shown=laid.shown,
        match=laid.match,
        offset=laid.offset,
        inside=laid.inside.mean(1),
        pixels=field.view.to_pixels(places),
    )


def scan(field: Field, poses: Array) -> Array:
    """(H,) E of poses (H, D) at the coarsest blur, nats; none climbs."""
    anything = Gaussian(poses[:1], np.eye(poses.shape[1])[None])
    objective = Objective(field, anything)
    return objective.evidence(objective.compare(0, poses))


def reach(priors: Gaussian) -> Array:
    """(2,) leg lengths either way in which the root is sought."""
    sd = np.sqrt(np.diagonal(priors.cov[:, :2, :2], axis1=1, axis2=2)).max(0)
    return np.asarray(np.minimum(SPREADS * sd, FARTHEST))


def sought(field: Field, priors: Gaussian, best: int) -> Array:
    """(H, D): the priors' means, all shifted to where that of the best fits the picture best."""
    q, cov = priors.mean[best], priors.cov[best, :2, :2]
    steps = [np.arange(-n, n + 1) * STEP for n in np.floor(reach(priors) / STEP)]
    shifts = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
    poses = np.repeat(q[None], len(shifts), axis=0)
    poses[:, :2] += shifts
    # What lies out of the picture cannot match badly.
    there = _share_seen(field, poses) >= SEEN
    if not there.any():
        return priors.mean
    poses, shifts = poses[there], shifts[there]
    far = 0.5 * (shifts * np.linalg.solve(cov, shifts.T).T).sum(1)
    starts = priors.mean.copy()
    starts[:, :2] += shifts[(scan(field, poses) + far).argmin()]
    return starts


def _climb(objective: Objective, number: int, q: Array) -> Fit:
    """Levenberg-Marquardt at one blur, all poses side by side."""
    fit = found = objective.compare(number, q.copy())
    rows, damping = np.arange(len(q)), np.full(len(q), FIRST_DAMPING)
    cost = _cost(objective, fit, rows)
    for _ in range(objective.field.settings.iterations):
        step = _step(objective, fit, rows, damping)
        trial = objective.compare(number, fit.q + step)
        gain = cost - _cost(objective, trial, rows)
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
    found.take(fit, rows, np.arange(len(rows)))
    return found


def _cost(objective: Objective, fit: Fit, rows: NDArray[np.intp]) -> Array:
    """(H,) what climbs in some rows lower, nats."""
    away = fit.q - objective.mean[rows]
    return np.asarray(objective.evidence(fit) + 0.5 * (away * apply(objective.precision[rows], away)).sum(1))


def _step(objective: Objective, fit: Fit, rows: NDArray[np.intp], damping: Array) -> Array:
    """Damped Gauss-Newton steps (H, D) of a fit of some rows."""
    H, gradient = objective.slope(fit)
    precision = objective.precision[rows]
    H += precision
    slope = gradient + apply(precision, fit.q - objective.mean[rows])
    return damped_steps(H, slope, damping, LONGEST_STEP)


def _share_seen(field: Field, poses: Array) -> Array:
    """(H,) share of the joints of poses (H, D) that lie in the part of the picture that is looked at."""
    level = field.levels[0]
    place = field.view.to_pixels(joints(field.figure, poses)) - np.asarray(level.corner)
    return np.asarray(within(place, level.planes.shape).mean(-1))
