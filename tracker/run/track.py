"""A figure followed through a clip."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array, transpose
from kinematics.figure import Figure
from kinematics.spm import View, joint_jacobian, joints
from tracker.loop.outcome import Outcome

FREE = "free"  # label of the switching state for motion that the learned ones do not foresee


@dataclass(frozen=True)
class Track:
    """A figure followed through the frames first .. first + T - 1 of a clip.

    figure, view : with this person's lengths, and where it stood at the start, root in the scene's frame
    model   : name of the motion model; `labels` (K,) of its switching states
    first   : frame of the first row
    times   : (T,) seconds
    q, cov  : (T, D) and (T, D, D) belief over the pose; covariances in single precision
    s       : (T,) most probable switching state
    gait    : one of `labels` that the figure's outline shows over the whole film, "" where none is known
    outcome : (T,) of each frame
    shift   : (T, 2) pixels by which a moving camera has shifted the scene since the start
    mark    : leg lengths, standard deviation of a marked joint's place on its links: no frame tells of it
    """

    figure: Figure
    view: View
    model: str
    labels: tuple[str, ...]
    first: int
    times: Array
    q: Array
    cov: Array
    s: NDArray[np.intp]
    outcome: tuple[Outcome, ...]
    shift: Array
    mark: float
    gait: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "outcome", tuple(map(Outcome, self.outcome)))

    def __len__(self) -> int:
        return len(self.q)

    @property
    def measured(self) -> NDArray[np.bool_]:
        """(T,) whether the picture said where the figure is."""
        return np.array([outcome.measured for outcome in self.outcome])

    def motion(self, t: int) -> str:
        """What row t shows: the label of its state, or where that is free, of what the outline shows."""
        label = self.labels[self.s[t]]
        return self.gait if label == FREE and self.gait else label

    def view_at(self, t: int) -> View:
        """How the picture of row t shows body coordinates."""
        return self.view.shifted(self.shift[t])

    def joints(self) -> Array:
        """(T, J, 2) pixels, in the order of `figure.joints`."""
        return np.stack([self.view_at(t).to_pixels(joints(self.figure, q)) for t, q in enumerate(self.q)])

    def joint_covs(self) -> Array:
        """(T, J, 2, 2) covariance of each joint, px^2: the pose's, and that of its mark on the links."""
        out, marked = [], (self.mark * self.view.unit) ** 2 * np.eye(2)
        for q, cov in zip(self.q, self.cov, strict=True):
            J = joint_jacobian(self.figure, q) * self.view.axes[:, None]
            out.append(J @ cov @ transpose(J) + marked)
        return np.stack(out)
