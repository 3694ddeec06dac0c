"""The outcome of a frame of a followed clip."""

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
