"""What the papers' experiments share: the captures, whom to hold out, the models learned on the others.

Everything is drawn from one seed. Angles are clean unless a recipe or an experiment adds noise. People are
told apart by the table's `subject`.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from dynamics.gaussian import Array
from dynamics.hmm import HMM
from dynamics.learning.baum_welch import HMMOptions
from dynamics.slds import SLDS
from kinematics.mocap import POSE_COLUMNS
from kinematics.mocap import Sequence as Capture
from tracker.models.find import learn_hmms, learn_motions
from tracker.models.learn import NOISE, STATES, gait_options

FPS = 30.0
MOTIONS = ("walk", "run")
NECK = POSE_COLUMNS.index("neck")
ROOT = slice(0, 2)
ANGLES = slice(2, None)
FOLDS = 3
SHARE = {"walk": 3, "run": 1}  # of the frames of usual captures; for progress only
QUICK_FRAMES = 120  # as much of a capture does for a quick look

Item = TypeVar("Item")


@dataclass(frozen=True)
class Recipe:
    """How one model is learned.

    states  : per motion
    order   : 1 or 2; 0 for a hidden Markov model of the angles
    noise   : added to the angles, degrees
    held    : subjects left out
    motions : learned and joined
    """

    states: int = STATES
    order: int = 2
    noise: float = NOISE
    held: frozenset[str] = frozenset()
    motions: tuple[str, ...] = MOTIONS

    @property
    def cost(self) -> int:
        """How long it takes beside others."""
        return max(1, self.states * self.order * sum(SHARE[motion] for motion in self.motions) // 2)


class Study:
    """The captures of an experiment and the models learned from them, each once.

    captures : straight segments, on which everything is measured
    bends    : further ones, only to learn from
    folds    : groups of subjects to leave out in turn; none where there are too few subjects
    """

    def __init__(
        self,
        captures: Sequence[Capture],
        bends: Sequence[Capture] = (),
        *,
        seed: int = 0,
        quick: bool = False,
    ) -> None:
        self.seed, self.quick = seed, quick
        self.captures = _some(captures) if quick else tuple(captures)
        self.bends = () if quick else tuple(bends)
        self.motions = tuple(m for m in MOTIONS if any(c.label == m for c in self.captures))
        self.subjects = tuple(sorted({c.subject for c in self.captures}))
        self.folds = _folds(self.captures, self.motions, 2 if quick else FOLDS, seed)
        self.advance: Callable[[], None] = lambda: None
        self._models: dict[Recipe, SLDS | HMM] = {}

    @property
    def held_out(self) -> tuple[frozenset[str], ...]:
        """The folds, or one that leaves out nobody."""
        return self.folds or (frozenset(),)

    def rng(self, *key: int) -> np.random.Generator:
        """A generator of this study's own for each key."""
        return np.random.default_rng([self.seed, *key])

    def of(self, motion: str, subjects: Iterable[str] | None = None) -> list[Capture]:
        """The captures of one motion, of these subjects or all."""
        wanted = self.subjects if subjects is None else set(subjects)
        return [c for c in self.captures if c.label == motion and c.subject in wanted]

    def tested(self, held: frozenset[str]) -> list[Capture]:
        """Whom a model that was learned without these is tried on: these, or all if it left out none."""
        return [c for c in self.captures if not held or c.subject in held]

    def learn(self, recipe: Recipe) -> None:
        """Learn a model unless it is there."""
        if recipe not in self._models:
            self._models[recipe] = self._learned(recipe)
            self.spend(recipe.cost)

    def slds(self, recipe: Recipe) -> SLDS:
        """The learned model of a recipe of order 1 or 2."""
        model = self._models[recipe]
        assert isinstance(model, SLDS)
        return model

    def hmm(self, recipe: Recipe) -> HMM:
        """The learned model of a recipe of order 0."""
        model = self._models[recipe]
        assert isinstance(model, HMM)
        return model

    def spend(self, cost: int) -> None:
        """Move progress on."""
        for _ in range(cost):
            self.advance()

    def each(self, items: Iterable[Item], cost: int) -> Iterator[Item]:
        """The items, progress moving on after each."""
        for item in items:
            yield item
            self.spend(cost)

    def _learned(self, recipe: Recipe) -> SLDS | HMM:
        data = [
            (c.subject, c.label, c.y)
            for c in (*self.captures, *self.bends)
            if c.label in recipe.motions and c.subject not in recipe.held
        ]
        noise = float(np.radians(recipe.noise))
        if recipe.order == 0:
            hidden = HMMOptions(states=recipe.states, seed=self.seed)
            return learn_hmms(data, fps=FPS, options=hidden, noise=noise)
        options = gait_options(states=recipe.states, order=recipe.order, seed=self.seed)
        options = replace(options, rounds=2) if self.quick else options
        return learn_motions(data, fps=FPS, options=options, noise=noise)


def centred(y: Array) -> Array:
    """Poses with the neck's mean and the root's first place taken off."""
    local = y - np.r_[y[0, ROOT], np.zeros(y.shape[1] - 2)]
    local[:, NECK] -= local[:, NECK].mean()
    return np.asarray(local)


def six_angles(y: Array) -> Array:
    """Poses whose root was not measured and whose neck's mean is taken off."""
    blank = centred(y)
    blank[:, ROOT] = np.nan
    return blank


def noisy(y: Array, degrees: float, rng: np.random.Generator) -> Array:
    """White noise on every angle."""
    return np.asarray(y + np.radians(degrees) * rng.normal(size=y.shape))


def rmse(errors: Sequence[Array]) -> float:
    """Root of the mean square over all entries, radians in, degrees out."""
    every = np.concatenate([e.ravel() for e in errors])
    return float(np.degrees(np.sqrt((every**2).mean())))


def _folds(
    captures: Sequence[Capture], motions: Sequence[str], count: int, seed: int
) -> tuple[frozenset[str], ...]:
    """Groups of subjects such that every motion is in every group and is left when the group is out.

    Those who do the rarest motion are dealt out first, so that each group has as many.
    """
    doing = {motion: sorted({c.subject for c in captures if c.label == motion}) for motion in motions}
    count = min([count, *(len(subjects) for subjects in doing.values())])
    if count < 2:
        return ()
    rng = np.random.default_rng([seed, 1])
    groups: list[set[str]] = [set() for _ in range(count)]
    dealt: set[str] = set()
    for motion in sorted(doing, key=lambda motion: len(doing[motion])):
        for subject in rng.permutation(doing[motion]).tolist():
            if subject not in dealt:
                fewest = min(groups, key=lambda group: len(group & set(doing[motion])))
                fewest.add(subject)
                dealt.add(subject)
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
