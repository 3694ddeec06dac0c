"""The commands: text and exit codes. Slow libraries are imported by the commands that need them."""

import io
import signal
import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tracker import __version__
from tracker.cli.annotate_command import annotate
from tracker.cli.file_commands import batch, export, settings
from tracker.cli.motion_commands import classify, interpolate, learn, predict, reproduce, synthesise
from tracker.cli.options import (
    Facing,
    FacingOption,
    Overwrite,
    ProgressStyle,
    Quiet,
    Style,
    Video,
    beside,
    plain_errors,
    shown_progress,
    towards,
)

if TYPE_CHECKING:
    from tracker.clip.follow import Job

app = typer.Typer(
    help="Follow a walking or running figure through side-view video with a learned model of its motion.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich takes "[default: ..]" for a style and drops it
    context_settings={"help_option_names": ["-h", "--help"]},
)


Keypoints = Annotated[
    Path, typer.Option("--keypoints", help="Table of marked joints: frame,keypoint,x,y,visible.")
]
Start = Annotated[
    int | None, typer.Option(min=0, help="The marked frame to start from [default: the first marked].")
]
Stop = Annotated[
    int | None, typer.Option(min=0, max=10**9, help="The last frame to follow [default: the clip's last].")
]
Rate = Annotated[
    float | None,
    typer.Option(
        min=0.25,
        max=4.0,
        help="Playback speed: 0.5 for slow motion at half speed [default: found while tracking].",
    ),
]
Smooth = Annotated[
    bool, typer.Option("--smooth/--no-smooth", help="Write each pose given the whole clip, or as first seen.")
]
Anchors = Annotated[
    bool, typer.Option("--anchors", help="Pass through every marked frame, not the start alone.")
]
Measure = Annotated[
    Path | None,
    typer.Option(
        "--measure",
        help="A pose network's points of every frame, as a further, doubted measurement: "
        "DeepLabCut CSV, OpenPose JSON (file or folder) or TRC in pixels.",
    ),
]
Templates = Annotated[
    bool, typer.Option("--templates/--no-templates", help="Follow looks, or with --measure points alone.")
]
SettingsFile = Annotated[Path | None, typer.Option("--settings", help="TOML file of tracker settings.")]


@app.callback(invoke_without_command=True)
def figtrack(
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    """Follow a walking or running figure through side-view video with a learned model of its motion."""
    if version:
        print(f"figtrack {__version__}")
        raise typer.Exit


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("figtrack-demo"),
    seed: Annotated[int, typer.Option(min=0, help="Which walk is rendered.")] = 5,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    progress: ProgressStyle = Style.AUTO,
) -> None:
    """Render a walk, follow it with two models and compare them.

    The models are the learned one and constant velocity; where the joints are is known.

    Example: figtrack demo --out my-demo
    """
    with plain_errors():
        from tracker.cli.demo import run_demo

        page, table = run_demo(out, seed, overwrite=overwrite, progress=shown_progress(quiet, progress))
        print(table)
        print(f"\nopen {page}")


def track(
    video: Video,
    keypoints: Keypoints,
    start: Start = None,
    stop: Stop = None,
    model: Annotated[
        str, typer.Option(help="cv, a shipped model, or a file from 'figtrack learn'.")
    ] = "walk-run",
    facing: FacingOption = None,
    anchors: Anchors = False,
    measure: Measure = None,
    templates: Templates = True,
    rate: Rate = None,
    smooth: Smooth = True,
    settings: SettingsFile = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results [default: VIDEO-track].")] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    progress: ProgressStyle = Style.AUTO,
) -> None:
    """Follow the figure marked in one frame through the whole clip.

    Example: figtrack track walk.mp4 --keypoints walk.keypoints.csv

    Or: figtrack track walk.mp4 --keypoints walk.keypoints.csv --measure walk.dlc.csv --no-templates
    """
    with plain_errors():
        from tracker.clip.follow import follow, write_run
        from tracker.run.folder import fresh_folder

        shown = shown_progress(quiet, progress)
        job = _job(
            video, keypoints, start, stop, facing, anchors, measure, templates, rate, smooth, settings, model
        )
        folder = out or beside(video, "track")
        inputs = _inputs(video, keypoints, measure, settings, model)
        with fresh_folder(folder, overwrite=overwrite, inputs=inputs) as aside:
            finished = follow(job, shown)
            write_run(finished, aside, shown)
        for warning in finished.warnings:
            shown.warn(warning)
        counts = Counter(finished.track.outcome)
        outcomes = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
        print(f"{finished.frames} frames of {video.name} with {model}: {outcomes}")
        if finished.points is not None:
            print(finished.points)
        print(f"see {folder / 'report.html'}, {folder / 'keypoints.csv'}, {folder / 'pose.csv'}")


def compare(
    video: Video,
    keypoints: Keypoints,
    truth: Annotated[Path | None, typer.Option(help="Marks to compare with [default: --keypoints].")] = None,
    model: Annotated[
        list[str] | None, typer.Option(help="Models to compare [default: walk-run walk-run-1 cv].")
    ] = None,
    start: Start = None,
    stop: Stop = None,
    facing: FacingOption = None,
    anchors: Anchors = False,
    measure: Measure = None,
    templates: Templates = True,
    rate: Rate = None,
    smooth: Smooth = True,
    settings: SettingsFile = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results [default: VIDEO-compare].")] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    progress: ProgressStyle = Style.AUTO,
) -> None:
    """Follow a clip with several models and score each by marks.

    Example: figtrack compare walk.mp4 --keypoints walk.keypoints.csv --model walk-run --model cv
    """
    with plain_errors():
        from tracker.report.comparison import compare_models
        from tracker.run.folder import fresh_folder
        from tracker.tables.keypoints import read_keypoints

        job = _job(
            video, keypoints, start, stop, facing, anchors, measure, templates, rate, smooth, settings, ""
        )
        marks = job.marks if truth is None else read_keypoints(truth)
        folder = out or beside(video, "compare")
        names = list(dict.fromkeys(model or ["walk-run", "walk-run-1", "cv"]))
        inputs = _inputs(video, keypoints, truth, measure, settings, *names)
        with fresh_folder(folder, overwrite=overwrite, inputs=inputs) as aside:
            table = compare_models(job, marks, names, aside, shown_progress(quiet, progress))
        print(table)
        print(f"\nopen {folder / 'report.html'}")


COMMANDS = (
    *(demo, annotate, learn, track, compare, classify, predict, interpolate, synthesise, reproduce),
    *(export, batch, settings),
)
for command in COMMANDS:
    app.command()(command)


def main() -> None:
    """Entry point of the command line."""
    # What a scheduler stops cleans up behind it as after Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    # A file's name may have letters that this terminal has not, which is no reason to fail.
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    app(prog_name="figtrack")


def _job(
    video: Path,
    keypoints: Path,
    start: int | None,
    stop: int | None,
    facing: Facing | None,
    anchors: bool,
    measure: Path | None,
    templates: bool,
    rate: float | None,
    smooth: bool,
    settings: Path | None,
    model: str,
) -> "Job":
    from tracker.clip.follow import Job
    from tracker.settings import Settings, read_settings
    from tracker.tables.keypoints import read_keypoints

    marks = read_keypoints(keypoints)
    chosen = Settings() if settings is None else read_settings(settings)
    return Job(
        video=video,
        marks=marks,
        model=model,
        settings=chosen if templates else chosen.model_copy(update={"templates": False}),
        start=start,
        stop=stop,
        facing=towards(facing),
        rate=rate,
        smooth=smooth,
        anchors=anchors,
        measure=measure,
    )


def _inputs(video: Path, *others: Path | str | None) -> list[Path]:
    """The files and folders that a command reads; a model may also be a mere name."""
    return [
        video,
        *(Path(other) for other in others if isinstance(other, Path) or (other and Path(other).is_file())),
    ]
