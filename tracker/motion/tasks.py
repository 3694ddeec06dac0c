"""The motion tasks on the sequences of a pose table: the papers' classification and prediction.

Models include neither the place of a figure nor the neck's angle. The neck's mean over a sequence, and the
place where the root is first measured, are therefore subtracted before and added afterwards. A forecast must
not use later frames, not even their mean: there the three are constants of the state with a wide prior,
inferred with everything else. So are, with a narrow one, differences of the other angles from learned motion:
people differ, and the joints of a film are placed otherwise than those of captures.

Models were learned from figures that go forwards. Backward walking is much like that with time running back,
so the frames of a figure that goes backwards are labelled in reversed order, and forecast by the reversed
model as soon as the frames so far show it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array, Gaussian, unknown
from dynamics.gpb2 import switching_all
from dynamics.hmm import HMM
from dynamics.motion.rate import backwards
from dynamics.motion.tasks import CLASSIFY_TICKS, Labelling, classify, classify_hmm, predict, predict_ticks
from dynamics.posterior import InferSwitching
from dynamics.slds import SLDS
from dynamics.store import Model, kind_of
from dynamics.stride import Stride
from dynamics.variational import variational_all
from dynamics.viterbi import viterbi_all
from kinematics.direction import gone_back
from kinematics.figure_file import WALKER
from kinematics.mocap import POSE_COLUMNS
from tracker.models.centred import centred, first_place, rootless
from tracker.motion.choices import Inference, Use
from tracker.progress import Progress
from tracker.tables.poses import ROOT_COLUMNS, PoseSequence, PosesError

# Prior standard deviations of these constants: leg lengths for the place, radians for the angles.
UNKNOWN_PLACE = {"root_x": 10.0, "root_y": 10.0}
UNKNOWN_NECK = {"neck": float(np.radians(20.0))}
UNKNOWN_ANGLES = dict.fromkeys(WALKER.personal_angles, float(np.radians(3.0)))
SILENT = Progress("quiet")
OTHERWISE = "give one learned with another --inference"

INFERENCES: Mapping[Inference, InferSwitching] = {
    Inference.VITERBI: viterbi_all,
    Inference.GPB2: switching_all,
    Inference.VARIATIONAL: variational_all,
}


def chosen_inference(model: Model, asked: Inference | None) -> Inference:
    """The inference for this kind of model, GPB2 or HMM unless asked; ValueError if they do not fit."""
    if isinstance(model, Stride):
        raise ValueError(f"the model is {kind_of(model)}, which cannot classify; {OTHERWISE}")
    hidden = isinstance(model, HMM)
    if asked is None:
        return Inference.HMM if hidden else Inference.GPB2
    if hidden != (asked is Inference.HMM):
        fits = "hmm" if hidden else "viterbi, gpb2 or variational"
        raise ValueError(f"the model is {kind_of(model)}: it wants --inference {fits}, not {asked.value}")
    return asked


def whole_pose(model: Model, task: str) -> SLDS:
    """The model, if it has dynamics of all columns of a pose table; else a ValueError."""
    if not isinstance(model, SLDS):
        raise ValueError(f"the model is {kind_of(model)}, which cannot {task}; {OTHERWISE}")
    check_names(model.names)
    return model


def check_names(names: Sequence[str]) -> None:
    """ValueError unless a model's freedoms are those of a pose table."""
    if tuple(names) != POSE_COLUMNS:
        raise ValueError(
            f"the model speaks of {', '.join(names)}; a pose table of {', '.join(POSE_COLUMNS)}; "
            "give a model of the figure walker"
        )


def label_all(
    model: Model,
    sequences: Sequence[PoseSequence],
    *,
    inference: Inference,
    use: Use = Use.ANGLES,
    progress: Progress = SILENT,
) -> list[Labelling]:
    """The motion of every frame of every sequence.

    Args:
        inference: one that fits the model, see `chosen_inference`.
        use: whether the root's travel and height are used too, or the angles only.

    Raises:
        PosesError: a sequence without a measured angle, or without a root where that is used.
        ValueError: a model of other freedoms, or options that do not fit the model or the inference.
    """
    orders = [sequence.order(model.fps) for sequence in sequences]
    ys = [_evidence(replace(s, y=s.y[order]), use) for s, order in zip(sequences, orders, strict=True)]
    found = _labelled(model, ys, inference, use, progress)
    return [
        replace(f, label=f.label[order], state=f.state[order], prob=f.prob[order])
        for f, order in zip(found, orders, strict=True)
    ]


def _labelled(
    model: Model, ys: Sequence[Array], inference: Inference, use: Use, progress: Progress
) -> list[Labelling]:
    """`label_all` of figures that go forwards."""
    if isinstance(model, HMM):
        picked = _columns(model, use)
        return classify_hmm(model, [y[:, picked] for y in ys])
    slds = whole_pose(model, "classify")
    if use is Use.ALL and inference is Inference.VARIATIONAL:
        raise ValueError("variational inference labels by angles only; leave out --use all, or take gpb2")
    if use is Use.ALL:
        slds = slds.with_constants(UNKNOWN_PLACE)
    with progress.task("classifying", CLASSIFY_TICKS) as tick:
        return classify(slds, ys, infer=INFERENCES[inference], tick=tick)


def forecast_all(
    slds: SLDS, sequences: Sequence[PoseSequence], horizon: int, progress: Progress = SILENT
) -> list[Gaussian]:
    """Forecasts of each frame from `horizon` frames before it: mean (T + horizon, 8) and cov, body units.

    NaN where no earlier frame exists, and for the place before the root was measured. PosesError: a sequence
    without a measured number.
    """
    starts = [first_measured(sequence) for sequence in sequences]
    places = [first_place(sequence.y) for sequence in sequences]
    ys = [s.y[start:] - place for s, start, place in zip(sequences, starts, places, strict=True)]
    expected = _expected(slds, ys, horizon, progress)
    forecasts = []
    for s, start, place, ahead in zip(sequences, starts, places, expected, strict=True):
        forecast = unknown(len(s) + horizon, len(POSE_COLUMNS))
        forecast[start:] = Gaussian(ahead.mean + place, ahead.cov)
        for column in range(ROOT_COLUMNS):
            seen = np.flatnonzero(s.seen[:, column])
            unplaced = seen[0] + horizon if len(seen) else len(forecast.mean)
            forecast.mean[:unplaced, column] = forecast.cov[:unplaced, column, column] = np.nan
        forecasts.append(forecast)
    return forecasts


def _expected(slds: SLDS, ys: Sequence[Array], horizon: int, progress: Progress) -> list[Gaussian]:
    """Forecasts by the model, and by the reversed one once the frames show that a figure goes backwards."""
    back = [np.flatnonzero(gone_back(y[:, 0], np.arange(len(y)) / slds.fps)) for y in ys]
    turned = [i for i, frames in enumerate(back) if len(frames)]
    again = [ys[i] for i in turned]
    constants = UNKNOWN_PLACE | UNKNOWN_NECK | UNKNOWN_ANGLES
    ticks = predict_ticks(ys) + (predict_ticks(again) if turned else 0)
    with progress.task("predicting", ticks) as tick:
        found = predict(slds.with_constants(constants), ys, horizon, tick)
        other = predict(backwards(slds).with_constants(constants), again, horizon, tick) if turned else []
    for i, ahead in zip(turned, other, strict=True):
        rows = back[i] + horizon
        found[i][rows] = ahead[rows]
    return found


def _evidence(sequence: PoseSequence, use: Use) -> Array:
    """The poses used for labelling: centred, with the root set to not measured unless it is used."""
    if not sequence.seen[:, ROOT_COLUMNS:].any():
        raise PosesError(f"sequence {sequence.name!r} has no measured angle; leave it out")
    y = centred(sequence.y)
    if use is Use.ANGLES:
        return rootless(y)
    if not sequence.seen[:, :ROOT_COLUMNS].any(0).all():
        raise PosesError(
            f"--use all wants root_x and root_y, sequence {sequence.name!r} lacks them; give --use angles"
        )
    return y


def _columns(hmm: HMM, use: Use) -> list[int]:
    unknown = [name for name in hmm.names if name not in POSE_COLUMNS]
    if unknown:
        raise ValueError(
            f"the model speaks of {', '.join(hmm.names)}; a pose table has no {unknown[0]}; learn it again"
        )
    if use is Use.ALL and not set(POSE_COLUMNS[:ROOT_COLUMNS]) <= set(hmm.names):
        raise ValueError(f"--use all: the model speaks of {', '.join(hmm.names)} only; give --use angles")
    return [POSE_COLUMNS.index(name) for name in hmm.names]


def first_measured(sequence: PoseSequence) -> int:
    """The first frame with a measured number; PosesError if there is none."""
    seen = np.flatnonzero(sequence.seen.any(1))
    if not len(seen):
        raise PosesError(f"sequence {sequence.name!r} has no measured number; leave it out")
    return int(seen[0])
