"""From a table of captures to a model's file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dynamics.em import Options
from dynamics.slds import SLDS
from dynamics.store import save
from kinematics.mocap import Trial, read_trials, sequences
from tracker.folder import fresh_file
from tracker.models import learn_motions
from tracker.progress import Progress
from tracker.sampling import Array


@dataclass(frozen=True)
class Request:
    """What to learn, as `figtrack learn` asks; `noise` is in degrees, `states` are per activity."""

    trials: Path
    labels: tuple[str, ...]
    excluded: tuple[str, ...]
    licences: tuple[str, ...]
    states: int
    pooled: bool
    order: int
    fps: float
    noise: float
    seed: int
    rounds: int


def learn_model(request: Request, out: Path, *, overwrite: bool, progress: Progress) -> str:
    """Learn and save; gives a line that says from what.

    Raises:
        MotionError: a table or capture that cannot be read.
        ValueError: nothing left to learn from.
        FolderError: a place that cannot be written, or a model of that name is there already.
    """
    with fresh_file(out, overwrite=overwrite) as aside:
        trials = [trial for trial in read_trials(request.trials) if _wanted(trial, request)]
        data = _read(trials, request, progress)
        slds = _learn(data, request, progress)
        subjects = sorted({subject for subject, _, _ in data})
        terms = sorted({trial.licence for trial in trials})
        origin = f"{len(data)} sequences of subjects {', '.join(subjects)}; terms: {'; '.join(terms)}"
        save(slds, aside, origin)
    return f"{out}: {slds.K} states, order {slds.order}, {slds.fps:g} frames a second, from {origin}"


def _wanted(trial: Trial, request: Request) -> bool:
    licensed = not request.licences or any(text.lower() in trial.licence.lower() for text in request.licences)
    return trial.activity in request.labels and trial.subject not in request.excluded and licensed


def _read(trials: Sequence[Trial], request: Request, progress: Progress) -> list[tuple[str, str, Array]]:
    """Subject, label and poses of every sequence."""
    data: list[tuple[str, str, Array]] = []
    with progress.task("reading captures", len(trials)) as advance:
        for trial in trials:
            data += [(s.subject, s.label, s.y) for s in sequences(trial, request.fps)]
            advance()
    found = {label for _, label, _ in data}
    missing = [label for label in request.labels if label not in found]
    if missing:
        raise ValueError(
            f"{request.trials} leaves no sequences of {', '.join(map(repr, missing))}; "
            "check --label, --licence and --exclude-subjects"
        )
    return data


def _learn(data: Sequence[tuple[str, str, Array]], request: Request, progress: Progress) -> SLDS:
    options = Options(states=request.states, order=request.order, rounds=request.rounds, seed=request.seed)
    groups = 1 if request.pooled else len(request.labels)
    with progress.task("learning", groups * request.rounds) as advance:
        return learn_motions(
            data,
            fps=request.fps,
            options=options,
            pooled=request.pooled,
            noise=float(np.radians(request.noise)),
            progress=lambda *_: advance(),
        )
