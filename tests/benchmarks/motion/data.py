"""The protocol of docs/motion.md: segments and their mirror images, everyone left out in turn, the splices.

What is measured, and with what, is `tracker.experiments`. A segment is mirrored before anything else, so near
and far legs count alike. A source is the folder of captures and splices.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array
from dynamics.store import Model
from kinematics.mocap import POSE_COLUMNS, mirror
from kinematics.mocap import Sequence as Capture
from tests.tracker.clips import read_csv
from tracker.experiments.measures import Errors, by_person, noisy, rms
from tracker.experiments.study import Recipe, Study, read_study
from tracker.models.centred import ANGLES, centred
from tracker.models.learn import NOISE, STATES
from tracker.progress import Progress

Item = TypeVar("Item")
Variant = tuple[int, int, float]  # states a motion, order, degrees of noise

MOTIONS = ("walk", "run")
SPLICED = frozenset(("02", "29", "35", "49", "am1", "hddg"))  # the subjects of the splices
SAME = ("07", "08")  # probably one person
SHOWN_STATES = (STATES, 1)
DEFAULT: Variant = (STATES, 2, NOISE)
STRIDE: Variant = (0, 2, NOISE)  # as Recipe tells a stride
TABLE = Path("mocap") / "trials.csv"


@dataclass(frozen=True)
class Segment:
    """One of all segments; its `number` among them seeds its noise."""

    number: int
    capture: Capture

    def noisy(self, degrees: float) -> Array:
        """(T, 8) `centred` poses with white noise on the angles."""
        return noisy(centred(self.capture.y), degrees, np.random.default_rng([7, self.number]))


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

    def run(self, source: Path, model: Model | None) -> object:
        """Measure."""


Results = Mapping[Job, Any]


@cache
def study(source: Path) -> Study:
    """All walks and runs."""
    return read_study(source / TABLE, Progress("quiet"))


def learn(source: Path, recipe: Recipe) -> Model:
    """The model of a recipe."""
    return study(source).learn(recipe)


def straight(source: Path, label: str, subjects: frozenset[str] | None = None) -> list[Segment]:
    """The straight segments of one motion, of these subjects or of all, each followed by its mirror image."""
    return [
        segment
        for segment in _segments(source)
        if segment.capture.label == label and (subjects is None or segment.capture.subject in subjects)
    ]


def both(captures: Sequence[Capture]) -> list[Capture]:
    """Each capture followed by its mirror image."""
    return [c for capture in captures for c in (capture, replace(capture, y=mirror(capture.y)))]


def folds(source: Path, label: str) -> list[frozenset[str]]:
    """The subjects to leave out together: one, or both names of one that has two."""
    found = {s.capture.subject for s in straight(source, label)}
    people = sorted({SAME if name in SAME else (name,) for name in found})
    return [frozenset(person) for person in people]


def held_out(source: Path, label: str, *variants: Variant) -> Iterator[Recipe]:
    """Recipes of one motion for every person left out."""
    for variant in variants:
        for held in folds(source, label):
            yield Recipe(*variant, held, (label,))


def named(states: int, order: int, noise: float = NOISE) -> str:
    """The name of such a model; the noise is told where it is not the usual."""
    if not states:
        return "harmonic stride"
    kind = f"order {order}" if order else "HMM"
    return f"K={states}, {kind}" + (f", learned at {noise:g}°" if noise != NOISE else "")


def of_variant(recipe: Recipe, variant: Variant, six: bool) -> bool:
    """Whether a recipe is of this variant, the one that leaves out the six or one of the others."""
    return (recipe.states, recipe.order, recipe.noise) == variant and (recipe.held == SPLICED) == six


def people(errors: list[Errors]) -> dict[str, float]:
    """Degrees of every person, by both names of one that has two."""
    return by_person(replace(e, person="/".join(SAME)) if e.person in SAME else e for e in errors)


def summary(everyone: list[Errors]) -> tuple[float, float]:
    """Degrees: pooled, and the mean over people; NaN of none."""
    each = list(people(everyone).values())
    return rms(everyone), float(np.mean(each)) if each else float("nan")


@cache
def splices(source: Path, noise: int) -> Splices:
    """The spliced sequences with so many degrees of noise, the root blanked."""
    folder = source / "splices"
    truth, rows = read_csv(folder / "truth.csv"), read_csv(folder / f"splice_n{noise}.csv")
    if [(r["seq"], r["frame"]) for r in truth] != [(r["seq"], r["frame"]) for r in rows]:
        raise ValueError(f"truth.csv and splice_n{noise}.csv in {folder} must list the same frames")
    y = np.array([[np.nan, np.nan, *(float(r[name]) for name in POSE_COLUMNS[ANGLES])] for r in rows])
    seq = np.array([r["seq"] for r in rows])
    return Splices(
        ys=[np.radians(y[seq == name]) for name in dict.fromkeys(seq.tolist())],
        label=np.array([r["label"] for r in truth]),
        junction=np.array([int(r["junction"]) for r in truth]),
        subject=np.array([r["subject"] for r in truth]),
    )


@cache
def _segments(source: Path) -> tuple[Segment, ...]:
    return tuple(Segment(n, capture) for n, capture in enumerate(both(study(source).captures)))
