"""Commands with motion only: learning a model, and using it on tables of poses."""

from pathlib import Path
from typing import Annotated

import typer

from tracker.cli.options import Common
from tracker.models.request import Request
from tracker.motion.choices import Classify, Interpolate, Predict, Seed, Synthesise


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


def classify(task: Classify, *, common: Common) -> None:
    """Tell which motion every frame of a pose table belongs to.

    Writes seq,frame,label,state and, except with viterbi, p_LABEL, the probability of each motion; missing
    frames between measured ones have rows too.

    Example: figtrack classify walk-track/pose.csv --model gait.npz
    """
    from tracker.motion.commands import classify_table

    print(classify_table(task, common.overwrite, common.shown()))


def predict(task: Predict, *, common: Common) -> None:
    """Forecast every frame of a pose table from those before it.

    Row t is the forecast of frame t from the frames up to t - HORIZON; HORIZON rows follow the table's last.
    Columns NAME_sd are standard deviations.

    Example: figtrack predict walk-track/pose.csv --model gait.npz --horizon 5
    """
    from tracker.motion.commands import predict_table

    print(predict_table(task, common.overwrite, common.shown()))


def interpolate(task: Interpolate, *, common: Common) -> None:
    """Fill the empty cells and the missing rows of a pose table.

    Measured values stay unchanged. Columns NAME_sd are standard deviations of filled values, else empty.

    Example: figtrack interpolate walk-track/pose.csv --model gait.npz
    """
    from tracker.motion.commands import interpolate_table

    print(interpolate_table(task, common.overwrite, common.shown()))


def synthesise(task: Synthesise, *, common: Common) -> None:
    """Sample a motion from the model.

    It writes a pose table, a picture and an animated clip.

    Example: figtrack synthesise --model gait.npz --frames 120 --seed 1
    """
    from tracker.motion.commands import synthesise_table

    print(synthesise_table(task, common.overwrite, common.shown()))


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

    One page compares the papers' claims with the results.

    Example: figtrack reproduce --trials trials.csv --out reproduced
    """
    from tracker.experiments.reproduce import reproduce as repeat

    print(repeat(trials, out, overwrite=common.overwrite, progress=common.shown(), seed=seed, quick=quick))
