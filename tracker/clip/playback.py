"""Playback speed of a clip (1 as filmed, 0.5 slow motion at half speed), and the motion of each frame.

The speed is that of a grid at which the tracked poses are most likely under a learned model (GPB2's
evidence). A gait has its own pace, so a stride that takes twice as many frames was filmed or played at half
speed. At that speed the model labels the motions, since at another a slow jog has the pace of a walk.
"""

from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array
from dynamics.gpb2_filter import gpb2_filter
from dynamics.motion.rate import backwards
from dynamics.motion.tasks import labelled
from dynamics.slds import SLDS
from kinematics.figure import Figure
from kinematics.figure_file import WALKER
from tracker.models.centred import centred
from tracker.models.find import CONSTANT_VELOCITY, by_freedom, own_model, switching_model
from tracker.settings import Settings

LEAST = 0.5  # seconds of a film, half a stride, that a pace is told from
RATES = tuple(float(rate) for rate in 2.0 ** np.arange(-2.0, 1.01, 0.25))
ENOUGH = 600  # frames that suffice to measure the pace, twenty seconds at 30 a second
TRAVEL = 1.0  # least travel, leg lengths, that decides between walking forwards and backwards
PLACE, ANGLE = 0.02, float(np.radians(3.0))  # noise of tracked poses: leg lengths, radians
CONSTANT = float(np.radians(Settings().constant))  # spread of constant differences from learned motion
OTHERWISE = "walk-run"  # model that measures the pace if the clip was followed without a learned one


def playback_rate(model: str, poses: Array, fps: float, figure: Figure = WALKER) -> float:
    """The speed at which a clip is played, among RATES; 1 where no model knows how the figure moves, and in
    a film too short to tell.

    Args:
        model: with which the clip was followed, see `tracker.models.find.find_model`.
        poses: (T, M) tracked root and angles; rows of NaN where the figure was lost.
        fps: frames a second of the clip.
    """
    name = OTHERWISE if model == CONSTANT_VELOCITY else model
    known = np.isfinite(poses).all(1)
    foreign = figure.learned_freedoms != WALKER.learned_freedoms and own_model(name, figure) == name
    if known.sum() < LEAST * fps or (model == CONSTANT_VELOCITY and foreign):
        return 1.0
    some = poses[known.argmax() :][:ENOUGH]
    y = centred(some, figure)

    def fit(number: int) -> float:
        try:
            slds = switching_model(name, fps / RATES[number], figure)
        except ValueError:  # a frame rate to which the model cannot be converted
            return -np.inf
        return max(_evidence(way, y) for way in _ways(slds, some, figure))

    # Every other speed of the grid first, then the neighbours of the best.
    fits = {number: fit(number) for number in range(0, len(RATES), 2)}
    best = max(fits, key=lambda number: fits[number])
    fits |= {number: fit(number) for number in (best - 1, best + 1) if 0 <= number < len(RATES)}
    best = max(fits, key=lambda number: fits[number])
    return RATES[best] if fits[best] > -np.inf else 1.0


def motions_at(model: str, poses: Array, fps: float, figure: Figure = WALKER) -> tuple[str, ...]:
    """The motion of each of the T frames, `fps` a second of what was filmed; arguments as `playback_rate`.

    Labels are those of `dynamics.motion.tasks.classify` by GPB2, in pieces of ENOUGH frames. A frame without
    a pose gets the motion of its neighbours; at least one frame must have a pose.
    """
    slds = switching_model(model, fps, figure)
    rows = np.arange(len(poses))
    known = np.asarray(np.isfinite(poses).all(1))
    said = np.full(len(poses), "", dtype=object)
    for start in rows[::ENOUGH]:
        here = rows[start : start + ENOUGH]
        here = here[known[here].argmax() :]
        if known[here[0]]:
            y = centred(poses[here], figure)
            way = max(_ways(slds, poses[here], figure), key=lambda way: _evidence(way, y))
            said[here] = labelled(way, [y])[0].label
    told = said != ""
    return tuple(said[np.maximum.accumulate(np.where(told, rows, told.argmax()))])


def _ways(slds: SLDS, poses: Array, figure: Figure) -> list[SLDS]:
    """The model, and its time reversal if the figure may be walking backwards, of somebody's tracked poses.

    These have noise, and unknown constant differences of angles.
    """
    known = poses[np.isfinite(poses).all(1), 0]
    travel = float(known[-1] - known[0])
    ways = [slds] if travel > -TRAVEL else []
    ways += [backwards(slds)] if travel < TRAVEL else []
    R = np.diag(by_freedom(slds.names, PLACE, ANGLE) ** 2)
    return [replace(way, R=R).with_constants(dict.fromkeys(figure.personal_angles, CONSTANT)) for way in ways]


def _evidence(slds: SLDS, y: Array) -> float:
    """Log evidence of poses under a model by GPB2, nats."""
    return float(gpb2_filter(slds, y).log_evidence.sum())
