"""The job from a user's options: marks read from a table, or a start found in the film."""

from dataclasses import replace
from pathlib import Path

from kinematics.figure_file import load_figure
from tracker.clip.job import Following, Job, OptionsError, bare_name, towards
from tracker.foreign.start_marks import read_marks
from tracker.models.find import find_model
from tracker.progress import Progress
from tracker.settings import Settings
from tracker.tables.keypoints import Marks, read_keypoints
from videos.frames import Video


def asked(
    how: Following, video: Path, keypoints: Path | None, settings: Settings | None, progress: Progress
) -> Job:
    """The job that the options describe, started from the marks or, without marks, from the person found.

    Raises:
        OptionsError: options that cannot be combined.
        FoundError: the film gives no reliable start.
        KeypointsError, ForeignError: a file of marks that cannot be used.
        VideoError: the film cannot be read.
        ValueError: as `Following.job`.
    """
    figure = load_figure(how.figure)
    if keypoints is not None:
        when = (how.start, towards(how.facing), how.from_ or 0, how.stop)
        marks, taken = read_marks(keypoints, *when, figure)
        if taken and how.anchors:
            raise OptionsError(
                "anchors are the marked frames of a keypoints table; another program's file gives one frame"
            )
        if taken:
            counted = " Pictures are counted from 0, whatever their names." if video.is_dir() else ""
            progress.note(taken + counted)
        return how.job(video, marks, settings)
    if not figure.outline:
        raise ValueError(
            f"a {figure.name} is not found by itself; mark one frame with 'figtrack annotate --figure "
            f"{how.figure}' and give --keypoints"
        )
    if how.start is not None or how.anchors:
        raise OptionsError("start and anchors are of marked frames; give keypoints, or leave them out")
    from tracker.clip.found import people, start_of  # slow to import

    film = Video(video, how.rate or 1.0)
    # Errors in the options are raised before the search of the film, which takes longer.
    find_model(how.model, film.fps, how.tuned(settings), figure)
    everybody = people(film, progress, how.from_ or 0, how.stop, towards(how.facing))
    # In a part, or with their facing given, people may come in another order than that of their numbers.
    otherwise = how.from_ is not None or how.stop is not None or how.facing is not None
    listed = people(film, progress) if how.person is not None and otherwise else None
    found = start_of(everybody, how, film, listed)
    of_figure = {name: mark for name, mark in found.marks.items() if name in figure.marks}
    return how.job(video, replace(found, marks=of_figure), settings)


def marks_in(table: Path, how: Following) -> Marks:
    """The marks of the followed figure in a table; raises KeypointsError, ValueError."""
    figure = load_figure(how.figure)
    return read_keypoints(table, figure.marks, figure.joints)


def suggestion_path(folder: Path, video: Path) -> Path:
    """The file for marks of an uncertain start, beside other results: `track` leaves it to `annotate`."""
    return folder / f"{bare_name(video)}.suggested.keypoints.csv"
