"""The loop: propose, align, fuse; one frame at a time.

Pavlović et al. (1999), section 4.2. Each frame every switching state proposes the prior of its best
predecessor; local registration climbs from each to a measurement; the Kalman filter fuses the two, with that
frame's own information. The cost of a hypothesis is the sum of its predecessor's cost, the cost of the
switch, and minus the log evidence of its measurement: with the likelihood linearised at the mode q*
(Laplace), E as in `tracker.registration.objective`,

    E(q*) + (q* - m)' P^-1 (q* - m) / 2 + log |I + P L| / 2

With a one-state constant-velocity model the same loop is the extended Kalman filter.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from dynamics.belief import Belief, either, propose, together
from dynamics.gaussian import Array, Flags, Gaussian
from dynamics.kalman import update_information
from dynamics.slds import SLDS
from kinematics.figure import SCALE, Figure
from kinematics.recover import Start
from kinematics.spm import View, joints
from tracker.loop.detections import Detections, Detector
from tracker.loop.estimate import Estimate, State
from tracker.loop.judging import LEAST_INSIDE, denied, inside, judged, judged_by_points
from tracker.loop.outcome import Outcome
from tracker.often import USUAL, often
from tracker.picture.pyramid import Box, Image, Level, pyramid
from tracker.registration.align import align, reach, sought
from tracker.registration.field import Field, Likelihood, Registration
from tracker.registration.modes import Mode, mode_of
from tracker.registration.templates import Templates, cut
from tracker.settings import Settings

ANKLE_KEEP = 0.9  # share of an ankle's angle that is left a frame later, at 30 a second
BREATH_KEEP = 0.95  # the same for a link's stretch
ASTRAY = 0.01  # probability a frame, at 30 a second, that the figure is far from its predicted place
WIDER = 30.0  # factor on the predicted covariance in that case,
WIDEST = 3.0  # and the largest variance that it may give, squared leg lengths or radians
PRUNE = 15.0  # cost above the best prior's from which a prior is not tried, nats
WORTH = 8.0  # the same limit for the case of ASTRAY, nats


@dataclass(frozen=True)
class Tracker:
    """A figure, its view in the picture, a motion model over its freedoms, and settings.

    view   : of the scene in the marked frame
    slds   : covers every freedom of the figure
    offset : (D,) constants of this figure, added to the model's poses
    """

    figure: Figure
    view: View
    slds: SLDS
    offset: Array
    settings: Settings

    @cached_property
    def mode(self) -> Mode:
        """The mode of registration that the settings ask for."""
        return mode_of(self.settings)

    def templates_at(self, q: Array, image: Image, curve: Image, placed: Flags | None = None) -> Templates:
        """Templates cut from a picture at a pose (D,), see `tracker.registration.templates.cut`."""
        levels = self._levels(image, curve, self.box(q[None]))
        return cut(self.figure, self.view, q, levels, self.settings, placed)

    def step(
        self, state: State, image: Image, detections: Detections | None = None, place: Array | None = None
    ) -> tuple[State, Estimate]:
        """Follow the figure into the next frame; detections narrow the priors; `place` as in `with_scene`."""
        proposed, before = self.proposed(state.belief), state.outcome
        state = self.with_scene(state, image, self.pose(proposed.states), place)
        here = self.seen_by(state)
        if detections is not None:
            proposed = here.detected(proposed, detections)
        misfit = 0.0
        if self.settings.templates:
            state, found = here._registered(state, image, proposed, detections)
            misfit = float(found.misfit)
        else:
            pose = self.pose(proposed.merged()).mean
            gone = inside(self.figure, here.view, pose, image.shape[:2]) < LEAST_INSIDE
            state = replace(state, belief=proposed, outcome=Outcome.OUTSIDE if gone else Outcome.LOST)
        if detections is not None and state.outcome is Outcome.LOST:
            best = self.pose(state.belief.states[state.belief.best]).mean
            state = replace(state, outcome=judged_by_points(here._detector, detections, best, before))
        return state, replace(self.estimate(state), misfit=misfit)

    def detected(self, belief: Belief, detections: Detections) -> Belief:
        """The belief given the points of this frame, whose near and far leg may be exchanged.

        Points far from every prediction may be right or wrong: the pose that they show becomes a further
        hypothesis, which the templates judge.
        """
        best = belief.at([belief.best])
        factor = float(np.clip(WIDEST / np.diagonal(best.states.cov[0]).max(), 1.0, WIDER))
        wide = Gaussian(best.states.mean, factor * best.states.cov)
        cost = best.cost - np.log(ASTRAY / often(self.slds.fps))
        astray = replace(best, states=wide, cost=cost, wider=factor * best.wider)
        given = self._given(together([belief, astray]), detections)
        foreseen = range(len(belief.cost))
        dear = given.cost[-1] > given.cost[foreseen].min() + WORTH
        return (given.at(foreseen) if dear else given).levelled()

    def _given(self, belief: Belief, detections: Detections) -> Belief:
        """Every hypothesis given the points, as a mixture over their namings."""
        priors = self.pose(belief.states)
        given = self.conditioned(belief, priors, self._detector.namings(detections, priors))
        costs = enumerate(given.cost)
        return either([replace(belief, states=given.states[n], cost=cost) for n, cost in costs])

    def _registered(
        self, state: State, image: Image, proposed: Belief, detections: Detections | None
    ) -> tuple[State, Registration]:
        """The state after registration, and the registration of the best hypothesis."""
        priors = self.pose(proposed.states)
        levels = self._levels(image, state.curve, self._around(priors))
        # The points of a second count as at the usual rate.
        tempering = self.settings.tempering / often(self.slds.fps)
        settings = self.settings.model_copy(update={"tempering": tempering})
        field = Field(state.templates, levels, self.figure, self.view, settings, state.scenery)
        starts = None if state.outcome.measured else sought(field, priors, proposed.best)
        found = align(field, priors, starts)
        fused = self.conditioned(proposed, priors, found).levelled()
        best = found[fused.best]
        outcome = judged(field, state.outcome, priors.mean[proposed.best], best, image.shape[:2])
        if outcome.measured and detections is not None and denied(self._detector, detections, best.q):
            outcome = Outcome.LOST
        if outcome.measured:
            state = replace(state, belief=fused, templates=self._templates(state.templates, field, best))
        else:
            # Without a match there is no measurement.
            state = replace(state, belief=proposed)
        return replace(state, outcome=outcome), best

    def proposed(self, belief: Belief) -> Belief:
        """The priors of the next frame: one for each switching state that is tried."""
        return propose(self.slds, belief, prune=PRUNE, most=self.settings.hypotheses)

    def with_scene(self, state: State, image: Image, priors: Gaussian, place: Array | None = None) -> State:
        """The state with camera and background updated from a frame; the figure is in a pose of (H, D).

        A `place` of the camera, (3, 3) as in `tracker.picture.camera`, counts instead of the frame's own.
        """
        if state.camera is not None:
            around = self.seen_by(state)._around(priors)
            camera = state.camera.follow(image, around, place)
            state = replace(state, camera=camera, moved=self._moved(camera.place, priors.mean[0]))
        if state.backdrop is not None:
            around = self.seen_by(state)._around(priors)
            shift = np.zeros(2) if state.camera is None else state.camera.shift
            state = replace(state, backdrop=state.backdrop.follow(image, around, shift))
        return state

    def _templates(self, templates: Templates, field: Field, best: Registration) -> Templates:
        """The templates updated from the frame at the registered pose."""
        if not self.mode.learns:
            return templates
        blend = 1.0 - (1.0 - self.settings.blend) ** (1.0 / often(self.slds.fps))
        return templates.refreshed(field.seen(best), best.match, blend, best.offset)

    def seen_by(self, state: State) -> Self:
        """The tracker in a frame that shows the scene as the camera of this state has moved it."""
        return replace(self, view=self.view.moved(state.moved))

    def _moved(self, place: Array, q: Array) -> Array:
        """(3,) how a camera here shows the scene around a figure in a pose (D,), see `View.moved`."""
        zoom = 1.0 / float(np.hypot(place[0, 0], place[1, 0]))
        rest, away = self.view.to_pixels(q[:2]), q[:2] * self.view.axes
        here = np.linalg.solve(place, np.append(rest, 1.0))[:2]
        return np.append(here - rest + (1.0 - zoom) * away, zoom)

    def pose(self, states: Gaussian) -> Gaussian:
        """Beliefs over the state as beliefs over the full pose."""
        return states.through(self.slds.C, self.offset)

    def conditioned(self, belief: Belief, priors: Gaussian, told: Likelihood) -> Belief:
        """Every hypothesis, with pose (H, D), given its own or a common likelihood, with its cost.

        A leading axis of the likelihoods is one of the result.
        """
        vector = told.vector - told.information @ self.offset
        states = update_information(belief.states, self.slds.C, told.information, vector)
        away = told.q - priors.mean
        innovation = 0.5 * (away * np.linalg.solve(priors.cov, away[..., None])[..., 0]).sum(-1)
        spread = 0.5 * np.linalg.slogdet(np.eye(away.shape[-1]) + priors.cov @ told.information)[1]
        return replace(belief, states=states, cost=belief.cost + told.cost + innovation + spread)

    def estimate(self, state: State) -> Estimate:
        """The estimate of the frame that ended in this state."""
        belief = state.belief
        s = int(belief.s[belief.best])
        return Estimate(self.pose(belief.merged()), s, state.outcome, belief, state.moved)

    @property
    def _detector(self) -> Detector:
        return Detector(self.figure, self.view, self.settings)

    def _around(self, priors: Gaussian) -> Box:
        """Box of pixels that the figure may cover."""
        return self.box(priors.mean, reach(priors))

    def box(self, poses: Array, reach: Array | float = 0.0) -> Box:
        """Box of pixels around all poses (H, D), enlarged by `reach` (2,) leg lengths."""
        pixels = self.view.to_pixels(joints(self.figure, poses)).reshape(-1, 2)
        widest = max(link.half_width for link in self.figure.links)
        margin = self.view.unit * (max(self.settings.margin, widest) + np.asarray(reach))
        (x0, y0), (x1, y1) = pixels.min(0) - margin, pixels.max(0) + margin
        return float(x0), float(y0), float(x1), float(y1)

    def _levels(self, image: Image, curve: Image, around: Box) -> list[Level]:
        sigmas = [blur * self.view.unit for blur in self.settings.blurs]
        return pyramid(image, around, sigmas, self.mode.colour, curve)


def make_tracker(start: Start, slds: SLDS, settings: Settings) -> Tracker:
    """A tracker of this figure with a model of its root and angles; scale and lengths drift independently.

    Raises:
        ValueError: the model's freedoms are not the figure's.
    """
    figure = start.figure
    if slds.names != figure.learned_freedoms:
        raise ValueError(
            f"the model speaks of {', '.join(slds.names)}; the figure {figure.name!r} has "
            f"{', '.join(figure.learned_freedoms)}; learn a model for this figure, or take --model cv"
        )
    offset = np.zeros(len(figure.freedoms))
    if slds.labels != ("cv",):
        # Places of joints differ between skeletons, so models apply to an angle's deviation only.
        own = [figure.index(name) for name in figure.marked_offsets]
        offset[own] = start.q[own]
        slds = slds.with_constants(
            dict.fromkeys(figure.personal_angles, float(np.radians(settings.constant)))
        )
    full = _with_drifts(slds, figure.freedoms[len(slds.names) :], settings)
    return Tracker(figure, start.view, full, offset, settings)


def _with_drifts(slds: SLDS, names: Sequence[str], settings: Settings) -> SLDS:
    """The model with further freedoms appended: ankles, common scale and stretches, in this order."""
    ankles, n = names.index(SCALE), len(names)
    stretches = n - ankles - 1
    frames = USUAL / slds.fps
    keep = np.r_[np.full(ankles, ANKLE_KEEP), 1.0, np.full(stretches, BREATH_KEEP)] ** frames
    spread = np.r_[np.full(ankles, np.radians(settings.ankle)), 1e-3, np.full(stretches, settings.breathing)]
    noise = spread * np.sqrt(1.0 - keep**2)
    noise[ankles] = settings.scale_drift * np.sqrt(frames)
    return slds.with_drifts(names, keep, noise, spread)
