"""The motion commands: a pose table and a model in, a table with its picture out, and a summary."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dynamics.gaussian import Array
from dynamics.hmm import HMM
from dynamics.motion.rate import at_rate
from dynamics.motion.tasks import Labelling
from dynamics.store import Model
from dynamics.stride import Stride
from kinematics.mocap import POSE_COLUMNS
from tracker.models.find import from_a_stand, motion_model
from tracker.motion.choices import Inference, Use
from tracker.motion.fill import at_table_noise, fill_gaps, fillers
from tracker.motion.free_run import free_run
from tracker.motion.summary import filled_cells, forecast_errors, frames_text, free_motion, label_shares
from tracker.motion.tasks import chosen_inference, forecast_all, label_all, whole_pose
from tracker.progress import Progress
from tracker.run.folder import FolderError, fresh_file
from tracker.tables.poses import PoseSequence, PosesError, pose_cells, read_poses, suspicions, write_poses
from tracker.tables.table import write_table

USUAL_FPS = 30.0
ANIMATED = 3000  # frames of a clip at most, 100 seconds of a stick figure
PICTURES = (".png", ".pdf", ".svg")
SD_COLUMNS = tuple(f"{name}_sd" for name in POSE_COLUMNS)


@dataclass(frozen=True)
class Outputs:
    """Where the results go; None for what is not wanted."""

    table: Path
    plot: Path | None
    clip: Path | None = None

    @property
    def wanted(self) -> list[Path]:
        return [path for path in (self.table, self.plot, self.clip) if path is not None]


@dataclass(frozen=True)
class Task:
    """What all motion commands are told.

    poses : the table to be read, None where there is none
    model : a shipped model's name or a file
    fps   : frames a second of the table, None for the model's
    show  : the sequence whose curves are drawn, None for the one that tells most
    """

    poses: Path | None
    model: str
    fps: float | None
    outputs: Outputs
    overwrite: bool
    progress: Progress
    show: str | None = None


def classify_table(task: Task, *, inference: Inference | None, use: Use, pose_weight: float | None) -> str:
    """Write the motion of every frame, `seq,frame,label,state` and each motion's probability.

    By the inference that suits the model for None; use, pose_weight as `tasks.label_all`. PosesError,
    ModelError, FolderError, ValueError: what cannot be read, used or written.
    """
    with _fresh(task) as outputs:
        model, sequences, _ = _read(replace(task, model=from_a_stand(task.model)))
        chosen = chosen_inference(model, inference)
        found = label_all(
            model, sequences, inference=chosen, use=use, pose_weight=pose_weight, progress=task.progress
        )
        shares = chosen is not Inference.VITERBI
        _write_labels(outputs.table, sequences, found, shares)
        if outputs.plot is not None:
            from tracker.motion.label_plot import draw_labels

            title = f"{_name(task)}: motions by {Path(task.model).name}, {chosen.value}, {use.value}"
            draw_labels(sequences, found, outputs.plot, title, shares=shares)
    return "\n".join([*label_shares(sequences, found), _see(task)])


def predict_table(task: Task, *, horizon: int) -> str:
    """Write forecasts: row t is that of frame t from the frames up to t - horizon, as a pose table; raises as
    `classify_table`."""
    with _fresh(task) as outputs:
        model, sequences, _ = _read(task)
        slds = whole_pose(model, "predict")
        forecasts = forecast_all(slds, sequences, horizon, task.progress)
        means = [forecast.mean for forecast in forecasts]
        sds = [_deviations(f.mean, np.diagonal(f.cov, axis1=1, axis2=2)) for f in forecasts]
        write_poses(outputs.table, _pose_rows(sequences, means, sds), SD_COLUMNS)
        if outputs.plot is not None:
            from tracker.motion.plots import draw_forecast

            i = _shown(task, sequences, 0)
            ahead = f"forecasts {frames_text(horizon)} ahead by {Path(task.model).name}"
            title = f"{_which(task, sequences[i])}: {ahead}"
            draw_forecast(sequences[i], means[i], sds[i], outputs.plot, title)
    return "\n".join([forecast_errors(sequences, means, horizon), _see(task)])


def interpolate_table(task: Task, *, seed: int, recurrent: bool) -> str:
    """Write the table again with what was not measured filled in; raises as `classify_table`."""
    with _fresh(task) as outputs:
        model, sequences, fps = _read(task)
        with_what = fillers(task.model, model, fps, recurrent=recurrent)
        if with_what.slds is not None and not all(sequence.seen.all() for sequence in sequences):
            noisy = at_table_noise(with_what.slds, sequences, task.progress)
            with_what = replace(with_what, slds=noisy)
        filled = []
        with task.progress.task("filling gaps", len(sequences)) as advance:
            for sequence in sequences:
                # A generator for each, so that its answer does not hang on its neighbours.
                filled.append(fill_gaps(with_what, sequence, np.random.default_rng(seed)))
                advance()
        rows = _pose_rows(sequences, [f.y for f in filled], [f.sd for f in filled], keep=True)
        write_poses(outputs.table, rows, SD_COLUMNS)
        if outputs.plot is not None:
            from tracker.motion.plots import draw_filled, longest_gap

            lengths = [stop - start for start, stop in map(longest_gap, sequences)]
            i = _shown(task, sequences, int(np.argmax(lengths)))
            title = f"{_which(task, sequences[i])}: gaps filled by {Path(task.model).name}"
            draw_filled(sequences[i], filled[i].y, filled[i].sd, fps, outputs.plot, title)
    return "\n".join([filled_cells(sequences, filled), _see(task)])


def synthesise_table(
    task: Task, *, frames: int, seed: int, recurrent: bool, label: str | None, noise: float
) -> str:
    """Write a motion of the model's own (`tracker.motion.free_run`) as the pose table's one sequence, and as
    a clip; raises as `classify_table`."""
    with _fresh(task) as outputs:
        model, fps = _model(task)
        rng = np.random.default_rng(seed)
        with task.progress.task("synthesising", 1) as advance:
            states, labels, y = free_run(model, frames, fps, rng, label, noise, recurrent)
            advance()
        rows = ((0, t, *pose_cells(y[t]), states[t], labels[t]) for t in range(frames))
        write_poses(outputs.table, rows, ("state", "label"))
        if outputs.plot is not None:
            from tracker.motion.plots import draw_synthesis

            title = f"{frames} frames of {Path(task.model).name}, seed {seed}"
            draw_synthesis(states, model.labels, y, fps, outputs.plot, title)
        if outputs.clip is not None:
            from tracker.motion.stick_film import write_clip

            captions = [f"frame {t}  {labels[t]} state {states[t]}" for t in range(min(frames, ANIMATED))]
            write_clip(y[:ANIMATED], captions, fps, outputs.clip, task.progress)
    said = [free_motion(Path(task.model).name, labels, y, fps), _see(task)]
    if outputs.clip is not None and frames > ANIMATED:
        said.append(f"{task.outputs.clip} shows the first {ANIMATED} of {frames} frames")
    return "\n".join(said)


@contextmanager
def _fresh(task: Task) -> Iterator[Outputs]:
    """Names to write to, which become the outputs when the block ends well."""
    wanted, plot = task.outputs.wanted, task.outputs.plot
    places = [path.resolve() for path in wanted]
    if len(set(places)) < len(places):
        raise FolderError(f"table, plot and clip would be one file, {wanted[0]}; choose another --out")
    if plot is not None and plot.suffix.lower() not in PICTURES:
        raise FolderError(f"{plot} is no name of a picture; --plot wants one that ends in .png, .pdf or .svg")
    inputs = [path for path in (task.poses, Path(task.model)) if path is not None]
    with ExitStack() as stack:
        aside = {
            path: stack.enter_context(fresh_file(path, overwrite=task.overwrite, inputs=inputs))
            for path in wanted
        }
        clip = task.outputs.clip
        yield Outputs(aside[task.outputs.table], plot and aside[plot], clip and aside[clip])


def _read(task: Task) -> tuple[Model, list[PoseSequence], float]:
    """The model at the table's rate, the sequences, and the rate."""
    model, fps = _model(task)
    assert task.poses is not None
    sequences = read_poses(task.poses)
    for text in suspicions(sequences, fps):
        task.progress.warn(text)
    if task.show is not None:
        _shown(task, sequences, 0)
    return model, sequences, fps


def _model(task: Task) -> tuple[Model, float]:
    model = motion_model(task.model, task.fps or USUAL_FPS)
    fps = task.fps or model.fps
    if isinstance(model, HMM):
        if not abs(fps / model.fps - 1.0) <= 1e-3:
            raise ValueError(
                f"{task.model} was learned at {model.fps:g} frames a second and cannot be converted to "
                f"{fps:g}; learn it again with --fps {fps:g}"
            )
        return model, fps
    return (model if isinstance(model, Stride) else at_rate(model, fps)), fps


def _shown(task: Task, sequences: Sequence[PoseSequence], usual: int) -> int:
    if task.show is None:
        return usual
    names = [sequence.name for sequence in sequences]
    if task.show not in names:
        some = ", ".join(names[:10]) + (", .." if len(names) > 10 else "")
        raise PosesError(f"{task.poses} has no sequence {task.show!r} to show; there are {some}")
    return names.index(task.show)


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
    """Rows of a pose table with deviations; `keep` leaves cells as they were written."""
    for sequence, y, sd in zip(sequences, ys, sds, strict=True):
        for t in range(len(y)):
            cells = pose_cells(y[t])
            if keep:
                cells = [old or new for old, new in zip(sequence.cells[t], cells, strict=True)]
            yield [sequence.name, sequence.first + t, *cells, *pose_cells(sd[t])]


def _deviations(mean: Array, variances: Array) -> Array:
    return np.where(np.isfinite(mean), np.sqrt(variances), np.nan)


def _see(task: Task) -> str:
    return "see " + ", ".join(str(path) for path in task.outputs.wanted)


def _name(task: Task) -> str:
    return "" if task.poses is None else task.poses.name


def _which(task: Task, sequence: PoseSequence) -> str:
    return f"{_name(task)}, sequence {sequence.name}"
