"""Commands with files: exports for other programs, comparison of runs, batches, settings."""

import os
from enum import StrEnum
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from tracker.cli.options import Common, Overwrite
from tracker.clip.job import Facing, towards
from tracker.progress import tally

if TYPE_CHECKING:
    from tracker.batch.run_all import Ended

To = StrEnum("To", "DLC TRC MOT SPORTS2D OPENPOSE MYOGAIT ALL")  # formats to which a run is exported


def export(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run of 'figtrack track'.")],
    to: Annotated[
        To,
        typer.Option(
            help="dlc: DeepLabCut CSV; trc, mot: OpenSim; sports2d: TRC in pixels; openpose: JSON files; "
            "myogait: JSON; all: every one of them."
        ),
    ],
    *,
    height: Annotated[
        float | None,
        typer.Option(
            min=0.3, max=3.0, help="Of the person, metres, for trc, mot and myogait [default: as tracked]."
        ),
    ] = None,
    scale_points: Annotated[
        str | None,
        typer.Option(
            metavar="X1,Y1,X2,Y2,METRES",
            help="The scale instead by two pixels and the metres between them, where the figure walks.",
        ),
    ] = None,
    facing: Annotated[
        Facing | None, typer.Option(help="Which way the figure faces [default: as the run has it].")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="The file, or folder for openpose [default: DIR and an ending].")
    ] = None,
    common: Common,
) -> None:
    """Write a run for another program.

    Joints are named right and left; some programs take angles or metres.

    Example: figtrack export walk-track --to trc --height 1.75
    """
    if height is not None and scale_points is not None:
        raise typer.BadParameter("give either --height or --scale-points, not both")
    if to is To.ALL and out is not None:
        raise typer.BadParameter("with --to all every file has its usual name; leave out --out")
    points = None if scale_points is None else _scale_points(scale_points)
    from tracker.foreign.export import Wish, export_all, export_name, export_run

    wish = Wish(to.value, height, points, towards(facing))
    if to is To.ALL:
        every = export_all(folder, wish, overwrite=common.overwrite, progress=common.shown())
        print("\n".join(every))
        return
    place = out or Path(export_name(folder, to.value))
    print(export_run(folder, wish, place, overwrite=common.overwrite, progress=common.shown()))


def compare_runs(
    before: Annotated[
        Path, typer.Argument(metavar="BEFORE", help="The folder of a run of 'figtrack track'.")
    ],
    after: Annotated[Path, typer.Argument(metavar="AFTER", help="That of another run of the same person.")],
    *,
    out: Annotated[Path | None, typer.Option(help="The page [default: BEFORE-AFTER.html].")] = None,
    overwrite: Overwrite = False,
) -> None:
    """Compare two runs of one person side by side.

    The page has their gait figures, what changed, and their angles over the stride.

    Example: figtrack compare-runs monday-track friday-track
    """
    from tracker.report.before_after import compare_runs as compare
    from tracker.run.folder import fresh_file
    from tracker.run.read import RUN_FILES

    page = out or Path(f"{before.absolute().name}-{after.absolute().name}.html")
    inputs = [folder / name for folder in (before, after) for name in RUN_FILES]
    with fresh_file(page, overwrite=overwrite, inputs=inputs) as aside:
        table = compare(before, after, aside)
    print(table)
    print(f"\nopen {page}")


def batch(
    jobs: Annotated[
        Path,
        typer.Argument(
            help="A folder of films, or a table of clips: video,keypoints,start,model,out; also figure,from,"
            "stop,facing,person,near,rate,height,scale,smooth,anchors,settings,measure,templates."
        ),
    ],
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the results and summary.csv [default: that of the films or of the table]."
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, max=512, help="Processes of this machine [default: one a processor].")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler to send the clips to, tcp://HOST:PORT.")
    ] = None,
    common: Common,
) -> None:
    """Follow many clips, each by itself.

    Those that are done and complete are skipped.

    Example: figtrack batch jobs.csv --out results --workers 4
    """
    if workers is not None and scheduler is not None:
        raise typer.BadParameter("give either --workers or --scheduler, not both")
    from tracker.batch.run_all import FAILED, run_batch

    own = jobs if jobs.is_dir() else jobs.parent
    place = (own if out is None else out).absolute()
    ended = run_batch(
        jobs,
        place,
        workers=workers,
        scheduler=scheduler,
        overwrite=common.overwrite,
        progress=common.shown(),
    )
    _show(ended, place)
    if any(cells["status"] == FAILED for _, cells in ended):
        raise typer.Exit(1)


def settings(
    out: Annotated[Path | None, typer.Option(help="The TOML file to write [default: printed].")] = None,
    overwrite: Overwrite = False,
) -> None:
    """Write every setting of the tracker as a TOML file.

    The file has the meaning, unit, range and default of each.

    Example: figtrack settings --out mine.toml
    """
    from tracker.run.folder import fresh_file
    from tracker.settings import settings_toml

    if out is None:
        print(settings_toml(), end="")
        return
    with fresh_file(out, overwrite=overwrite) as aside:
        aside.write_text(settings_toml(), encoding="utf-8")
    print(f"{out}: every setting; figtrack track ... --settings {quote(str(out))}")


def _scale_points(text: str) -> tuple[float, float, float, float, float]:
    try:
        x1, y1, x2, y2, metres = map(float, text.split(","))
    except ValueError:
        raise typer.BadParameter(
            f"--scale-points wants five numbers x1,y1,x2,y2,METRES; got {text!r}"
        ) from None
    return x1, y1, x2, y2, metres


def _show(ended: "Ended", place: Path) -> None:
    """Print how every row ended, as a table on stdout."""
    from rich.console import Console
    from rich.table import Table

    from tracker.batch.run_all import outcome_of

    table = Table(box=None, pad_edge=False)
    for name in ("video", "out", "status", "frames", "outcome"):
        table.add_column(name, overflow="fold", justify="right" if name == "frames" else "left")
    for row, cells in ended:
        folder, frames = os.path.relpath(row.out, place), cells.get("frames", "")
        table.add_row(row.video.name, folder, cells["status"], frames, outcome_of(cells))
    Console(color_system=None, markup=False, highlight=False).print(table)
    print(f"{tally(cells['status'] for _, cells in ended)}; see {place / 'summary.csv'}")
