"""The commands on motion alone: learning a model, and what it says of tables of poses."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tracker.cli.options import Common, beside
from tracker.models.request import Request
from tracker.motion.choices import Inference, Use

if TYPE_CHECKING:
    from tracker.motion.commands import Outputs

Poses = Annotated[
    Path,
    typer.Argument(
        help="Pose table: seq,frame,root_x,root_y,torso,neck,hip_near,knee_near,hip_far,knee_far."
    ),
]
Model = Annotated[str, typer.Option(help="A shipped model, or a file from 'figtrack learn'.")]
Fps = Annotated[
    float | None,
    typer.Option(min=1.0, max=1000.0, help="Frames a second of the table [default: the model's]."),
]
NoRecurrent = Annotated[
    bool, typer.Option("--no-recurrent", help="The papers' switch, which does not depend on the pose.")
]
Seed = Annotated[int, typer.Option(min=0, help="Of what is drawn at random.")]


@dataclass(frozen=True)
class Written:
    """The table that a command writes, and the picture beside it."""

    out: Annotated[Path | None, typer.Option(help="The table to write [default: POSES-COMMAND.csv].")] = None
    plot: Annotated[
        Path | None,
        typer.Option(help="The picture to write, .png, .pdf or .svg [default: as --out, but .png]."),
    ] = None
    no_plot: Annotated[bool, typer.Option("--no-plot", help="Draw no picture.")] = False

    def outputs(self, usual: Path, *, clip: bool = False) -> "Outputs":
        """The table, `usual` unless told, and what stands beside it under its name."""
        from tracker.motion.commands import Outputs

        if self.plot is not None and self.no_plot:
            raise typer.BadParameter("give either --plot or --no-plot, not both")
        table = self.out or usual
        picture = None if self.no_plot else self.plot or table.with_suffix(".png")
        return Outputs(table, picture, table.with_suffix(".mp4") if clip else None)


def learn(
    request: Request,
    *,
    out: Annotated[Path, typer.Option(help="The model's file.")] = Path("model.npz"),
    common: Common,
) -> None:
    """Learn a motion model from captures or pose tables.

    Example: figtrack learn --trials trials.csv --label walk --label run --out gait.npz
    """
    from tracker.models.learn import learn_model

    print(learn_model(request, out, overwrite=common.overwrite, progress=common.shown()))


def classify(
    poses: Poses,
    *,
    model: Model = "gait",
    inference: Annotated[
        Inference | None,
        typer.Option(help="Of the switching states [default: gpb2, or hmm for a hidden Markov model]."),
    ] = None,
    use: Annotated[
        Use, typer.Option(help="What tells a motion: the angles, or all columns, the root's too.")
    ] = Use.ANGLES,
    pose_weight: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=10.0,
            help="Weight of a pose by itself beside its motion; 0 as in the papers [default: 0.5].",
        ),
    ] = None,
    fps: Fps = None,
    written: Written,
    common: Common,
) -> None:
    """Tell which motion every frame of a pose table belongs to.

    Writes seq,frame,label,state and, except with viterbi, p_LABEL, the probability of each motion; missing
    frames between measured ones have rows too.

    Example: figtrack classify walk-track/pose.csv --model gait.npz
    """
    from tracker.motion.commands import Task, classify_table

    outputs = written.outputs(beside(poses, "classify.csv"))
    task = Task(poses, model, fps, outputs, common.overwrite, common.shown())
    print(classify_table(task, inference=inference, use=use, pose_weight=pose_weight))


def predict(
    poses: Poses,
    *,
    model: Model = "gait",
    horizon: Annotated[int, typer.Option(min=1, max=1000, help="How many frames ahead.")] = 1,
    fps: Fps = None,
    show: Annotated[
        str | None, typer.Option(help="The sequence that the picture shows [default: the first].")
    ] = None,
    written: Written,
    common: Common,
) -> None:
    """Forecast every frame of a pose table from those before it.

    Row t is the forecast of frame t from the frames up to t - HORIZON; HORIZON rows follow the table's last.
    Columns NAME_sd are standard deviations.

    Example: figtrack predict walk-track/pose.csv --model gait.npz --horizon 5
    """
    from tracker.motion.commands import Task, predict_table

    outputs = written.outputs(beside(poses, "predict.csv"))
    task = Task(poses, model, fps, outputs, common.overwrite, common.shown(), show)
    print(predict_table(task, horizon=horizon))


def interpolate(
    poses: Poses,
    *,
    model: Model = "gait",
    fps: Fps = None,
    no_recurrent: NoRecurrent = False,
    seed: Seed = 0,
    show: Annotated[
        str | None,
        typer.Option(help="The sequence that the picture shows [default: that of the longest gap]."),
    ] = None,
    written: Written,
    common: Common,
) -> None:
    """Fill the empty cells and the missing rows of a pose table.

    What was measured stays as it is. Columns NAME_sd are standard deviations of what was filled, else empty.

    Example: figtrack interpolate walk-track/pose.csv --model gait.npz
    """
    from tracker.motion.commands import Task, interpolate_table

    outputs = written.outputs(beside(poses, "interpolate.csv"))
    task = Task(poses, model, fps, outputs, common.overwrite, common.shown(), show)
    print(interpolate_table(task, seed=seed, recurrent=not no_recurrent))


def synthesise(
    *,
    model: Model = "gait",
    frames: Annotated[int, typer.Option(min=1, max=100_000, help="How many.")] = 300,
    label: Annotated[
        str | None, typer.Option(help="The motion, of those the model knows [default: any, as it comes].")
    ] = None,
    fps: Annotated[
        float | None, typer.Option(min=1.0, max=1000.0, help="Frames a second [default: the model's].")
    ] = None,
    noise: Annotated[
        float, typer.Option(min=0.01, max=10.0, help="Times as large as learned is what drives the motion.")
    ] = 1.0,
    no_recurrent: NoRecurrent = False,
    seed: Seed = 0,
    out: Annotated[
        Path | None, typer.Option(help="The table to write [default: MODEL-synthesise.csv].")
    ] = None,
    written: Written,
    no_clip: Annotated[
        bool, typer.Option("--no-clip", help="Make no clip, else as --out, but .mp4.")
    ] = False,
    common: Common,
) -> None:
    """Make up a motion of the model's own.

    It leaves a pose table, a picture and an animated clip.

    Example: figtrack synthesise --model gait.npz --frames 120 --seed 1
    """
    from tracker.motion.commands import Task, synthesise_table

    outputs = written.outputs(out or beside(Path(model), "synthesise.csv"), clip=not no_clip)
    task = Task(None, model, fps, outputs, common.overwrite, common.shown())
    print(
        synthesise_table(task, frames=frames, seed=seed, recurrent=not no_recurrent, label=label, noise=noise)
    )


def reproduce(
    trials: Annotated[Path, typer.Option(help="Table of captures: file, subject, activity, fps, ...")],
    *,
    seed: Seed = 0,
    quick: Annotated[
        bool, typer.Option("--quick", help="Smaller experiments, to see that all works.")
    ] = False,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("figtrack-reproduce"),
    common: Common,
) -> None:
    """Repeat the papers' experiments on motion captures.

    One page sets the papers' claims beside what comes out.

    Example: figtrack reproduce --trials trials.csv --out reproduced
    """
    from tracker.experiments.reproduce import reproduce as repeat

    shown = common.shown()
    print(repeat(trials, out, overwrite=common.overwrite, progress=shown, seed=seed, quick=quick))
