"""The command that opens the marking page."""

from pathlib import Path
from typing import Annotated

import typer

from tracker.cli.options import Common, FacingOption, Video
from tracker.clip.job import towards


def annotate(
    video: Video,
    *,
    frame: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="The frame shown first [default: the first that is marked, taken or suggested, else 0].",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The keypoints table; one that exists is opened and extended [default: VIDEO.keypoints.csv]."
        ),
    ] = None,
    source: Annotated[
        Path | None,
        typer.Option(
            "--from",
            help="Take one frame's marks from DeepLabCut CSV, OpenPose JSON (a file or a folder), "
            "COCO keypoints JSON, labelme JSON or TRC in pixels.",
        ),
    ] = None,
    empty: Annotated[
        bool,
        typer.Option("--empty", help="Do not open with a suggestion, of who is found in the film."),
    ] = False,
    facing: FacingOption = None,
    port: Annotated[
        int,
        typer.Option(min=0, max=65535, help="Of the page's address on this machine; 0 for any that is free."),
    ] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the page's address.")] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Start anew: the first save replaces a table that exists.")
    ] = False,
    common: Common,
) -> None:
    """Mark the joints of one frame or more in a browser page.

    It opens with a suggestion where nothing is marked yet.

    Example: figtrack annotate walk.mp4 --frame 12
    """
    from tracker.annotate.launch import Request, mark

    table = out or Path(f"{video.absolute().stem}.keypoints.csv")
    way, browser = towards(facing), not no_browser
    mark(Request(video, table, frame, source, way, port, browser, overwrite, empty, common.shown()))
