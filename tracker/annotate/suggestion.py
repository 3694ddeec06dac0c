"""The suggested joints with which the marking page opens if there are no marks; slow to import."""

from pathlib import Path

from kinematics.figure import Figure
from tracker.clip.asked import suggestion_path
from tracker.clip.found import TURNED, people
from tracker.clip.naming import marks_of, nearer, sure_of_leg
from tracker.foreign.start_marks import Taken
from tracker.outline.person import Person
from tracker.progress import Progress
from tracker.tables.keypoints import KEYPOINTS, read_keypoints
from videos.frames import Video

CHECK = "check every joint, and which leg is nearer"
UNSURE = " (not sure)"


def suggested(
    video: Path, table: Path, figure: Figure, facing: int | None, progress: Progress
) -> Taken | None:
    """The marks that 'figtrack track' left beside the table, else the surest person in the film, else None.

    `facing` is that of the person, +1 right, -1 left, None to find it. KeypointsError, VideoError: a file
    that cannot be read.
    """
    left = suggestion_path(table.parent, video)
    if left.exists():
        marks = read_keypoints(left, figure.marks, KEYPOINTS)
        frame = min(marks)
        return Taken(frame, marks[frame], f"frame {frame} has the suggestion of {left.name}: {CHECK}")
    everybody = people(Video(video), progress, facing=facing)
    if not everybody:
        return None
    one = everybody[0]
    of_figure = {name: mark for name, mark in marks_of(one).items() if name in figure.marks}
    return Taken(one.frame, of_figure, _told(one, len(everybody)))


def _told(one: Person, people: int) -> str:
    who = "the person who walks" if people == 1 else f"the surest of {people} people who walk"
    way = "right" if one.facing > 0 else "left"
    return (
        f"frame {one.frame} has a suggestion, {who} through the film: "
        f"faces {way}{'' if one.turned >= TURNED else UNSURE}, "
        f"the near leg {nearer(one)}{'' if sure_of_leg(one) else UNSURE}; {CHECK}"
    )
