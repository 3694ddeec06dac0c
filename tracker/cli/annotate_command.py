"""Commands with people and pages: finding walkers, marking, correcting, the page of a folder."""

from pathlib import Path
from typing import Annotated

import typer

from tracker.annotate.wanted import NoBrowser, Port, Request
from tracker.cli.options import Common, Shown, Video, beside
from tracker.clip.job import Following, Job
from tracker.progress import Progress


def annotate(request: Request, *, shown: Shown) -> None:
    """Mark the joints of one frame or more in a browser page.

    It opens with a suggestion where nothing is marked yet.

    Example: figtrack annotate walk.mp4 --frame 12
    """
    from tracker.annotate.launch import mark

    mark(request, shown.shown())


def correct(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run of 'figtrack track'.")],
    *,
    frame: Annotated[
        int | None,
        typer.Option(min=0, help="The frame shown first [default: the one that the run started from]."),
    ] = None,
    port: Port = 0,
    no_browser: NoBrowser = False,
    shown: Shown,
) -> None:
    """Correct a run in a browser page and follow it again.

    The run is replaced once the new one is complete.

    Example: figtrack correct walk-track
    """
    from tracker.annotate.launch import correct as put_right

    put_right(folder, frame, port, not no_browser, shown.shown())


def app(
    folder: Annotated[
        Path, typer.Argument(help="A folder of films [default: the one that one is in].")
    ] = Path(),
    *,
    port: Port = 0,
    no_browser: NoBrowser = False,
) -> None:
    """Do most of this for a folder of films in a browser page.

    The page runs the commands that find, follow, correct and export; results lie beside the films.

    Example: figtrack app films
    """
    from tracker.desk.desk_page import open_desk

    open_desk(folder, port, not no_browser)


def find(
    video: Video,
    *,
    out: Annotated[
        Path | None, typer.Option(help="The table, a PNG beside it [default: VIDEO-people.csv].")
    ] = None,
    common: Common,
) -> None:
    """List the people who walk through a film, and their directions.

    Example: figtrack find walk.mp4
    """
    from tracker.clip.found import people
    from tracker.report.walkers import listed, write_people, write_picture
    from tracker.run.folder import FolderError, check_file, fresh_file
    from videos.frames import Video as Film
    from videos.frames import files_of

    table = out or Path(f"{beside(video, 'people')}.csv")
    picture = table.with_suffix(".png")
    if picture == table:
        raise FolderError(f"table and picture would be one file, {table}; choose another --out")
    film, read = Film(video), files_of(video)
    with fresh_file(table, overwrite=common.overwrite, inputs=read) as aside:
        check_file(picture, common.overwrite, read)
        everybody = people(film, common.shown())
        write_people(aside, everybody)
        if everybody:
            with fresh_file(picture, overwrite=common.overwrite, inputs=read) as drawn:
                write_picture(drawn, everybody, film)
        elif common.overwrite:
            picture.unlink(missing_ok=True)  # of an earlier table
    print(listed(everybody, video.name))


def job_of(how: Following, video: Path, keypoints: Path | None, folder: Path, progress: Progress) -> Job:
    """The job that the options describe; marks of an unreliable start are left beside the results."""
    from tracker.clip.asked import asked, suggestion_path
    from tracker.clip.start import FoundError
    from tracker.run.folder import fresh_file
    from tracker.tables.keypoints import write_marks

    try:
        return asked(how, video, keypoints, None, progress)
    except FoundError as error:
        if error.suggested is None:
            raise
        path = suggestion_path(folder.parent, video)
        with fresh_file(path, overwrite=True, inputs=[video]) as aside:
            write_marks(aside, error.suggested)
        raise FoundError(f"{error}; {path} has what it would have started from") from error
