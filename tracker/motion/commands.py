"""The motion commands: a pose table and a model in, a table with its picture out, and a summary."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dynamics.gaussian import Array
from dynamics.hmm import HMM
from dynamics.motion.rate import SAME, at_rate
from dynamics.motion.tasks import Labelling
from dynamics.slds import SLDS
from dynamics.store import Model
from kinematics.mocap import POSE_COLUMNS
from tracker.models.find import from_a_stand, motion_model
from tracker.motion.choices import Classify, Inference, Interpolate, PosesTask, Predict, Synthesise, Task
from tracker.motion.fill import at_table_noise, fill_gaps, fillers
from tracker.motion.free_run import free_run
from tracker.motion.summary import filled_cells, forecast_errors, free_motion, label_shares, unseen_frames
from tracker.motion.tasks import chosen_inference, forecast_all, label_all, whole_pose
from tracker.often import USUAL
from tracker.progress import Progress, counted
from tracker.run.folder import FolderError, fresh_file
from tracker.tables.poses import PoseSequence, pose_cells, read_poses, suspicions, write_poses
from tracker.tables.table import write_table

ANIMATED = 3000  # largest number of frames in a clip, 100 seconds of a stick figure
Places = tuple[Path | None, ...]  # of table, picture and possibly clip, None for an unwanted one
SD_COLUMNS = tuple(f"{name}_sd" for name in POSE_COLUMNS)


def classify_table(task: Classify, overwrite: bool, progress: Progress) -> str:
    """Write the motion of every frame, `seq,frame,label,state` and each motion's probability.

    PosesError, ModelError, FolderError, ValueError: a file that cannot be read, used or written.
    """
    places = task.places("classify")
    with _fresh(task, places, overwrite) as (table, plot):
        model, sequences, _ = _read(replace(task, model=from_a_stand(task.model)), progress)
        chosen = chosen_inference(model, task.inference)
        found = label_all(model, sequences, inference=chosen, use=task.use, progress=progress)
        shares = chosen is not Inference.VITERBI
        _write_labels(table, sequences, found, shares)
        if plot is not None:
            from tracker.motion.label_plot import draw_labels

            title = f"{task.poses.name}: motions by {Path(task.model).name}, {chosen.value}, {task.use.value}"
            draw_labels(sequences, found, plot, title, shares=shares)
    return "\n".join([*label_shares(sequences, found), *unseen_frames(sequences), _see(places)])


def predict_table(task: Predict, overwrite: bool, progress: Progress) -> str:
    """Write as a pose table forecasts of each frame t from those up to t - horizon; raises likewise."""
    places = task.places("predict")
    with _fresh(task, places, overwrite) as (table, plot):
        model, sequences, _ = _read(task, progress)
        slds = whole_pose(model, "predict")
        forecasts = forecast_all(slds, sequences, task.horizon, progress)
        means = [forecast.mean for forecast in forecasts]
        sds = [np.sqrt(np.diagonal(f.cov, axis1=1, axis2=2)) for f in forecasts]
        write_poses(table, _pose_rows(sequences, means, sds), SD_COLUMNS)
        if plot is not None:
            from tracker.motion.plots import draw_forecast

            ahead = f"forecasts {counted(task.horizon, 'frame')} ahead by {Path(task.model).name}"
            title = f"{_which(task, sequences[0])}: {ahead}"
            draw_forecast(sequences[0], means[0], sds[0], plot, title)
    return "\n".join(
        [forecast_errors(sequences, means, task.horizon), *unseen_frames(sequences), _see(places)]
    )


def interpolate_table(task: Interpolate, overwrite: bool, progress: Progress) -> str:
    """Write the table with unmeasured values filled in; raises as `classify_table`."""
    places = task.places("interpolate")
    with _fresh(task, places, overwrite) as (table, plot):
        model, sequences, fps = _read(task, progress)
        with_what = fillers(task.model, model, fps)
        if with_what.slds is not None and not all(sequence.seen.all() for sequence in sequences):
            noisy = at_table_noise(with_what.slds, sequences, progress)
            with_what = replace(with_what, slds=noisy)
        # A generator for each sequence, so that its result does not depend on the others.
        filled = [
            fill_gaps(with_what, sequence, np.random.default_rng(task.seed))
            for sequence in progress.through("filling gaps", sequences, len(sequences))
        ]
        rows = _pose_rows(sequences, [f.y for f in filled], [f.sd for f in filled], keep=True)
        write_poses(table, rows, SD_COLUMNS)
        if plot is not None:
            from tracker.motion.plots import draw_filled, longest_gap

            lengths = [stop - start for start, stop in map(longest_gap, sequences)]
            i = int(np.argmax(lengths))
            done = f"gaps filled by {Path(task.model).name}"
            title = f"{_which(task, sequences[i])}: {'no gaps' if sequences[i].seen.all() else done}"
            draw_filled(sequences[i], filled[i].y, filled[i].sd, fps, plot, title)
    return "\n".join([filled_cells(sequences, filled), *unseen_frames(sequences), _see(places)])


def synthesise_table(task: Synthesise, overwrite: bool, progress: Progress) -> str:
    """Write a synthesised motion as a pose table with one sequence, and as a clip; raises likewise."""
    named, picture = task.places("synthesise")
    places = named, picture, None if task.no_clip else named.with_suffix(".mp4")
    with _fresh(task, places, overwrite) as (table, plot, film):
        model, fps = _model(task)
        rng = np.random.default_rng(task.seed)
        with progress.task("synthesising", 1) as advance:
            states, labels, y = free_run(model, task.frames, fps, rng, task.label, task.noise)
            advance()
        rows = ((0, t, *pose_cells(y[t]), states[t], labels[t]) for t in range(task.frames))
        write_poses(table, rows, ("state", "label"))
        if plot is not None:
            from tracker.motion.plots import draw_synthesis

            title = f"{task.frames} frames of {Path(task.model).name}, seed {task.seed}"
            draw_synthesis(states, model.labels, y, fps, plot, title)
        if film is not None:
            from tracker.motion.sticks import write_clip

            drawn = y[:ANIMATED]
            captions = [f"frame {t}  {labels[t]} state {states[t]}" for t in range(len(drawn))]
            write_clip(drawn, captions, fps, film, progress)
    said = [free_motion(Path(task.model).name, labels, fps), _see(places)]
    if places[-1] is not None and task.frames > ANIMATED:
        said.append(f"{places[-1]} shows the first {ANIMATED} of {task.frames} frames")
    return "\n".join(said)


@contextmanager
def _fresh(task: Task, places: Places, overwrite: bool) -> Iterator[list[Any]]:
    """Temporary names for table, picture and possibly clip, which are renamed when the block succeeds."""
    wanted = [place for place in places if place is not None]
    if len({place.resolve() for place in wanted}) < len(wanted):
        raise FolderError(f"table, plot and clip would be one file, {wanted[0]}; choose another --out")
    inputs = [task.source, Path(task.model)]
    with ExitStack() as stack:
        yield [
            place and stack.enter_context(fresh_file(place, overwrite=overwrite, inputs=inputs))
            for place in places
        ]


def _read(task: PosesTask, progress: Progress) -> tuple[Model, list[PoseSequence], float]:
    """The model at the table's rate, the sequences, and the rate."""
    model, fps = _model(task)
    sequences = read_poses(task.poses)
    for text in suspicions(sequences, fps):
        progress.warn(text)
    return model, sequences, fps


def _model(task: Task) -> tuple[Model, float]:
    model = motion_model(task.model, task.fps or USUAL)
    fps = task.fps or model.fps
    if isinstance(model, HMM) and not abs(fps / model.fps - 1.0) < SAME:
        raise ValueError(
            f"{task.model} was learned at {model.fps:g} frames a second and cannot be converted to "
            f"{fps:g}; learn it again with --fps {fps:g}"
        )
    return (at_rate(model, fps) if isinstance(model, SLDS) else model), fps


def _write_labels(
    path: Path, sequences: Sequence[PoseSequence], found: Sequence[Labelling], shares: bool
) -> None:
    motions = found[0].labels
    further = [f"p_{motion}" for motion in motions] if shares else []
    rows = (
        (s.name, s.first + t, f.label[t], f.state[t], *(f"{p:.6f}" for p in f.prob[t, : len(further)]))
        for s, f in zip(sequences, found, strict=True)
        for t in range(len(s))
    )
    write_table(path, ("seq", "frame", "label", "state", *further), rows)


def _pose_rows(
    sequences: Sequence[PoseSequence], ys: Sequence[Array], sds: Sequence[Array], *, keep: bool = False
) -> Iterator[list[object]]:
    """Rows of a pose table with standard deviations; `keep` leaves given cells as they were written."""
    for sequence, y, sd in zip(sequences, ys, sds, strict=True):
        for t in range(len(y)):
            cells = pose_cells(y[t])
            if keep:
                cells = [old or new for old, new in zip(sequence.cells[t], cells, strict=True)]
            yield [sequence.name, sequence.first + t, *cells, *pose_cells(sd[t])]


def _see(places: Places) -> str:
    return "see " + ", ".join(str(place) for place in places if place is not None)


def _which(task: PosesTask, sequence: PoseSequence) -> str:
    return f"{task.poses.name}, sequence {sequence.name}"
