"""What sets the papers' registration apart from the full one."""

from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array
from kinematics.figure import Figure
from tracker.settings import Settings

LIMIT_GIVE = float(np.radians(3.0))  # how sharply a joint stops at its limit
COARSE = 2  # every so manieth point is looked at where the blur makes neighbours alike


@dataclass(frozen=True)
class Mode:
    """How looks are cut, laid on a picture and climbed.

    The defaults are the registration of Pavlović et al. (1999): grey templates of the first frame, plain
    squares, no prior in the climb but on the lengths, which the papers' figure did not leave free.

    colour    : whether a picture has Lab's channels; else three times the lightness
    contrast  : how far grey levels around the figure are spread
    rim       : of template beyond a link's outline, leg lengths
    backdrop  : whether the scene behind the figure is kept
    learns    : whether looks follow what is seen of them, unknown ones where a link stands out
    coarse    : every so manieth point is looked at on all but the finest blur
    robust    : squared scale of the robust loss, in units of the noise; inf for plain squares
    layered   : whether nearer links hide farther ones, and each link has a brightness offset
    covered   : prior odds that what is seen as it was without the figure covers it
    stiffness : of joints at their limits, per radian squared
    posed     : whether the climb leans on the prior of the whole pose, not of the lengths alone
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
        """(H, D, D) by which a climb leans on priors of covariance (H, D, D)."""
        first = 0 if self.posed else figure.layout.scale
        precision = np.zeros_like(cov)
        precision[:, first:, first:] = np.linalg.inv(cov[:, first:, first:])
        return precision


def mode_of(settings: Settings) -> Mode:
    """The mode that the settings ask for.

    The full one takes templates in colour that know what hides and covers them, is robust, and leans on the
    prior.
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
