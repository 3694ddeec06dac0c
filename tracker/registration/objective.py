"""The one function that registration minimises, with its derivatives; it is also the evidence of hypotheses.

With the visible points p of the template, their weights w_p, tempered by tau, joint limits of stiffness k,
and x_l the mean over link l of

    loss_p  = rho(|I(p(q)) - T_p - o|^2 / (3 sigma^2)) / 2,

or, for a point that the scene may cover, minus the log of the mixture of both likelihoods,

    E(q) = tau (sum_l W_l fade(x_l) - sum_p w_p behind_p) + k |beyond(q)|^2 / 2,

is minus the tempered log likelihood ratio between the figure and the background, in nats. W_l is the weight
of the link's visible points. fade is the identity except for links that match too badly, which count as out
of sight and cost no more for matching worse. behind_p is the loss of the scene at the point, or its usual
value where the scene is unknown, with log(sigma_scene / sigma) added, as both are densities of grey levels.
Points that are hidden or outside the frame add nothing, as the pixels there show something else.

The climb minimises E plus the prior; `Objective.linearised` gives E, which is minus the log evidence of a
hypothesis, its Gauss-Newton matrix and its derivative. The derivative keeps discontinuous terms fixed: which
points are visible, the scene behind them, and the brightness offset o, a median near its optimum, where E is
flat in it.
"""

from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array, Ints
from kinematics.spm import Skeleton
from tracker.picture.backdrop import ALIKE, NOISE, UNKNOWN
from tracker.registration.chain_rule import laid_out, weighed
from tracker.registration.field import Field
from tracker.registration.kernel import lay, room
from tracker.registration.modes import mode_of
from tracker.registration.records import Laid, Laying, Noise, Picture, Points, Weights
from tracker.registration.templates import hiding

FEWEST = 6  # least number of a link's points from which a brightness offset is computed
IN_SIGHT, OUT_OF_SIGHT = 0.6, 0.3  # mean matches from which a link is in full, up to which out of sight


@dataclass(frozen=True)
class Fit:
    """The templates compared with one level at H poses q (H, D), and the links at these poses."""

    q: Array
    bones: Skeleton
    laid: Laid

    def __getitem__(self, rows: Ints) -> "Fit":
        """The fit of some of its poses, given by position."""
        bones = Skeleton._make(each[rows] for each in self.bones)
        return Fit(self.q[rows], bones, Laid._make(each[rows] for each in self.laid))

    @property
    def links(self) -> Laying:
        """The arrays that the chain rule uses."""
        return self.q, *self.bones, self.laid.moments, self.laid.pull, self.laid.cost


class Objective:
    """E of poses in one frame, on one level of that frame."""

    def __init__(self, field: Field, number: int) -> None:
        figure, settings, mode = field.figure, field.settings, mode_of(field.settings)
        self.field, self.layout = field, figure.layout
        self.picture = _picture(field, number)
        self.points = _points(field, number, mode.coarse)
        self.noise = Noise(
            variance=settings.noise**2,
            light=settings.light,
            scale=mode.robust,
            out_of_sight=-0.5 * mode.robust * np.log(OUT_OF_SIGHT),
            in_sight=-0.5 * mode.robust * np.log(IN_SIGHT),
            fewest=FEWEST,
            layered=mode.layered,
            margin=hiding(field.levels[number], field.view, settings),
            covered=mode.covered,
            alike=ALIKE + float(np.log(NOISE / settings.noise)) if mode.layered else -np.inf,
        )
        # Nats for a point of weight 1; on coarse blurs each used point stands for several.
        nats = float(settings.tempering * len(field.templates.link) / len(self.points.along))
        self.weights = Weights(nats, nats / (3.0 * self.noise.variance), *figure.limits, mode.stiffness)

    def compare(self, q: Array) -> Fit:
        """The templates compared with the level at poses (H, D)."""
        fit = self.begin(q)
        self.lay(fit, np.arange(len(q)))
        return fit

    def begin(self, q: Array) -> Fit:
        """Poses (H, D) with empty results for `lay`."""
        bones = laid_out(self.layout, q)
        return Fit(q, bones, room(bones.length.shape, len(self.points.along)))

    def lay(self, fit: Fit, rows: Ints) -> None:
        """Compare the templates with the level at some of the poses."""
        lay(self.picture, fit.bones, self.points, self.layout, self.noise, rows, fit.laid)

    def linearised(self, fit: Fit) -> tuple[Array, Array, Array]:
        """E (H,) of each pose, nats; its Gauss-Newton matrix (H, D, D) and derivative (H, D) by the pose."""
        return weighed(self.layout, fit.links, self.weights)


def _points(field: Field, number: int, coarse: int) -> Points:
    """The templates' points with their colours at one blur; every `coarse`-th on all but the finest."""
    templates = field.templates
    every = 1 if number == len(templates.colours) - 1 else coarse
    return Points(
        np.searchsorted(templates.link[::every], np.arange(len(field.figure.links) + 1)),
        templates.along[::every].copy(),
        templates.across[::every].copy(),
        templates.weight[::every].copy(),
        templates.colours[number][::every].copy(),
        templates.known[::every].copy(),
        templates.light,
    )


def _picture(field: Field, number: int) -> Picture:
    """The picture and the scene's loss at one blur, see `Picture`."""
    scenery, view, level = field.scenery, field.view, field.levels[number]
    (x, y), (axis_x, axis_y) = level.at(np.array(view.origin)).tolist(), (view.axes / level.step).tolist()
    # Densities of grey levels with one sigma in the figure and another in the scene.
    against = np.float32(np.log(NOISE / field.settings.noise))
    return Picture(
        planes=level.planes,
        origin_x=x,
        origin_y=y,
        axis_x=axis_x,
        axis_y=axis_y,
        differs=scenery.differs + against,
        around=scenery.around + against,
        unknown=float(UNKNOWN + against),
        step=scenery.step,
        corner_x=float(level.corner[0]),
        corner_y=float(level.corner[1]),
        pixel=level.step,
    )
