"""Common data of the papers' experiments: captures, groups to hold out, and the models learned without them.

Everything is drawn from one seed. People are identified by the table's `subject`.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from dynamics.hmm import HMM
from dynamics.learning.baum_welch import ROUNDS
from dynamics.learning.options import Options
from dynamics.slds import SLDS
from dynamics.store import Model
from kinematics.mocap import CURVE, SHORTEST, read_trials, sequences
from kinematics.mocap import Sequence as Capture
from tracker.models.by_motion import learn_hmms, learn_motions, learn_strides
from tracker.models.learn import NOISE, STATES
from tracker.progress import Item, Progress

FPS = 30.0
MOTIONS = ("walk", "run")
FOLDS = 3
QUICK_FRAMES = 120  # largest part of a capture used for a quick run
QUICK_ROUNDS = 2


@dataclass(frozen=True)
class Recipe:
    """How one model is learned; the defaults are those of `figtrack learn`.

    states  : per motion; 0 for a harmonic stride
    order   : 1 or 2; 0 for a hidden Markov model of the angles
    noise   : added to the angles, degrees
    held    : subjects left out
    motions : that are learned and joined
    """

    states: int = STATES
    order: int = 2
    noise: float = NOISE
    held: frozenset[str] = frozenset()
    motions: tuple[str, ...] = MOTIONS


class Study:
    """The captures of an experiment and the models learned from them, each learned once.

    captures : straight segments, for tests
    taught   : captures for learning, which include bends
    folds    : groups of subjects to leave out in turn; none if there are too few subjects
    progress : of the experiments
    """

    def __init__(
        self,
        captures: Sequence[Capture],
        taught: Sequence[Capture],
        progress: Progress,
        *,
        seed: int = 0,
        quick: bool = False,
    ) -> None:
        self.seed, self.quick, self.progress = seed, quick, progress
        self.captures = _some(captures) if quick else tuple(captures)
        self.taught = self.captures if quick else tuple(taught)
        self.motions = tuple(m for m in MOTIONS if any(c.label == m for c in self.captures))
        self.folds = _folds(self.captures, self.motions, 2 if quick else FOLDS, seed)
        self._models: dict[Recipe, Model] = {}

    @property
    def held_out(self) -> tuple[frozenset[str], ...]:
        """The folds, or one that leaves out nobody."""
        return self.folds or (frozenset(),)

    @property
    def unseen(self) -> str:
        return (
            "left out in learning" if self.folds else "also learned from, as there are too few to leave out"
        )

    def rng(self, *key: int) -> np.random.Generator:
        """A random generator for each key."""
        return np.random.default_rng([self.seed, *key])

    def of(self, motion: str) -> list[Capture]:
        return [c for c in self.captures if c.label == motion]

    def tested(self, held: frozenset[str]) -> list[Capture]:
        """The captures for testing a model: those of the subjects held out, or all if nobody was."""
        return [c for c in self.captures if not held or c.subject in held]

    def lessons(self, recipe: Recipe) -> list[Capture]:
        """The captures from which a recipe's model is learned."""
        return [c for c in self.taught if c.label in recipe.motions and c.subject not in recipe.held]

    def slds(self, recipe: Recipe) -> SLDS:
        return cast(SLDS, self.learn(recipe))

    def hmm(self, recipe: Recipe) -> HMM:
        return cast(HMM, self.learn(recipe))

    def learn(self, recipe: Recipe) -> Model:
        """The model of a recipe, learned at the first call."""
        if recipe not in self._models:
            self._models[recipe] = self._learned(recipe)
        return self._models[recipe]

    def each(self, name: str, items: Collection[Item]) -> Iterator[Item]:
        return self.progress.through(name, items, len(items))

    def _learned(self, recipe: Recipe) -> Model:
        data = [(c.subject, c.label, c.y) for c in self.lessons(recipe)]
        options = Options(states=recipe.states, order=recipe.order, seed=self.seed)
        told: Any = {"fps": FPS, "noise": float(np.radians(recipe.noise))}
        if recipe.states and recipe.order == 0:
            return learn_hmms(data, options=replace(options, rounds=ROUNDS), **told)
        if self.quick:
            options = replace(options, rounds=QUICK_ROUNDS)
        return (learn_motions if recipe.states else learn_strides)(data, options=options, **told)


def read_study(trials: Path, progress: Progress, *, seed: int = 0, quick: bool = False) -> Study:
    """The walks and runs of a table; MotionError: it or a capture cannot be read, ValueError: it has none."""
    wanted = [trial for trial in read_trials(trials) if trial.activity in MOTIONS]
    straight: list[Capture] = []
    taught: list[Capture] = []
    for trial in progress.through("reading captures", wanted, len(wanted)):
        found = sequences(trial, FPS)
        straight += found
        taught += sequences(trial, FPS, curves=True) if CURVE in trial.tags else found
    if not straight:
        raise ValueError(
            f"{trials} leaves no walk or run of {SHORTEST} frames or more; fill in the columns activity "
            "and segments"
        )
    return Study(straight, taught, progress, seed=seed, quick=quick)


def _folds(
    captures: Sequence[Capture], motions: Sequence[str], count: int, seed: int
) -> tuple[frozenset[str], ...]:
    """Groups of subjects such that each group has every motion, and so have the remaining groups.

    Subjects with the rarest motion are distributed first, so that the groups have equally many.
    """
    doing = {motion: sorted({c.subject for c in captures if c.label == motion}) for motion in motions}
    count = min([count, *(len(subjects) for subjects in doing.values())])
    if count < 2:
        return ()
    rng = np.random.default_rng([seed, 1])
    groups: list[set[str]] = [set() for _ in range(count)]
    for motion in sorted(doing, key=lambda motion: len(doing[motion])):
        for subject in rng.permutation(doing[motion]).tolist():
            if not any(subject in group for group in groups):
                fewest = min(groups, key=lambda group: len(group & set(doing[motion])))
                fewest.add(subject)
    return tuple(frozenset(group) for group in groups)


def _some(captures: Sequence[Capture]) -> tuple[Capture, ...]:
    """The longest capture of each subject's motions, cut short; four subjects a motion."""
    chosen = []
    for motion in MOTIONS:
        longest: dict[str, Capture] = {}
        for capture in sorted(captures, key=lambda c: -len(c.y)):
            if capture.label == motion:
                longest.setdefault(capture.subject, capture)
        chosen += [replace(c, y=c.y[:QUICK_FRAMES]) for c in list(longest.values())[:4]]
    return tuple(chosen)
