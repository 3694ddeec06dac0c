"""Joints that a pose network detected, as a doubted measurement of the pose.

The error of a detected point z about its joint p(q) has a Student t of FREEDOM degrees in the plane, so that
outliers have little influence (Lange, Little and Taylor, 1989), in leg lengths:

    -log p(z | q) = (n + 2) / 2 log(1 + |z - p(q)|^2 / (n sigma^2)) + constant

and in some frames the network names the legs the wrong way round or puts both on one of them, with a
probability of its own. Under each naming each prior climbs to a mode, where the likelihood is linearised (the
iterated extended Kalman filter with the weights of EM): joints without a point measure nothing.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from dynamics.gaussian import Array, Gaussian, Ints, apply
from kinematics.figure import Figure
from kinematics.spm import View, joint_jacobian, joints
from tracker.registration.chain_rule import FREEDOM, settled
from tracker.registration.field import Likelihood
from tracker.settings import Settings

PULLS = 0.1  # share of the full weight, six standard deviations off, below which a point does not count
FARTHEST = 0.5  # prior spread of each freedom in a step to the points, leg lengths, radians or log units
EXCHANGED = 1  # among `Detections.ways`


@dataclass(frozen=True)
class Detections:
    """The points of one frame.

    joint  : (J,) positions in `figure.joints`
    pixels : (J, 2) of that frame
    doubt  : factor on the spread of the settings
    """

    joint: Ints
    pixels: Array
    doubt: float = 1.0

    @classmethod
    def of(cls, figure: Figure, names: tuple[str, ...], places: Array) -> Self:
        """The named places (J, 2) whose joints the figure has; NaN places are left out."""
        known = [
            (figure.joints.index(name), place)
            for name, place in zip(names, places, strict=True)
            if name in figure.joints and np.isfinite(place).all()
        ]
        return cls(
            np.array([joint for joint, _ in known], dtype=np.intp),
            np.array([place for _, place in known]).reshape(-1, 2),
        )

    def named(self, figure: Figure, other: Figure) -> Self:
        """The points of one figure as those of another, which may lack joints, by the joints' names."""
        names = tuple(figure.joints[joint] for joint in self.joint)
        return replace(self.of(other, names, self.pixels), doubt=self.doubt)

    def ways(self, figure: Figure) -> Ints:
        """(W, J) `joint` as named, with the legs exchanged, all on the near leg and all on the far leg."""
        joint, twin = self.joint, figure.joint_twins[self.joint]
        return np.stack([joint, twin, np.minimum(joint, twin), np.maximum(joint, twin)])


@dataclass(frozen=True)
class Detector:
    """The measurement model of a pose network for a figure.

    view  : of the frame that the points are of
    doubt : factor on the spread of the settings
    """

    figure: Figure
    view: View
    settings: Settings
    doubt: float = 1.0

    def namings(self, found: Detections, priors: Gaussian) -> Likelihood:
        """The likelihood for H priors of the pose of each of `Detections.ways` (W, ...), with prior costs."""
        doubted = replace(self, doubt=found.doubt)
        joint, place = found.ways(self.figure), self.view.to_body(found.pixels)
        layout, spread = self.figure.layout, doubted._spread
        q, information, gradient, away = settled(layout, priors, joint, place, spread)
        cost = doubted._cost(away) + self._prices[:, None]
        return Likelihood(q, information, apply(information, q) - gradient, cost)

    def agreement(self, found: Detections, q: Array) -> tuple[float, bool]:
        """How well the points agree with a pose (D,) under the best fitting naming of the legs.

        Returns:
            The mean match of the points, 1 if each is at its joint, 0 far off or without points; and whether
            every joint of the figure has a point of enough weight.
        """
        ways = found.ways(self.figure)
        matches = self._matches(self._away(ways, found.pixels, q))
        best = int(np.argmax(matches.sum(-1)))
        whole = len(set(ways[best, matches[best] > PULLS])) == len(self.figure.joints)
        return float(matches[best].sum()) / max(len(found.joint), 1), whole

    def elsewhere(self, found: Detections, q: Array) -> Array:
        """(D, D) increase of the covariance of a pose (D,) where the points show another pose.

        With the probability p, one minus the mean match, the figure is where the points show it, a step d
        away: the second moment about the pose grows by p d d'. The step is a Gauss-Newton step.
        """
        if not len(found.joint):
            return np.zeros((len(q), len(q)))
        away = self._away(found.joint, found.pixels, q)
        wrong = 1.0 - float(self._matches(away).mean())
        J = joint_jacobian(self.figure, q)[found.joint].reshape(-1, len(q)) / self._spread
        step = np.linalg.solve(J.T @ J + np.eye(len(q)) / FARTHEST**2, -J.T @ away.ravel() / self._spread)
        return np.asarray(wrong * np.outer(step, step))

    def misnamed(self, found: Detections, q: Array) -> bool:
        """Whether the points fit a pose (D,) best with near and far leg exchanged."""
        away = self._away(found.ways(self.figure), found.pixels, q)
        return int(np.argmin(self._cost(away) + self._prices)) == EXCHANGED

    def _matches(self, away: Array) -> Array:
        """(..., J) match of points (..., J, 2) away from their joints: 1 at the joint, 0 far off."""
        return np.asarray(1.0 / (1.0 + self._squares(away) / FREEDOM))

    @property
    def _prices(self) -> Array:
        """(W,) minus the log of the probability of each of `Detections.ways`, nats."""
        rare = [self.settings.exchange, self.settings.one_leg / 2.0, self.settings.one_leg / 2.0]
        return np.asarray(-np.log([1.0 - sum(rare), *rare]))

    def _cost(self, away: Array) -> Array:
        """(...) minus the log likelihood of points that are (..., J, 2) away from their joints, nats."""
        return np.asarray(0.5 * (FREEDOM + 2.0) * np.log1p(self._squares(away) / FREEDOM).sum(-1))

    def _away(self, joint: Ints, pixels: Array, q: Array) -> Array:
        """(..., J, 2) vectors from points (J, 2) to the joints (..., J) of a pose (D,), leg lengths."""
        return np.asarray(joints(self.figure, q)[joint] - self.view.to_body(pixels))

    def _squares(self, away: Array) -> Array:
        """(..., J) squared lengths of vectors (..., J, 2), in units of the spread."""
        return np.asarray((away**2).sum(-1) / self._spread**2)

    @property
    def _spread(self) -> float:
        return self.settings.point * self.doubt
