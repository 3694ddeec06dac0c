"""The options of `figtrack annotate`; imports nothing slow, so that the command line can read it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from tracker.clip.job import Facing, bare_name

Port = Annotated[
    int, typer.Option(min=0, max=65535, help="Of the page's address on this machine; 0 for any that is free.")
]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Only print the page's address.")]


@dataclass(frozen=True, kw_only=True)
class Request:
    """The film to mark, the marks to begin with, and the address of the page."""

    video: Annotated[Path, typer.Argument(help="A video file or a folder of numbered images.")]
    frame: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="The frame shown first [default: the first that is marked, taken or suggested, else 0].",
        ),
    ] = None
    out: Annotated[
        Path | None,
        typer.Option(
            help="The keypoints table; one that exists is opened and extended [default: VIDEO.keypoints.csv]."
        ),
    ] = None
    source: Annotated[
        Path | None,
        typer.Option(
            "--from",
            help="Take one frame's marks from DeepLabCut CSV, OpenPose JSON (a file or a folder), "
            "COCO keypoints JSON, labelme JSON or TRC in pixels.",
        ),
    ] = None
    empty: Annotated[
        bool, typer.Option("--empty", help="Do not open with a suggestion, of who is found in the film.")
    ] = False
    facing: Annotated[
        Facing | None, typer.Option(help="Which way the figure faces [default: seen from the marks].")
    ] = None
    figure: Annotated[
        str, typer.Option(help="What is marked: a figure that ships, or a TOML file of one.")
    ] = "walker"
    port: Port = 0
    no_browser: NoBrowser = False
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Start anew: the first save replaces a table that exists.")
    ] = False

    @property
    def table(self) -> Path:
        return self.out or Path(f"{bare_name(self.video)}.keypoints.csv")
