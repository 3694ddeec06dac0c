"""One model of several motions, learned from labelled captures."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dynamics.frames import frame_batches
from dynamics.gaussian import Array
from dynamics.gpb2 import gpb2_all
from dynamics.hmm import HMM, combine_hmms
from dynamics.learning.baum_welch import learn_hmm
from dynamics.learning.em import anywhere, learn
from dynamics.learning.options import DEFAULTS, Options
from dynamics.periodic.learn import learn as learn_stride
from dynamics.posterior import Infer, Posterior
from dynamics.slds import SLDS, combine
from dynamics.stride import Stride, combine_strides
from dynamics.variational import Variational, variational_batches
from dynamics.viterbi import viterbi_all
from kinematics.figure import ROOT, Figure
from kinematics.figure_file import WALKER
from tracker.models.centred import ANGLES, centred
from tracker.models.copies import Labelled

VITERBI = "viterbi"

Batches = Callable[[SLDS, Sequence[Array]], list[list[int]]]
Spread = Callable[[Callable[[], Infer], Batches], Infer]

# For each inference, the function that makes its E-step, and the one that forms its batches.
E_STEPS: dict[str, tuple[Callable[[], Infer], Batches]] = {
    VITERBI: (lambda: viterbi_all, frame_batches),
    "gpb2": (lambda: gpb2_all, frame_batches),
    "variational": (Variational, variational_batches),
}


@dataclass(frozen=True)
class ESteps:
    """The E-steps of learning.

    inference : viterbi, gpb2 or variational
    spread    : makes an E-step run on a cluster (`tracker.models.cluster`); None runs it in this process
    tick      : called after each E-step
    """

    inference: str = VITERBI
    spread: Spread | None = None
    tick: Callable[[], None] = lambda: None

    def begin(self) -> Infer:
        """A new E-step, since variational inference keeps its posterior from round to round."""
        make, own = E_STEPS[self.inference]
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
    e_steps: ESteps = ESteps(),
) -> SLDS:
    """One model of several motions, each learned separately and then joined.

    Every sequence is used twice, with near and far side exchanged the second time; subjects count equally;
    constants of each figure, such as the walking one's neck, are subtracted as means over a sequence.

    Args:
        sequences: (subject, label, poses (T, M) in body units of the figure's learned freedoms) each.
        options: states are per motion.
        pooled: learn all motions as one, labelled with their names joined by a hyphen.
        noise: standard deviation added to the angles, radians.
        e_steps: of learning.

    Raises:
        ValueError: no sequences, or unusable ones.
    """
    models = []
    for motion in _motions(sequences, figure, pooled, noise, options.seed):
        fit = learn(
            motion.poses,
            names=motion.names,
            travelling=ROOT,
            fps=fps,
            label=motion.name,
            options=options,
            weights=motion.weights,
            infer=e_steps.begin(),
        )
        models.append(anywhere(fit.slds, viterbi_all(fit.slds, motion.poses)))
    return combine(models)


def learn_hmms(
    sequences: Sequence[Labelled],
    *,
    fps: float,
    options: Options,
    figure: Figure = WALKER,
    noise: float = 0.0,
) -> HMM:
    """One model of several motions from hidden Markov models of the angles, the papers' baseline."""
    models = [
        learn_hmm(
            [y[:, ANGLES] for y in motion.poses],
            names=motion.names[ANGLES],
            fps=fps,
            label=motion.name,
            options=options,
            weights=motion.weights,
        ).hmm
        for motion in _motions(sequences, figure, False, noise, options.seed)
    ]
    return combine_hmms(models)


def learn_strides(
    sequences: Sequence[Labelled],
    *,
    fps: float,
    options: Options = DEFAULTS,
    figure: Figure = WALKER,
    noise: float = 0.0,
    tick: Callable[[], None] = lambda: None,
) -> Stride:
    """One model of several motions from harmonic strides; of the options, rounds and seed are used.

    `tick` is called after each round of each motion. ValueError: no sequences, or none long enough.
    """
    models = [
        learn_stride(
            # Without mirror images, which the harmonic stride includes anyway.
            list(zip(motion.subjects[::2], motion.poses[::2], strict=True)),
            names=motion.names,
            travelling=ROOT,
            twins=figure.exchanged[: len(motion.names)],
            fps=fps,
            label=motion.name,
            rounds=options.rounds,
            tick=tick,
        )
        for motion in _motions(sequences, figure, False, noise, options.seed)
    ]
    return combine_strides(models)


@dataclass(frozen=True)
class _Motion:
    """The data of one motion: poses, and the subject and weight of each sequence."""

    name: str
    names: tuple[str, ...]
    poses: list[Array]
    subjects: list[str]
    weights: Array


def _motions(
    sequences: Sequence[Labelled], figure: Figure, pooled: bool, noise: float, seed: int
) -> Iterator[_Motion]:
    if not sequences:
        raise ValueError("learning needs at least one sequence; got none")
    rng = np.random.default_rng(seed)
    labels = sorted({label for _, label, _ in sequences}, reverse=True)
    for group in [labels] if pooled else [[label] for label in labels]:
        # By subject, so that the noise that each gets does not depend on the order of files.
        of_group = sorted((s for s in sequences if s[1] in group), key=lambda s: s[0])
        yield _motion("-".join(group), of_group, figure, noise, rng)


def _motion(
    name: str, sequences: Sequence[Labelled], figure: Figure, noise: float, rng: np.random.Generator
) -> _Motion:
    names = figure.learned_freedoms
    poses, whose = [], []
    frames: Counter[tuple[str, str]] = Counter()  # by label and subject
    for subject, label, y in sequences:
        own = centred(y, figure)
        for twin in (own, own[:, figure.exchanged[: len(names)]]):
            spoiled = twin.copy()
            spoiled[:, ANGLES] += rng.normal(scale=noise, size=spoiled[:, ANGLES].shape) if noise > 0 else 0.0
            poses.append(spoiled)
            whose.append((label, subject))
            frames[label, subject] += len(y)
    people = Counter(label for label, _ in frames)
    weights = np.array([1.0 / (people[label] * frames[label, subject]) for label, subject in whose])
    subjects = [subject for _, subject in whose]
    return _Motion(name, names, poses, subjects, weights * len(weights) / weights.sum())
