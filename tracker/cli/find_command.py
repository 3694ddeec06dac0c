"""The command that says who walks through a film, and what is left where a start is not sure."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from tracker.cli.options import Common, Video, beside


def find(
    video: Video,
    *,
    out: Annotated[
        Path | None, typer.Option(help="The table, a PNG beside it [default: VIDEO-people.csv].")
    ] = None,
    common: Common,
) -> None:
    """Say who walks through a film, and which way.

    Example: figtrack find walk.mp4
    """
    from tracker.clip.found import people
    from tracker.report.walkers import told, write_people, write_picture
    from tracker.run.folder import fresh_file
    from videos.frames import Video as Film

    table = out or Path(f"{beside(video, 'people')}.csv")
    film = Film(video)
    picture = table.with_suffix(".png")
    with fresh_file(table, overwrite=common.overwrite, inputs=[video]) as aside:
        everybody = people(film, common.shown())
        write_people(aside, everybody)
        if not everybody and common.overwrite:
            picture.unlink(missing_ok=True)  # of an earlier table
        if everybody:
            with fresh_file(picture, overwrite=common.overwrite, inputs=[video]) as drawn:
                write_picture(drawn, everybody, film)
    print(told(everybody, video.name))


@contextmanager
def suggestion(video: Path, folder: Path) -> Iterator[None]:
    """Where no start can be had for sure, the marks of one that may be right are left beside the results."""
    from tracker.clip.asked import suggestion_path
    from tracker.clip.start import FoundError
    from tracker.run.folder import fresh_file
    from tracker.tables.keypoints import write_marks

    try:
        yield
    except FoundError as error:
        if error.suggested is None:
            raise
        path = suggestion_path(folder.parent, video)
        with fresh_file(path, overwrite=True, inputs=[video]) as aside:
            write_marks(aside, error.suggested)
        raise FoundError(f"{error}; {path} has what it would have started from") from error
