"""The options of `figtrack learn`; imports nothing slow, so that the command line can read it."""

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kinematics.text_file import blanked

if TYPE_CHECKING:
    from kinematics.figure import Figure

# How a model is learned: by an inference, or as another kind of model.
Learning = StrEnum("Learning", "VITERBI GPB2 VARIATIONAL HMM STRIDE")


@dataclass(frozen=True)
class Request:
    """The data and options of learning; BadParameter if two options cannot be combined."""

    poses: Annotated[list[Path] | None, typer.Argument(help="Pose tables, all at --fps.")] = None
    trials: Annotated[
        Path | None, typer.Option(help="Table of captures: file, subject, activity, fps, segments, ...")
    ] = None
    label: Annotated[
        list[str] | None,
        typer.Option(
            metavar="<str>",
            help="Activities to learn [default: walk and run, or all labels of the pose tables].",
        ),
    ] = None
    exclude_subjects: Annotated[str, typer.Option(help="Subjects to leave out, with commas between.")] = ""
    states: Annotated[
        int | None, typer.Option(min=1, max=32, help="Switching states of each activity [default: 8].")
    ] = None
    order: Annotated[int | None, typer.Option(min=1, max=2, help="Order of the dynamics [default: 2].")] = (
        None
    )
    fps: Annotated[float, typer.Option(min=1.0, max=1000.0, help="Frames a second to learn at.")] = 30.0
    noise: Annotated[float, typer.Option(min=0.0, max=45.0, help="Noise added to the angles, degrees.")] = 1.0
    inference: Annotated[
        Learning,
        typer.Option(
            help="Of the switching states while learning; hmm for a model without dynamics, stride for "
            "one of periodic gait, which fills gaps."
        ),
    ] = Learning.VITERBI
    seed: Annotated[int, typer.Option(min=0, help="Of the start of learning and the noise.")] = 0
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address of a Dask scheduler whose workers do the E-steps, tcp://HOST:PORT."),
    ] = None
    settings: Annotated[Path | None, typer.Option(help="TOML file of further keys: docs/learn.md.")] = None
    figure: Annotated[
        str, typer.Option(help="Whose poses the tables hold: a figure that ships, or a TOML file of one.")
    ] = "walker"

    def __post_init__(self) -> None:
        if (self.trials is None) == (not self.poses):
            raise typer.BadParameter("give either --trials TABLE or pose tables, one of the two")

    @cached_property
    def body(self) -> "Figure":
        from kinematics.figure_file import load_figure

        return load_figure(self.figure)

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(map(blanked, self.label or ())))

    @property
    def subjects(self) -> dict[Path, str]:
        """Pose tables and who is in each: what it is called, of two that are called alike with the folder."""
        tables = self.poses or []
        stems = [path.stem for path in tables]
        return {
            path: path.stem if stems.count(path.stem) == 1 else str(path.with_suffix("")) for path in tables
        }

    @property
    def excluded(self) -> list[str]:
        return [name.strip() for name in self.exclude_subjects.split(",") if name.strip()]

    @property
    def inputs(self) -> list[Path | None]:
        """The input files, which may not be overwritten; None for none."""
        figure = Path(self.figure) if Path(self.figure).is_file() else None
        return [self.trials, *(self.poses or ()), self.settings, figure]
