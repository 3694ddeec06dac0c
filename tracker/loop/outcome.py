"""What a frame of a followed clip came to."""

from enum import StrEnum


class Outcome(StrEnum):
    """What became of a frame, as pose.csv and reports name it."""

    OK = "ok"  # the figure was found, every link in view
    HIDDEN = "hidden"  # the figure was found, a link is covered
    FOUND = "found"  # the first frame in which the figure is found after frames in which it was not
    LOST = "lost"  # nothing matched
    OUTSIDE = "outside"  # most of the figure is out of the picture

    @property
    def measured(self) -> bool:
        """Whether the picture said where the figure is, or the motion went on alone."""
        return self not in (Outcome.LOST, Outcome.OUTSIDE)
