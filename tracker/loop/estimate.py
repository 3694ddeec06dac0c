"""The result of a frame, and the state that the loop passes to the next frame."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from dynamics.belief import Belief
from dynamics.gaussian import Array, Gaussian
from kinematics.spm import UNMOVED
from tracker.loop.outcome import Outcome
from tracker.picture.backdrop import UNSEEN, Backdrop, Scenery
from tracker.picture.camera import Camera
from tracker.picture.pyramid import Image
from tracker.registration.templates import Templates

NOTHING = Belief(
    Gaussian(np.zeros((0, 0)), np.zeros((0, 0, 0))),
    cost=np.zeros(0),
    s=np.zeros(0, np.intp),
    parent=np.zeros(0, np.intp),
    wider=np.zeros(0),
)


@dataclass(frozen=True)
class Estimate:
    """The result of one frame.

    pose    : belief over the full pose, mean (D,), cov (D, D)
    s       : most probable switching state
    belief  : the hypotheses from which `pose` was merged
    moved   : (3,) how a moving camera has moved the scene since the marked frame, see `View.moved`
    misfit  : of the picture at the best of them, see `Registration`; 0 where the pose was marked
    began   : whether the filter started here, without any link to the frame before
    repeats : whether the picture is the one before again, so that nothing has moved
    back    : at an anchor, estimates of the frames since the last anchor by the pass back, in its order
    """

    pose: Gaussian
    s: int
    outcome: Outcome
    belief: Belief
    moved: Array
    misfit: float = 0.0
    began: bool = False
    repeats: bool = False
    back: tuple[Self, ...] = ()


@dataclass(frozen=True)
class State:
    """What the loop carries from frame to frame.

    curve    : (256,) tone curve of grey levels
    camera   : None if it is assumed still
    moved    : (3,) how it has moved the scene around the figure since the marked frame, see `View.moved`
    backdrop : None if the scene behind the figure is not modelled
    outcome  : of the last frame
    """

    belief: Belief
    templates: Templates
    curve: Image
    camera: Camera | None
    backdrop: Backdrop | None
    outcome: Outcome = Outcome.OK
    moved: Array = field(default_factory=lambda: UNMOVED)

    @property
    def scenery(self) -> Scenery:
        """How much the last frame differs from the scene behind the figure."""
        return UNSEEN if self.backdrop is None else self.backdrop.scenery
