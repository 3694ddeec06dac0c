"""Learning a model's file from a table of captures or pose tables."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence, Set
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from dynamics.learning.options import Options
from dynamics.slds import SLDS
from dynamics.store import Model, save
from dynamics.stride import Stride
from kinematics.mocap import ARM_COLUMNS, POSE_COLUMNS, SHORTEST, Trial, read_trials, sequences
from tracker.models.by_motion import ESteps, Spread, learn_hmms, learn_motions, learn_strides
from tracker.models.copies import Labelled, with_copies
from tracker.models.request import Learning, Request
from tracker.progress import Progress, counted, tally
from tracker.run.folder import fresh_file
from tracker.settings import read_toml
from tracker.tables.poses import read_poses, suspicions

Data = list[Labelled]
CAPTURED = (POSE_COLUMNS, (*POSE_COLUMNS, *ARM_COLUMNS))
ACTIVITIES = ("walk", "run")
UNLABELLED = "motion"
STATES = 8  # default number of states for each activity
ORDER = 2
NOISE = 1.0  # default noise added to captures, degrees
NAMED = 20  # most subjects that a message names
# Settings that apply to switching states only.
SWITCHING = ("pooled", "slower", "started")


class Further(BaseModel):
    """Settings of `learn` that are seldom changed, from the TOML file of --settings."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    licences: tuple[str, ...] = Field((), description="learn only from rows whose licence has one of these")
    pooled: bool = Field(False, description="all activities are learned as one")
    rounds: int = Field(10, ge=1, le=1000, description="of EM at most")
    slower: tuple[str, ...] = Field(
        (), description="activities that are learned slower and smaller too, such as runs for slow jogs"
    )
    started: tuple[str, ...] = Field((), description="activities that are learned begun from a stand too")


def learn_model(request: Request, out: Path, *, overwrite: bool, progress: Progress) -> str:
    """Learn and save a model; returns a line that describes its data.

    Raises:
        MotionError: a table or capture that cannot be read.
        ValueError: nothing left to learn from.
        FolderError: a place that cannot be written, or a model of that name exists.
    """
    with fresh_file(out, overwrite=overwrite, inputs=request.inputs) as aside:
        file = request.settings
        further = Further() if file is None else read_toml(file, Further, "docs/learn.md shows one")
        if request.trials is None:
            if further.licences:
                raise ValueError("pose tables have no licences to choose by; leave licences out")
            data, terms, given = _read_tables(request, progress)
        else:
            given = 0
            data, terms = _read_captures(request.trials, request, further.licences, progress)
        model = _learn(data, request, further, progress)
        subjects = sorted({subject for subject, _, _ in data})
        origin = (
            f"{counted(len(data), 'sequence')} of subjects {', '.join(subjects)}; terms: {'; '.join(terms)}"
        )
        save(model, aside, origin)
    said = f"{out}: {_described(model)}, {model.fps:g} frames a second, from {origin}"
    used = sum(len(y) for _, _, y in data)
    return f"{said}\n{counted(used, 'frame')} used, {given - used} left out" if given else said


def _read_captures(
    table: Path, request: Request, licences: Sequence[str], progress: Progress
) -> tuple[Data, list[str]]:
    """Subject, label and poses of every sequence of the captures, and their licences."""
    if request.body.learned_freedoms not in CAPTURED:
        raise ValueError(f"captures are of people; learn a {request.body.name} from pose tables")
    arms = request.body.learned_freedoms != POSE_COLUMNS
    labels = request.labels or ACTIVITIES
    every = read_trials(table)
    _warn_of_unknown(request, [trial.subject for trial in every], progress)
    trials = [trial for trial in every if _wanted(trial, request, labels, licences)]
    data: Data = []
    for trial in progress.through("reading captures", trials, len(trials)):
        data += [(s.subject, s.label, s.y) for s in sequences(trial, request.fps, curves=True, arms=arms)]
    _check_labels(data, labels, str(table), "check --label, --exclude-subjects and the licences")
    return data, sorted({trial.licence for trial in trials})


def _read_tables(request: Request, progress: Progress) -> tuple[Data, list[str], int]:
    """The sequences of pose tables, their licences, and the number of frames in the tables.

    A file is a subject, a gap ends a sequence, rows without a label form one.
    """
    runs: Data = []
    rows: list[str] = []  # the label of each frame
    _warn_of_unknown(request, request.subjects.values(), progress)
    if not set(request.subjects.values()) - set(request.excluded):
        raise ValueError(f"--exclude-subjects leaves none of {', '.join(sorted(request.subjects.values()))}")
    for path, subject in request.subjects.items():
        if subject in request.excluded:
            continue
        found = read_poses(path, request.body)
        for text in suspicions(found, request.fps):
            progress.warn(f"{path}: {text}")
        rows += [label for sequence in found for label in sequence.given]
        runs += [
            (subject, label or UNLABELLED, y)
            for sequence in found
            for label, y in sequence.runs()
            if len(y) >= SHORTEST
        ]
    data = [run for run in runs if not request.labels or run[1] in request.labels]
    there = sorted({*rows} - {""})
    wanted = request.labels or (() if runs else there or [UNLABELLED])
    names = ", ".join(str(path) for path in request.poses or ())
    for label in request.labels:
        if label not in {*there, UNLABELLED}:
            raise ValueError(
                f"{names}: no row is labelled {label!r}; labels here: {', '.join(there) or 'none'}"
            )
    advice = (
        f"rows need all of {','.join(request.body.learned_freedoms)}, {SHORTEST} frames or more without a gap"
    )
    _check_labels(data, wanted, names, advice)
    return data, ["those of the tables"], len(rows)


def _warn_of_unknown(request: Request, subjects: Iterable[str], progress: Progress) -> None:
    """Warn of subjects to leave out who are in none of the tables."""
    known = sorted(set(subjects))
    if unknown := [name for name in request.excluded if name not in known]:
        there = ", ".join(known[:NAMED]) + (" and others" if len(known) > NAMED else "")
        progress.warn(f"--exclude-subjects: no subject is called {', '.join(unknown)}; there are {there}")


def _wanted(trial: Trial, request: Request, labels: Sequence[str], licences: Sequence[str]) -> bool:
    licensed = not licences or any(text.lower() in trial.licence.lower() for text in licences)
    return trial.activity in labels and trial.subject not in request.excluded and licensed


def _check_labels(data: Data, labels: Sequence[str], source: str, advice: str) -> None:
    found = {label for _, label, _ in data}
    missing = [label for label in labels if label not in found]
    if missing:
        raise ValueError(f"{source} leaves no sequences of {', '.join(map(repr, missing))}; {advice}")


def _learn(data: Data, request: Request, further: Further, progress: Progress) -> Model:
    options = Options(
        states=STATES if request.states is None else request.states,
        order=ORDER if request.order is None else request.order,
        rounds=further.rounds,
        seed=request.seed,
    )
    told: Any = {"fps": request.fps, "options": options, "figure": request.body}
    told["noise"] = float(np.radians(request.noise))
    if request.inference is Learning.HMM:
        if further.pooled or further.slower or further.started:
            raise ValueError("hidden Markov models are learned per activity, as captured")
        if request.order is not None:
            raise ValueError("hidden Markov models have no order; leave it out")
        if request.scheduler is not None:
            raise ValueError("hidden Markov models are learned on this machine; leave out --scheduler")
        return learn_hmms(data, **told)
    if request.inference is Learning.STRIDE:
        _check_stride(request, further)
    labels = {label for _, label, _ in data}
    _check_copies(request, further, labels)
    groups = 1 if further.pooled else len(labels)
    steps = groups * further.rounds
    with _spread(request) as spread, progress.task("learning", steps) as advance:
        if request.inference is Learning.STRIDE:
            return learn_strides(data, tick=advance, **told)
        return learn_motions(
            with_copies(data, further.slower, further.started, request.fps),
            pooled=further.pooled,
            e_steps=ESteps(request.inference.value, spread, advance),
            **told,
        )


def _check_stride(request: Request, further: Further) -> None:
    usual = Further()
    given = {
        "--states": request.states is not None,
        "--order": request.order is not None,
        "--scheduler": request.scheduler is not None,
        **{key: getattr(further, key) != getattr(usual, key) for key in SWITCHING},
    }
    for name, told in given.items():
        if told:
            raise ValueError(f"a stride has no switching states, so {name} does not apply; leave it out")


def _check_copies(request: Request, further: Further, labels: Set[str]) -> None:
    for key, named in (("slower", further.slower), ("started", further.started)):
        if unknown := [label for label in named if label not in labels]:
            raise ValueError(
                f"{key} names {', '.join(map(repr, unknown))}, which is not learned; "
                f"name some of {', '.join(sorted(labels))}"
            )
    if further.started and request.body.learned_freedoms not in CAPTURED:
        name = request.body.name
        raise ValueError(f"started begins from the stand of a person, not of the figure {name}; leave it out")


@contextmanager
def _spread(request: Request) -> Iterator[Spread | None]:
    """The function that runs E-steps on a cluster, if the request names one."""
    if request.scheduler is None:
        yield None
        return
    from tracker.models.cluster import cluster_at, spread_over

    with cluster_at(request.scheduler) as client:
        yield partial(spread_over, client)


def _described(model: Model) -> str:
    """Kind of the model, and numbers of states of its motions if they differ."""
    if isinstance(model, Stride):
        return counted(len(model.labels), "harmonic stride")
    alike = len(set(Counter(model.labels).values())) == 1
    each = "" if alike else f" ({tally(model.labels)})"
    kind = f"order {model.order}" if isinstance(model, SLDS) else "hidden Markov"
    return f"{counted(len(model.labels), 'state')}{each}, {kind}"
