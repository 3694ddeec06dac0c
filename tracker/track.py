"""The loop: propose, align, fuse; one frame at a time.

Pavlović et al. (1999), section 4.2. Each frame every switching state proposes the prior of its best
predecessor; local registration climbs from each to a measurement; the Kalman filter fuses the two, with that
frame's own information. A hypothesis costs what its predecessor cost, the switch, and minus the log evidence
of its measurement: with the likelihood linearised at the mode q* (Laplace),

    image(q*) + (q* - m)' P^-1 (q* - m) / 2 + log |I + P L| / 2

With a one-state constant-velocity model the same loop is the extended Kalman filter.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynamics.belief import Belief, first_belief, propose
from dynamics.gaussian import Gaussian, apply, symmetric, transpose
from dynamics.kalman import update_information
from dynamics.slds import SLDS
from kinematics.figure import SCALE, Figure
from kinematics.recover import Start
from kinematics.spm import View, joints
from tracker.registration import Registration, align, seen
from tracker.sampling import Array, Level, pyramid
from tracker.settings import Settings
from tracker.template import Templates, cut

Image = NDArray[np.uint8]

OK, HIDDEN, LOST, OUTSIDE = "ok", "hidden", "lost", "outside"


@dataclass(frozen=True)
class Estimate:
    """What one frame came to.

    pose    : belief over the full pose, mean (D,), cov (D, D)
    s       : most probable switching state
    outcome : ok, hidden (a leg is covered), lost (nothing matches) or outside (most of it out of the frame)
    belief  : the hypotheses it was merged from
    """

    pose: Gaussian
    s: int
    outcome: str
    belief: Belief


@dataclass(frozen=True)
class State:
    """What the loop carries from frame to frame."""

    belief: Belief
    templates: Templates


@dataclass(frozen=True)
class Tracker:
    """A figure, where it stands in the picture, a motion model over its freedoms, and settings.

    slds   : speaks of every freedom of the figure
    offset : (D,) what the model's poses lack: the neck's own constant
    """

    figure: Figure
    view: View
    slds: SLDS
    offset: Array
    settings: Settings

    def begin(self, start: Start, image: Image) -> tuple[State, Estimate]:
        """Belief and templates from the marked frame."""
        settings, D = self.settings, len(start.q)
        noise = np.full(D, np.radians(settings.start_angle))
        noise[:2] = settings.start_place
        noise[self.figure.index(SCALE) :] = settings.start_length
        y = np.where(start.known, start.q - self.offset, np.nan)
        belief = first_belief(self.slds, y, np.diag(noise**2))
        levels = self._levels(image, start.q[None])
        templates = cut(self.figure, self.view, start.q, levels, settings)
        return State(belief, templates), self._estimate(belief, OK)

    def step(self, state: State, image: Image) -> tuple[State, Estimate]:
        """One frame on."""
        proposed = propose(self.slds, state.belief, prune=self.settings.prune)
        priors = self.pose(proposed.states)
        levels = self._levels(image, priors.mean)
        found = align(state.templates, levels, self.figure, self.view, priors, self.settings)
        belief = self._fused(proposed, priors, found)
        best = found[belief.best]
        estimate = self._estimate(belief, self._outcome(state, best))
        templates = state.templates
        if self.settings.mode == "full" and estimate.outcome not in (LOST, OUTSIDE):
            now = seen(templates, levels, self.figure, self.view, best)
            templates = templates.refreshed(now, best.match, self.settings.blend)
        return State(belief, templates), estimate

    def pose(self, states: Gaussian) -> Gaussian:
        """Beliefs over the state as beliefs over the full pose."""
        C = self.slds.C
        return Gaussian(apply(C, states.mean) + self.offset, symmetric(C @ states.cov @ transpose(C)))

    def _fused(self, proposed: Belief, priors: Gaussian, found: list[Registration]) -> Belief:
        C, eye = self.slds.C, np.eye(len(self.offset))
        means, covs, costs = [], [], []
        for h, r in enumerate(found):
            vector = r.vector - r.information @ self.offset
            posterior = update_information(proposed.states[h], C, r.information, vector)
            away, P = r.q - priors.mean[h], priors.cov[h]
            innovation = 0.5 * away @ np.linalg.solve(P, away)
            spread = 0.5 * np.linalg.slogdet(eye + P @ r.information)[1]
            means.append(posterior.mean)
            covs.append(posterior.cov)
            costs.append(proposed.cost[h] + r.cost + innovation + spread)
        cost = np.array(costs)
        return Belief(
            Gaussian(np.stack(means), np.stack(covs)), cost - cost.min(), proposed.s, proposed.parent
        )

    def _estimate(self, belief: Belief, outcome: str) -> Estimate:
        return Estimate(self.pose(belief.merged()), int(belief.s[belief.best]), outcome, belief)

    def _outcome(self, state: State, found: Registration) -> str:
        templates = state.templates
        inner = (templates.weight == 1.0) & templates.known
        if found.inside < self.settings.least_inside:
            return OUTSIDE
        visible = inner & (found.match > 0)
        if not visible.any() or found.match[visible].mean() < self.settings.least_match:
            return LOST
        share = [visible[inner & (templates.link == i)].mean() for i in np.unique(templates.link[inner])]
        return HIDDEN if min(share) < self.settings.least_visible else OK

    def _levels(self, image: Image, poses: Array) -> list[Level]:
        unit = self.view.unit
        pixels = self.view.to_pixels(joints(self.figure, poses)).reshape(-1, 2)
        H, W = image.shape[:2]
        low = np.clip(pixels.min(0) - self.settings.margin * unit, 0, (W - 2, H - 2)).astype(int)
        high = np.clip(pixels.max(0) + self.settings.margin * unit, low + 2, (W, H)).astype(int)
        colour = self.settings.mode == "full"
        box = (int(low[0]), int(low[1]), int(high[0]), int(high[1]))
        return pyramid(image, box, [blur * unit for blur in self.settings.blurs], colour)


def make_tracker(start: Start, slds: SLDS, settings: Settings) -> Tracker:
    """A tracker of this figure with a model of its root and angles; scale and lengths drift by themselves.

    Raises:
        ValueError: the model was learned on other freedoms than the figure has.
    """
    figure = start.figure
    if slds.names != figure.pose_freedoms[: len(slds.names)]:
        raise ValueError(
            f"the model speaks of {', '.join(slds.names)}; the figure {figure.name!r} has "
            f"{', '.join(figure.pose_freedoms)}; learn a model for this figure"
        )
    learned = slds.labels != ("cv",)
    full = _with_drifts(slds, figure.freedoms[len(slds.names) :], settings)
    offset = np.zeros(len(figure.freedoms))
    if learned and "neck" in figure.freedoms:
        # Where "the neck" lies differs between skeletons; models know the head's deviation only.
        offset[figure.index("neck")] = start.q[figure.index("neck")]
    return Tracker(figure, start.view, full, offset, settings)


def _with_drifts(slds: SLDS, names: Sequence[str], settings: Settings) -> SLDS:
    """The model with the freedoms it does not know: ankles, common scale and stretches, in this order."""
    ankles, n = names.index(SCALE), len(names)
    stretches = n - ankles - 1
    keep = np.r_[np.full(ankles, settings.ankle_keep), 1.0, np.full(stretches, settings.breath)]
    spread = np.r_[np.full(ankles, np.radians(settings.ankle)), 1e-3, np.full(stretches, settings.breathing)]
    noise = spread * np.sqrt(1.0 - keep**2)
    noise[ankles] = settings.scale_drift
    return slds.with_drifts(names, keep, noise, spread)


def run(tracker: Tracker, start: Start, images: Iterable[Image]) -> Iterator[Estimate]:
    """Follow the figure through images, the first of which is the marked one; one estimate an image."""
    state: State | None = None
    for image in images:
        if state is None:
            state, estimate = tracker.begin(start, image)
        else:
            state, estimate = tracker.step(state, image)
        yield estimate
