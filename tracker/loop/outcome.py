"""The outcome of a frame of a followed clip."""

from collections.abc import Sequence
from enum import StrEnum


class Outcome(StrEnum):
    """The outcome of a frame, as named in pose.csv and reports."""

    OK = "ok"  # the figure was found, every link in view
    HIDDEN = "hidden"  # the figure was found, a link is covered or looks like the scene behind it
    FOUND = "found"  # the first frame in which the figure is found after frames in which it was not
    LOST = "lost"  # nothing matched
    OUTSIDE = "outside"  # most of the figure is out of the picture

    @property
    def measured(self) -> bool:
        """Whether the picture measured the pose; otherwise the motion model predicted it."""
        return self not in (Outcome.LOST, Outcome.OUTSIDE)


def in_time(outcomes: Sequence[Outcome]) -> tuple[Outcome, ...]:
    """The outcomes of successive frames, of which some may have been judged backwards in time: FOUND is what
    follows frames in which the figure was not found."""
    before = (Outcome.OK, *outcomes)
    return tuple(
        Outcome.FOUND if now.measured and not last.measured else Outcome.OK if now is Outcome.FOUND else now
        for last, now in zip(before, outcomes, strict=False)
    )
