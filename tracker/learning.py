"""From a table of captures to a model's file."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dynamics.em import Options
from dynamics.store import save
from kinematics.mocap import Trial, read_trials, sequences
from tracker.folder import FolderError
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
        FolderError: a model of that name is there already.
    """
    if out.exists() and not overwrite:
        raise FolderError(f"{out} exists; choose another --out, or replace it with --overwrite")
    chosen = [trial for trial in read_trials(request.trials) if _wanted(trial, request)]
    data: list[tuple[str, str, Array]] = []
    with progress.task("reading captures", len(chosen)) as advance:
        for trial in chosen:
            data += [(s.subject, s.label, s.y) for s in sequences(trial, request.fps)]
            advance()
    for label in request.labels:
        if label not in {found for _, found, _ in data}:
            raise ValueError(
                f"{request.trials} leaves no sequences of {label!r}; "
                "check --label, --licence and --exclude-subjects"
            )
    groups = 1 if request.pooled else len(request.labels)
    with progress.task("learning", groups * request.rounds) as advance:
        slds = learn_motions(
            data,
            fps=request.fps,
            options=Options(
                states=request.states, order=request.order, rounds=request.rounds, seed=request.seed
            ),
            pooled=request.pooled,
            noise=float(np.radians(request.noise)),
            progress=lambda *_: advance(),
        )
    subjects = sorted({subject for subject, _, _ in data})
    licences = sorted({trial.licence for trial in chosen})
    origin = f"{len(data)} sequences of subjects {', '.join(subjects)}; terms: {'; '.join(licences)}"
    save(slds, out, origin)
    return f"{out}: {slds.K} states, order {slds.order}, {slds.fps:g} frames a second, from {origin}"


def _wanted(trial: Trial, request: Request) -> bool:
    licensed = not request.licences or any(text.lower() in trial.licence.lower() for text in request.licences)
    return trial.activity in request.labels and trial.subject not in request.excluded and licensed
