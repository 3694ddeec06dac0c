"""The options of the motion commands; imports nothing slow, so that the command line can read it."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

Seed = Annotated[int, typer.Option(min=0, help="Of what is drawn at random.")]


Inference = StrEnum("Inference", "VITERBI GPB2 VARIATIONAL HMM")  # of switching states
Use = StrEnum("Use", "ANGLES ALL")  # columns by which a motion is labelled


@dataclass(frozen=True, kw_only=True)
class Task:
    """Model, table and picture of a motion command."""

    model: Annotated[str, typer.Option(help="A shipped model, or a file from 'figtrack learn'.")] = "gait"
    fps: Annotated[
        float | None, typer.Option(min=1.0, max=1000.0, help="Frames a second [default: the model's].")
    ] = None
    out: Annotated[
        Path | None,
        typer.Option(help="The table to write [default: named after the poses or model and the command]."),
    ] = None
    no_plot: Annotated[bool, typer.Option("--no-plot", help="No picture, else as --out, but .png.")] = False

    @property
    def source(self) -> Path:
        """The file after which the results are named."""
        return Path(self.model)

    def places(self, command: str) -> tuple[Path, Path | None]:
        """Paths of the table and the picture that a command writes, None for no picture."""
        table = self.out or Path(f"{self.source.absolute().stem}-{command}.csv")
        return table, None if self.no_plot else table.with_suffix(".png")


@dataclass(frozen=True, kw_only=True)
class PosesTask(Task):
    """The options of a motion command with a pose table as input."""

    poses: Annotated[
        Path,
        typer.Argument(
            help="Pose table: seq,frame,root_x,root_y,torso,neck,hip_near,knee_near,hip_far,knee_far."
        ),
    ]

    @property
    def source(self) -> Path:
        return self.poses


@dataclass(frozen=True, kw_only=True)
class Classify(PosesTask):
    """The options of `figtrack classify`."""

    inference: Annotated[
        Inference | None,
        typer.Option(help="Of the switching states [default: gpb2, or hmm for a hidden Markov model]."),
    ] = None
    use: Annotated[
        Use, typer.Option(help="What tells a motion: the angles, or all columns, the root's too.")
    ] = Use.ANGLES


@dataclass(frozen=True, kw_only=True)
class Predict(PosesTask):
    """The options of `figtrack predict`."""

    horizon: Annotated[int, typer.Option(min=1, max=1000, help="How many frames ahead.")] = 1


@dataclass(frozen=True, kw_only=True)
class Interpolate(PosesTask):
    """The options of `figtrack interpolate`."""

    seed: Seed = 0


@dataclass(frozen=True, kw_only=True)
class Synthesise(Task):
    """The options of `figtrack synthesise`."""

    frames: Annotated[int, typer.Option(min=1, max=100_000, help="How many.")] = 300
    label: Annotated[
        str | None, typer.Option(help="The motion, of those the model knows [default: any, as it comes].")
    ] = None
    noise: Annotated[
        float, typer.Option(min=0.01, max=10.0, help="Times as large as learned is what drives the motion.")
    ] = 1.0
    seed: Seed = 0
    no_clip: Annotated[bool, typer.Option("--no-clip", help="Make no clip, else as --out, but .mp4.")] = False
