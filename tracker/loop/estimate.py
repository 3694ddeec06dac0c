"""What a frame came to, and what the loop carries to the next."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from dynamics.belief import Belief
from dynamics.gaussian import Array, Gaussian
from tracker.loop.outcome import Outcome
from tracker.picture.backdrop import UNSEEN, Backdrop, Scenery
from tracker.picture.camera import Camera
from tracker.picture.pyramid import Image
from tracker.registration.templates import Templates

NOTHING = Belief(
    Gaussian(np.zeros((0, 0)), np.zeros((0, 0, 0))), np.zeros(0), np.zeros(0, np.intp), np.zeros(0, np.intp)
)


@dataclass(frozen=True)
class Estimate:
    """What one frame came to.

    pose    : belief over the full pose, mean (D,), cov (D, D)
    s       : most probable switching state
    belief  : the hypotheses it was merged from
    shift   : (2,) pixels by which a moving camera has shifted the scene since the marked frame
    misfit  : of the picture at the best of them, see `Registration`; 0 where the pose was marked
    began   : whether the filter began here, so that nothing links it to the frame before
    back    : at an anchor, the frames since the one before it as the way back from it has them, oldest first
    """

    pose: Gaussian
    s: int
    outcome: Outcome
    belief: Belief
    shift: Array
    misfit: float = 0.0
    began: bool = False
    back: tuple[Self, ...] = ()


@dataclass(frozen=True)
class State:
    """What the loop carries from frame to frame.

    curve    : (256,) what grey levels become
    camera   : None where it is taken for still
    backdrop : None where what lies behind the figure is left out of account
    outcome  : of the last frame
    """

    belief: Belief
    templates: Templates
    curve: Image
    camera: Camera | None
    backdrop: Backdrop | None
    outcome: Outcome = Outcome.OK

    @property
    def shift(self) -> Array:
        """(2,) pixels by which the camera has shifted the scene since the marked frame."""
        return np.zeros(2) if self.camera is None else self.camera.shift

    @property
    def scenery(self) -> Scenery:
        """How much the last frame differs from what lies behind the figure."""
        return UNSEEN if self.backdrop is None else self.backdrop.scenery
