"""What the motion figures are measured on: captures, splices, and models learned without some people.

A segment is mirrored before anything else, so near and far legs count alike. The neck's mean over the frames
that a task is shown is taken off, as learning does.
"""

import csv
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from dynamics.hmm import HMM
from dynamics.learning.baum_welch import HMMOptions
from dynamics.learning.em import from_origin
from dynamics.slds import SLDS
from kinematics.figure import ROOT
from kinematics.mocap import POSE_COLUMNS, mirror, read_trials, sequences
from tracker.models.find import learn_hmms, learn_motions
from tracker.models.learn import NOISE, STATES, gait_options

Array = NDArray[np.float64]
Item = TypeVar("Item")

FPS = 30.0
MOTIONS = ("walk", "run")
ANGLES = slice(2, len(POSE_COLUMNS))
NECK = POSE_COLUMNS.index("neck")
SPLICED = ("02", "29", "35", "49", "am1", "hddg")  # the subjects of the splices
SAME = ("07", "08")  # probably one person
SHOWN_STATES = tuple(sorted({1, 4, STATES}, reverse=True))
QUICK_FRAMES = 100  # of one segment a subject and motion, or of one splice
QUICK_ROUNDS = 2


@dataclass(frozen=True)
class Source:
    """The folder of captures and splices; `quick` takes little of either and learns badly."""

    folder: Path
    quick: bool = False

    def some(self, items: Sequence[Item]) -> list[Item]:
        """All of them, or the first and the last for a quick try."""
        return [*items[:1], *items[1:][-1:]] if self.quick else list(items)


@dataclass(frozen=True)
class Segment:
    """y (T, 8) in body units, clean; `number` is its place among all, and seeds its noise."""

    number: int
    subject: str
    label: str
    y: Array

    @property
    def person(self) -> str:
        """The subject, or both names of one that has two."""
        return "/".join(SAME) if self.subject in SAME else self.subject


@dataclass(frozen=True)
class Recipe:
    """A model: switching states a motion, order, degrees of noise, who is left out, what is joined.

    Order 0 is a hidden Markov model of the angles, the papers' baseline.
    """

    states: int = STATES
    order: int = 2
    noise: float = NOISE
    excluded: tuple[str, ...] = ()
    motions: tuple[str, ...] = MOTIONS

    @property
    def cost(self) -> int:
        """How long it takes to learn beside others."""
        return self.states * max(self.order, 1) * len(self.motions)

    @property
    def variant(self) -> tuple[int, int, float]:
        """States, order and noise."""
        return self.states, self.order, self.noise

    @staticmethod
    def named(states: int, order: int, noise: float = NOISE) -> str:
        """The name of such a model; the noise is told where it is not the usual."""
        kind = f"order {order}" if order else "HMM"
        plural = "s" if states > 1 else ""
        return f"{states} state{plural}, {kind}" + (f", learned at {noise:g}°" if noise != NOISE else "")


@dataclass(frozen=True)
class Errors:
    """Squares (6,) summed over `count` frames of one segment, one for each angle; radians."""

    person: str
    label: str
    squares: Array = field(repr=False)
    count: int


@dataclass(frozen=True)
class Splices:
    """The tuning splices: poses at a noise, with the true label and frames to the nearest junction."""

    ys: list[Array]
    label: NDArray[np.str_]
    junction: NDArray[np.intp]
    subject: NDArray[np.str_]


class Job(Protocol):
    """One figure or more to be measured, with the model of a recipe or with none."""

    @property
    def recipe(self) -> Recipe | None:
        """The model that `run` is to be handed."""

    def run(self, source: Source, model: SLDS | HMM | None) -> object:
        """Measure."""


@cache
def captures(source: Source, curves: bool = False) -> tuple[Segment, ...]:
    """The segments of all walks and runs, each followed by its mirror image.

    Args:
        curves: those on a curve too, as learning takes them; the figures are measured on the straight ones.
    """
    found: list[Segment] = []
    seen: set[tuple[str, str]] = set()
    for trial in read_trials(source.folder / "mocap" / "trials.csv"):
        who = trial.subject, trial.activity
        if trial.activity not in MOTIONS or (source.quick and who in seen):
            continue
        for s in sequences(trial, FPS, curves=curves)[: 1 if source.quick else None]:
            seen.add(who)
            kept = s.y[:QUICK_FRAMES] if source.quick else s.y
            for y in (kept, mirror(kept)):
                found.append(Segment(len(found), s.subject, s.label, y))
    return tuple(found)


def straight(source: Source, label: str, subjects: Iterable[str] | None = None) -> list[Segment]:
    """The straight segments of one motion, of these subjects or of all."""
    kept = None if subjects is None else set(subjects)
    return [s for s in captures(source) if s.label == label and (kept is None or s.subject in kept)]


def folds(source: Source, label: str) -> list[tuple[str, ...]]:
    """The subjects to leave out together, one tuple a person."""
    found = sorted({s.person for s in straight(source, label)})
    return [tuple(person.split("/")) for person in (source.some(found))]


def held_out(source: Source, label: str, *variants: tuple[int, int, float]) -> Iterator[Recipe]:
    """Recipes of (states, order, noise): of one motion for every person left out; of all without the six."""
    for states, order, noise in variants:
        for excluded in folds(source, label):
            yield Recipe(states, order, noise, excluded, (label,))
        yield Recipe(states, order, noise, SPLICED)


def learn(source: Source, recipe: Recipe) -> SLDS | HMM:
    """The model of a recipe, by the defaults of everything that the recipe does not name."""
    # Every second segment is a mirror image, which learning makes by itself.
    data = [(s.subject, s.label, s.y) for s in shown(source, recipe) if s.number % 2 == 0]
    noise = float(np.radians(recipe.noise))
    if recipe.order == 0:
        return learn_hmms(data, fps=FPS, options=HMMOptions(states=recipe.states), noise=noise)
    options = gait_options(states=recipe.states, order=recipe.order)
    if source.quick:
        options = gait_options(states=recipe.states, order=recipe.order, rounds=QUICK_ROUNDS)
    return learn_motions(data, fps=FPS, options=options, noise=noise)


def shown(source: Source, recipe: Recipe) -> list[Segment]:
    """What a recipe's model learns from, mirror images too."""
    return [
        s
        for s in captures(source, curves=True)
        if s.label in recipe.motions and s.subject not in recipe.excluded
    ]


def noisy(segment: Segment, degrees: float, root: float = 0.0) -> Array:
    """(T, 8) `centred` poses with white noise on the angles, and on the root in leg lengths."""
    rng = np.random.default_rng([7, segment.number])
    y = centred(segment.y)
    spread = np.r_[root, root, np.full(len(POSE_COLUMNS) - 2, np.radians(degrees))]
    return np.asarray(y + spread * rng.normal(size=y.shape))


def centred(y: Array) -> Array:
    """The poses less the neck's mean, and counted from where the root was first measured."""
    out = from_origin(y, POSE_COLUMNS, ROOT)
    out[:, NECK] -= np.nanmean(out[:, NECK])
    return out


@cache
def splices(source: Source, noise: int) -> Splices:
    """The spliced sequences with so many degrees of noise, the root blanked."""
    folder = source.folder / "splices"
    truth, rows = _rows(folder / "truth.csv"), _rows(folder / f"splice_n{noise}.csv")
    if [(r["seq"], r["frame"]) for r in truth] != [(r["seq"], r["frame"]) for r in rows]:
        raise ValueError(f"truth.csv and splice_n{noise}.csv in {folder} must list the same frames")
    if source.quick:
        truth, rows = truth[:QUICK_FRAMES], rows[:QUICK_FRAMES]
    y = np.array([[np.nan, np.nan, *(float(r[name]) for name in POSE_COLUMNS[ANGLES])] for r in rows])
    seq = np.array([r["seq"] for r in rows])
    return Splices(
        ys=[np.radians(y[seq == name]) for name in dict.fromkeys(seq.tolist())],
        label=np.array([r["label"] for r in truth]),
        junction=np.array([int(r["junction"]) for r in truth]),
        subject=np.array([r["subject"] for r in truth]),
    )


def rms(errors: Iterable[Errors]) -> float:
    """Degrees, pooled over angles and frames; NaN of none."""
    kept = list(errors)
    squares = sum(float(e.squares.sum()) for e in kept)
    if not kept:
        return float("nan")
    return float(np.degrees(np.sqrt(squares / sum(6 * e.count for e in kept))))


def by_person(errors: Iterable[Errors]) -> dict[str, float]:
    """Degrees, of every person by themselves."""
    kept = list(errors)
    return {name: rms(e for e in kept if e.person == name) for name in sorted({e.person for e in kept})}


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))
