"""Local template registration: hill-climb a pose until the templates match the frame.

Pavlović et al. (1999), section 4.2: from each predicted pose the search climbs to a mode of the likelihood
that the templates define, by damped Gauss-Newton steps on coarse and then on fine blurs, down

    E(q)  +  (q - m)' P^-1 (q - m) / 2,

E as in `tracker.registration.objective`. In the full mode each link and channel has its own brightness
offset, every point a robust (Cauchy) weight, nearer links hide farther ones, and the climb includes the prior
of the whole pose; the classic mode (`tracker.registration.modes`) is the papers'. The results are E at the
mode and the linearisation of E alone there, so that the filter adds the prior once. Links behind something of
the scene have no part in the linearisation: a shrub may match trousers by chance.
"""

from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array, Gaussian, Ints
from kinematics.spm import joints, surface
from tracker.picture.pyramid import within
from tracker.registration.chain_rule import descend
from tracker.registration.field import Field, Registration
from tracker.registration.modes import mode_of
from tracker.registration.objective import Fit, Objective
from tracker.registration.records import Climbs

STEP = 0.1  # grid of the search for the root, leg lengths; within the reach of the coarsest blur
SPREADS = 2.0  # its range either way, standard deviations of the root
FARTHEST = np.array([1.5, 0.3])  # its largest range along and up, leg lengths
SEEN = 0.5  # least share of joints in the picture
BETTER = 0.25  # how much better the scene explains a link that tells nothing, units of rho / 2


def align(field: Field, priors: Gaussian, starts: Array | None = None) -> Registration:
    """Climb to a mode, coarse to fine, and linearise the likelihood there.

    From each prior's mean (H, D), or from `starts` (H, D) where given.
    """
    lean = priors.mean, mode_of(field.settings).precision(priors.cov, field.figure)
    q = priors.mean if starts is None else starts
    for number in range(len(field.levels)):
        objective = Objective(field, number)
        fit = _climb(objective, q, lean)
        q = fit.q
    templates, fit = field.templates, _without_bare(fit, field.templates.link)
    cost, information, gradient = objective.linearised(fit)
    laid = fit.laid
    places = surface(fit.bones, templates.link, templates.along, templates.across)
    return Registration(
        q=q,
        information=information,
        vector=np.stack([info @ pose for info, pose in zip(information, q, strict=True)]) - gradient,
        cost=field.settings.image_weight * cost,
        misfit=laid.mean,
        shown=laid.shown,
        match=laid.match,
        offset=laid.offset,
        inside=laid.inside.mean(1),
        pixels=field.view.to_pixels(places),
    )


def _without_bare(fit: Fit, link: Ints) -> Fit:
    """The fit without what it tells of links that are out of sight, as the scene explains the picture better
    there than their templates do; `link` (P,) is that of each point.

    The climb still uses it, for a link that was predicted beside its place must find it.
    """
    laid = fit.laid
    seen = np.clip(1.0 - laid.bare / BETTER, 0.0, 1.0)
    moments, pull = seen[..., None, None] * laid.moments, seen[..., None] * laid.pull
    return replace(fit, laid=laid._replace(moments=moments, pull=pull, match=seen[:, link] * laid.match))


def scan(field: Field, poses: Array) -> Array:
    """(H,) E of poses (H, D) at the coarsest blur, nats, without climbing."""
    objective = Objective(field, 0)
    return objective.linearised(objective.compare(poses))[0]


def reach(priors: Gaussian) -> Array:
    """(2,) range either way in which the root is searched, leg lengths."""
    sd = np.sqrt(np.diagonal(priors.cov[:, :2, :2], axis1=1, axis2=2)).max(0)
    return np.asarray(np.minimum(SPREADS * sd, FARTHEST))


def sought(field: Field, priors: Gaussian, best: int) -> Array:
    """(H, D) the priors' means, with the root shift for which the best prior's mean fits the picture best."""
    q, cov = priors.mean[best], priors.cov[best, :2, :2]
    steps = [np.arange(-n, n + 1) * STEP for n in np.floor(reach(priors) / STEP)]
    shifts = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
    poses = np.repeat(q[None], len(shifts), axis=0)
    poses[:, :2] += shifts
    # Parts outside the picture cannot match badly, so poses there would win.
    part, pixels = field.levels[-1], field.view.to_pixels(joints(field.figure, poses))
    there = within(part.at(pixels), part.planes.shape).mean(-1) >= SEEN
    if not there.any():
        return priors.mean
    poses, shifts = poses[there], shifts[there]
    far = 0.5 * (shifts * np.linalg.solve(cov, shifts.T).T).sum(1)
    starts = priors.mean.copy()
    starts[:, :2] += shifts[(scan(field, poses) + far).argmin()]
    return starts


def _climb(objective: Objective, q: Array, lean: tuple[Array, Array]) -> Fit:
    """Levenberg-Marquardt at one blur from poses (H, D); `lean` holds the priors' means and precisions."""
    fit, climbs = objective.begin(np.repeat(q, 2, axis=0)), Climbs.begin(len(q))
    for _ in range(objective.field.settings.iterations + 1):
        objective.lay(fit, (climbs.own ^ 1)[climbs.on])
        descend(objective.layout, fit.links, objective.weights, lean, climbs)
        if not climbs.on.any():
            break
    return fit[climbs.own]
