"""The differences between the papers' registration and the full one."""

from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array
from kinematics.figure import Figure
from tracker.settings import Settings

LIMIT_GIVE = float(np.radians(3.0))  # standard deviation by which a joint passes its limit
COARSE = 2  # every such point is used on coarse blurs, where neighbours are alike


@dataclass(frozen=True)
class Mode:
    """How templates are cut, compared with a picture and registered.

    The defaults are the registration of Pavlović et al. (1999): grey templates of the first frame, squared
    loss, and a prior in the climb for the lengths only, which the papers' figure kept fixed.

    colour    : whether pictures have Lab channels; else three times the lightness
    contrast  : how far grey levels around the figure are spread
    rim       : width of the template beyond a link's outline, leg lengths
    backdrop  : whether the scene behind the figure is modelled
    learns    : whether templates are updated
    coarse    : every such point is used on all but the finest blur
    robust    : squared scale of the robust loss, in units of the noise; inf for plain squares
    layered   : whether nearer links hide farther ones, and each link has a brightness offset
    covered   : prior odds that something which looks like the scene without the figure covers a point
    stiffness : of joints at their limits, per radian squared
    posed     : whether the climb includes the prior of the whole pose, not of the lengths only
    """

    colour: bool = False
    contrast: float = 0.0
    rim: float = 0.0
    backdrop: bool = False
    learns: bool = False
    coarse: int = 1
    robust: float = np.inf
    layered: bool = False
    covered: float = 0.0
    stiffness: float = 0.0
    posed: bool = False

    def precision(self, cov: Array, figure: Figure) -> Array:
        """(H, D, D) precision of the prior in a climb, for priors of covariance (H, D, D)."""
        first = 0 if self.posed else figure.layout.scale
        precision = np.zeros_like(cov)
        precision[:, first:, first:] = np.linalg.inv(cov[:, first:, first:])
        return precision


def mode_of(settings: Settings) -> Mode:
    """The mode for these settings.

    The full one has colour templates, models hidden and covered points, is robust, with all of the prior.
    """
    if settings.mode == "classic":
        return Mode()
    return Mode(
        colour=True,
        contrast=settings.contrast,
        rim=settings.rim,
        backdrop=settings.backdrop and settings.templates,
        learns=True,
        coarse=COARSE,
        robust=settings.robust**2,
        layered=True,
        covered=settings.covered,
        stiffness=float(1.0 / LIMIT_GIVE**2),
        posed=True,
    )
