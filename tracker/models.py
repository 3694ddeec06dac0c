"""Which motion model a name means, and how it is learned from captures."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from dynamics.em import Options, anywhere, learn
from dynamics.rate import at_rate
from dynamics.slds import SLDS, combine, constant_velocity
from dynamics.store import load, load_shipped
from dynamics.viterbi import viterbi_all
from kinematics.mocap import POSE_COLUMNS, mirror
from tracker.sampling import Array
from tracker.settings import Settings

TRAVELLING = ("root_x", "root_y")
CONSTANT_VELOCITY = "cv"
FIRST_ROOT_SPEED = (0.06, 0.02)  # leg lengths a frame at 30 fps: a runner's, along and across the ground
FIRST_ANGLE_SPEED = float(np.radians(4.0))  # a frame at 30 fps


def find_model(name: str, fps: float, settings: Settings) -> SLDS:
    """The model a user names, at this frame rate; a learned one once for each playback speed that is tried.

    Args:
        name: "cv" for constant velocity, a shipped model's name, or a file that ends in .npz.
        fps: frames a second of the motion to be followed.

    Raises:
        ModelError: no such model, or a file that cannot be used.
        ValueError: a frame rate that the model cannot be converted to.
    """
    if name == CONSTANT_VELOCITY:
        return _constant_velocity(fps, settings)
    is_file = name.endswith(".npz") or Path(name).is_file()
    speeds = []
    for rate in settings.rates:
        learned = load(name) if is_file else load_shipped(name, fps / rate)
        speeds.append(replace(at_rate(learned, fps / rate), fps=fps))
    return combine(speeds, settings.rate_change)


def state_rates(slds: SLDS, settings: Settings) -> Array:
    """(K,) the playback speed that each switching state of `find_model` stands for."""
    if slds.labels == (CONSTANT_VELOCITY,):
        return np.ones(1)
    return np.repeat(settings.rates, slds.K // len(settings.rates))


def learn_motions(
    sequences: Sequence[tuple[str, str, Array]],
    *,
    fps: float,
    options: Options,
    pooled: bool = False,
    noise: float = 0.0,
    progress: Callable[[str, int, int], None] | None = None,
) -> SLDS:
    """One model of several motions: each learned by itself, then joined.

    Every sequence is used twice, with near and far legs exchanged the second time; subjects count alike; the
    neck's mean over a sequence is taken off.

    Args:
        sequences: (subject, label, poses (T, 8) in body units) each.
        fps: their frame rate.
        options: states are per motion.
        pooled: learn all motions as one, labelled with their names joined by a hyphen.
        noise: standard deviation added to the angles, radians.
        progress: called with the motion, the round and the rounds in all.

    Raises:
        ValueError: no sequences, or unusable ones.
    """
    if not sequences:
        raise ValueError("learning needs at least one sequence; got none")
    rng = np.random.default_rng(options.seed)
    labels = sorted({label for _, label, _ in sequences}, reverse=True)
    groups = [labels] if pooled else [[label] for label in labels]
    models = []
    for group in groups:
        name = "-".join(group)
        poses, weights = _prepared([s for s in sequences if s[1] in group], noise, rng)
        report = None if progress is None else _reporter(progress, name, options.rounds)
        fit = learn(
            poses,
            names=POSE_COLUMNS,
            travelling=TRAVELLING,
            fps=fps,
            label=name,
            options=options,
            weights=weights,
            progress=report,
        )
        models.append(anywhere(fit.slds, viterbi_all(fit.slds, poses)))
    return combine(models)


def _reporter(
    progress: Callable[[str, int, int], None], name: str, rounds: int
) -> Callable[[int, float], None]:
    return lambda done, _: progress(name, done + 1, rounds)


def _prepared(
    sequences: Sequence[tuple[str, str, Array]], noise: float, rng: np.random.Generator
) -> tuple[list[Array], Array]:
    poses, keys = [], []
    neck = POSE_COLUMNS.index("neck")
    for subject, label, y in sequences:
        centred = y.copy()
        centred[:, neck] -= centred[:, neck].mean()
        centred[:, :2] -= centred[0, :2]
        for twin in (centred, mirror(centred)):
            spoiled = twin.copy()
            spoiled[:, 2:] += rng.normal(scale=noise, size=spoiled[:, 2:].shape) if noise > 0 else 0.0
            poses.append(spoiled)
            keys.append((label, subject))
    frames: dict[str, dict[tuple[str, str], int]] = {}
    for key, y in zip(keys, poses, strict=True):
        of_label = frames.setdefault(key[0], {})
        of_label[key] = of_label.get(key, 0) + len(y)
    weights = np.array([1.0 / (len(frames[key[0]]) * frames[key[0]][key]) for key in keys])
    return poses, weights * len(weights) / weights.sum()


def _constant_velocity(fps: float, settings: Settings) -> SLDS:
    """Noise is a change of speed a frame: in proportion to the square of a frame's length."""
    step = 30.0 / fps
    angles = len(POSE_COLUMNS) - len(TRAVELLING)
    noise = np.r_[[settings.cv_place] * len(TRAVELLING), [np.radians(settings.cv_angle)] * angles]
    speed = np.r_[FIRST_ROOT_SPEED, [FIRST_ANGLE_SPEED] * angles]
    return constant_velocity(POSE_COLUMNS, noise * step**2, speed * step, fps)
