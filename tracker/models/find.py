"""Which motion model a name means, and how it is learned from captures."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dynamics.frames import batches
from dynamics.gaussian import Array, collapse
from dynamics.gpb2 import gpb2_all
from dynamics.hmm import HMM, combine_hmms
from dynamics.layout import among
from dynamics.learning.baum_welch import HMMOptions, learn_hmm
from dynamics.learning.em import anywhere, learn
from dynamics.learning.options import Options
from dynamics.learning.selection import choose
from dynamics.motion.rate import at_rate
from dynamics.periodic.learn import learn as learn_stride
from dynamics.posterior import Infer, Posterior
from dynamics.slds import CROSSING, SLDS, combine, constant_velocity
from dynamics.store import Model, ModelError, load, load_shipped, shipped
from dynamics.stride import Stride, combine_strides
from dynamics.variational import Variational, variational_batches
from dynamics.viterbi import viterbi_all
from kinematics.figure import ROOT, Figure
from kinematics.figure_file import WALKER
from tracker.models.slower import slower
from tracker.run.track import FREE
from tracker.settings import Settings

CONSTANT_VELOCITY = "cv"
FIRST_ROOT_SPEED = (0.06, 0.02)  # leg lengths a frame at 30 fps: a runner's, along and across the ground
FIRST_ANGLE_SPEED = float(np.radians(4.0))  # a frame at 30 fps
VITERBI = "viterbi"
INFERENCES = (VITERBI, "gpb2", "variational")
STRIDE_ROUNDS = 10  # of EM

Labelled = tuple[str, str, Array]
Batches = Callable[[SLDS, Sequence[Array]], list[list[int]]]
Spread = Callable[[Callable[[], Infer], Batches], Infer]


def find_model(name: str, fps: float, settings: Settings, rate: float = 1.0, figure: Figure = WALKER) -> SLDS:
    """The model a user names, at this frame rate, as the tracker uses it.

    The noise of a learned one is inflated for people it has not seen. At second order one free state of
    constant velocity joins it, for what it does not foresee.

    Args:
        name: "cv" for constant velocity, a shipped model's name, or a file that ends in .npz.
        fps: frames a second of the clip.
        rate: its playback speed, 1 as filmed.
        figure: of whose freedoms it is to speak; what ships under its name and this one goes first.

    Raises:
        ModelError: no such model, or a file that cannot be used.
        ValueError: a frame rate that the model cannot be converted to.
    """
    if name == CONSTANT_VELOCITY:
        return _constant_velocity(figure.learned_freedoms, fps, settings)
    try:
        learned = replace(switching_model(name, fps / rate, figure), fps=fps)
    except ValueError as error:
        raise ValueError(
            f"{name} cannot be had at {fps / rate:g} frames a second (a clip of {fps:g}, played at {rate:g} "
            "of its speed); give --model cv, or --rate where the clip is played faster or slower than filmed"
        ) from error
    inflated = replace(learned, Q=learned.Q * settings.inflation)
    if settings.surprise == 0.0 or learned.order == 1:
        return inflated
    surprise = settings.surprise
    return combine([inflated, _free(inflated, settings)], surprise, [1.0 - surprise, surprise])


def switching_model(name: str, fps: float, figure: Figure = WALKER) -> SLDS:
    """The learned model of this name at this frame rate; raises as `find_model`."""
    model = motion_model(own_model(name, figure), fps)
    if not isinstance(model, SLDS):
        kind = "a hidden Markov model" if isinstance(model, HMM) else "a harmonic stride"
        raise ModelError(f"{name} is {kind}, which has no dynamics from frame to frame; learn one without it")
    return at_rate(model, fps)


def own_model(name: str, figure: Figure) -> str:
    """The name of the model that ships for a figure under another's name, else that name."""
    own = f"{figure.name}-{name}"
    return own if own in shipped() else name


def motion_model(name: str, fps: float = 30.0) -> Model:
    """A model as it was learned: a file's, or the shipped one of this name whose rate is nearest to `fps`."""
    is_file = name.endswith(".npz") or Path(name).is_file()
    return load(name) if is_file else load_shipped(name, fps)


@dataclass(frozen=True)
class ESteps:
    """How the E-steps of learning are done.

    inference : one of INFERENCES
    spread    : makes an E-step one that works elsewhere (`tracker.models.cluster`); None works here
    tick      : called after each
    """

    inference: str = VITERBI
    spread: Spread | None = None
    tick: Callable[[], None] = lambda: None

    def begin(self) -> Infer:
        """A fresh E-step: variational inference keeps its posterior from round to round."""
        steps: dict[str, tuple[Callable[[], Infer], Batches]] = {
            VITERBI: (lambda: viterbi_all, batches),
            "gpb2": (lambda: gpb2_all, batches),
            "variational": (Variational, variational_batches),
        }
        make, own = steps[self.inference]
        step = make() if self.spread is None else self.spread(make, own)

        def infer(slds: SLDS, ys: Sequence[Array]) -> list[Posterior]:
            found = step(slds, ys)
            self.tick()
            return found

        return infer


def learn_motions(
    sequences: Sequence[Labelled],
    *,
    fps: float,
    options: Options,
    figure: Figure = WALKER,
    pooled: bool = False,
    noise: float = 0.0,
    choose_from: Sequence[int] = (),
    slower_too: Collection[str] = (),
    e_steps: ESteps = ESteps(),
) -> SLDS:
    """One model of several motions: each learned by itself, then joined.

    Every sequence is used twice, with near and far side exchanged the second time; subjects count alike;
    means over a sequence that are a figure's own, as the neck's of the walking one, are taken off.

    Args:
        sequences: (subject, label, poses (T, M) in body units) each.
        fps: their frame rate.
        options: states are per motion.
        figure: whose learned freedoms they are.
        pooled: learn all motions as one, labelled with their names joined by a hyphen.
        noise: standard deviation added to the angles, radians.
        choose_from: numbers of states to choose from for each motion, by the likelihood of subjects held out
            (`dynamics.learning.selection`); empty takes those of the options.
        slower_too: labels that are learned slower and smaller too (`tracker.models.slower`).
        e_steps: of the learning itself; a choice between states is made by approximate Viterbi.

    Raises:
        ValueError: no sequences, or unusable ones; a choice between states with fewer than two subjects.
    """
    models = []
    for motion in _motions(_with_slower(sequences, slower_too), figure, pooled, noise, options.seed):
        chosen = _chosen(motion, fps, options, choose_from, e_steps) if choose_from else options
        fit = learn(
            motion.poses,
            names=motion.names,
            travelling=ROOT,
            fps=fps,
            label=motion.name,
            options=chosen,
            weights=motion.weights,
            infer=e_steps.begin(),
        )
        models.append(anywhere(fit.slds, viterbi_all(fit.slds, motion.poses)))
    return combine(models)


def learn_hmms(
    sequences: Sequence[Labelled],
    *,
    fps: float,
    options: HMMOptions,
    figure: Figure = WALKER,
    noise: float = 0.0,
) -> HMM:
    """The same with hidden Markov models of the angles, the papers' baseline."""
    angles = ~among(figure.learned_freedoms, ROOT)
    names = [name for name in figure.learned_freedoms if name not in ROOT]
    models = []
    for motion in _motions(sequences, figure, False, noise, options.seed):
        seen = [y[:, angles] for y in motion.poses]
        fit = learn_hmm(
            seen, names=names, fps=fps, label=motion.name, options=options, weights=motion.weights
        )
        models.append(fit.hmm)
    return combine_hmms(models, CROSSING)


def learn_strides(
    sequences: Sequence[Labelled],
    *,
    fps: float,
    figure: Figure = WALKER,
    noise: float = 0.0,
    rounds: int = STRIDE_ROUNDS,
    seed: int = 0,
    tick: Callable[[], None] = lambda: None,
) -> Stride:
    """The same with harmonic strides; `tick` is called after each of the rounds of each motion.

    Raises:
        ValueError: no sequences, or none of a motion that is long enough.
    """
    models = [
        learn_stride(
            motion.poses[::2],  # a stride's mirror image is known without learning from it
            motion.subjects[::2],
            names=motion.names,
            travelling=ROOT,
            twins=figure.exchanged[: len(motion.names)],
            fps=fps,
            label=motion.name,
            rounds=rounds,
            tick=tick,
        )
        for motion in _motions(sequences, figure, False, noise, seed)
    ]
    return combine_strides(models)


@dataclass(frozen=True)
class _Motion:
    """What one motion is learned from: subjects and weights are those of each sequence."""

    name: str
    names: tuple[str, ...]
    poses: list[Array]
    subjects: list[str]
    weights: Array


def _chosen(motion: _Motion, fps: float, options: Options, states: Sequence[int], e_steps: ESteps) -> Options:
    """The simplest candidate that subjects held out do not speak against."""
    return choose(
        motion.poses,
        motion.subjects,
        [replace(options, states=n, restarts=1) for n in states],
        names=motion.names,
        travelling=ROOT,
        fps=fps,
        infer=ESteps(spread=e_steps.spread).begin(),
    ).best


def _with_slower(sequences: Sequence[Labelled], labels: Collection[str]) -> list[Labelled]:
    """The sequences, those of these labels followed by slower copies."""
    return [
        (subject, label, copy)
        for subject, label, y in sequences
        for copy in ([y, *slower(y)] if label in labels else [y])
    ]


def _motions(
    sequences: Sequence[Labelled], figure: Figure, pooled: bool, noise: float, seed: int
) -> Iterator[_Motion]:
    """What each motion is to be learned from."""
    if not sequences:
        raise ValueError("learning needs at least one sequence; got none")
    rng = np.random.default_rng(seed)
    labels = sorted({label for _, label, _ in sequences}, reverse=True)
    for group in [labels] if pooled else [[label] for label in labels]:
        of_group = [s for s in sequences if s[1] in group]
        yield _motion("-".join(group), of_group, figure, noise, rng)


def _motion(
    name: str, sequences: Sequence[Labelled], figure: Figure, noise: float, rng: np.random.Generator
) -> _Motion:
    names = figure.learned_freedoms
    poses, subjects, keys = [], [], []
    own = [names.index(freedom) for freedom in figure.offsets("marked") if freedom in names]
    for subject, label, y in sequences:
        centred = y.copy()
        centred[:, own] -= centred[:, own].mean(axis=0)
        centred[:, :2] -= centred[0, :2]
        for twin in (centred, centred[:, figure.exchanged[: len(names)]]):
            spoiled = twin.copy()
            spoiled[:, 2:] += rng.normal(scale=noise, size=spoiled[:, 2:].shape) if noise > 0 else 0.0
            poses.append(spoiled)
            subjects.append(subject)
            keys.append((label, subject))
    frames: dict[str, dict[tuple[str, str], int]] = {}
    for key, y in zip(keys, poses, strict=True):
        of_label = frames.setdefault(key[0], {})
        of_label[key] = of_label.get(key, 0) + len(y)
    weights = np.array([1.0 / (len(frames[key[0]]) * frames[key[0]][key]) for key in keys])
    return _Motion(name, names, poses, subjects, weights * len(weights) / weights.sum())


def _constant_velocity(names: Sequence[str], fps: float, settings: Settings) -> SLDS:
    """Noise is a change of speed a frame: in proportion to the square of a frame's length."""
    step = 30.0 / fps
    noise = by_freedom(names, settings.cv_place, np.radians(settings.cv_angle))
    speed = by_freedom(names, 0.0, FIRST_ANGLE_SPEED)
    speed[: len(ROOT)] = FIRST_ROOT_SPEED
    return constant_velocity(names, noise * step**2, speed * step, fps)


def _free(learned: SLDS, settings: Settings) -> SLDS:
    """One state of constant velocity that joins a learned model; it starts where any of its states does."""
    noise = by_freedom(learned.names, settings.free_place, np.radians(settings.free_angle))
    free = constant_velocity(
        learned.names, noise * (30.0 / learned.fps) ** 2, np.zeros(len(noise)), learned.fps
    )
    start = collapse(np.full(learned.K, 1.0 / learned.K), learned.start)
    return replace(
        free,
        R=learned.R,
        mean0=start.mean[None],
        cov0=start.cov[None],
        travelling=learned.travelling,
        labels=(FREE,),
    )


def by_freedom(names: Sequence[str], place: float, angle: float) -> Array:
    """(M,) one value for the root's freedoms and one for the angles."""
    return np.where(among(names, ROOT), place, angle)
