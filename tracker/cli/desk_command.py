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
    """Find, follow, put right and export the films of a folder in a browser page.

    It runs the other commands, whose results lie beside the films.

    Example: figtrack app films
    """
    from tracker.desk.desk_page import open_desk

    open_desk(folder, port, not no_browser)
