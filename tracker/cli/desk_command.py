"""The command that opens one page for the whole way from film to report."""

from pathlib import Path
from typing import Annotated

import typer

from tracker.cli.annotate_command import NoBrowser, Port


def app(
    folder: Annotated[
        Path, typer.Argument(help="A folder of films [default: the one that one is in].")
    ] = Path(),
    *,
    port: Port = 0,
    no_browser: NoBrowser = False,
) -> None:
    """Do most of this for a folder of films in a browser page.

    The page finds, follows, puts right and exports by the other commands; results lie beside the films.

    Example: figtrack app films
    """
    from tracker.desk.desk_page import open_desk

    open_desk(folder, port, not no_browser)
