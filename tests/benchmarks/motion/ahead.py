"""Forecasts one frame ahead of noisy poses, against a constant-velocity Kalman filter at its best noise.

Constant velocity treats every angle by itself, so one run of a grid point serves each of them. Its noise is
chosen on the very frames that are scored, once for all angles and once for each angle: in its favour.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from dynamics.hmm import HMM
from dynamics.motion.tasks import forecasts, predict
from dynamics.slds import SLDS
from tests.benchmarks.motion.data import (
    ANGLES,
    MOTIONS,
    SHOWN_STATES,
    SPLICED,
    STATES,
    Array,
    Errors,
    Recipe,
    Segment,
    Source,
    by_person,
    centred,
    folds,
    held_out,
    noisy,
    rms,
    straight,
)
from tests.benchmarks.motion.page import Claim, Results, number, table
from tracker.experiments.ahead import rival
from tracker.models.learn import NOISE as LEARNED_NOISE

NOISE = 2.0  # degrees
ROOTS = {"clean": "as measured", "noisy": "with noise of 0.01 leg lengths", "blank": "not shown"}
ROOT_NOISE = 0.01  # leg lengths; the splices' proportion, five thousandths a degree
TARGETS = {"walk": 2.3, "run": 3.4}
SHARE = 65.0  # per cent of constant velocity's error: 35 % under it
PROCESS = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0)  # degrees: change of speed a frame
MEASURED = (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 9.0)  # degrees
VARIANTS = (
    *((states, order, LEARNED_NOISE) for states in SHOWN_STATES for order in (2, 1)),
    (STATES, 2, 2.0),
    (STATES, 2, 5.0),
)

Variant = tuple[int, int, float]


@dataclass(frozen=True)
class Forecast:
    """One model on the people it was learned without; `root` is one of ROOTS."""

    recipe: Recipe
    label: str
    root: str = "clean"

    def run(self, source: Source, model: SLDS | HMM | None) -> list[Errors]:
        """Each segment's errors."""
        assert isinstance(model, SLDS)
        return errors(model, straight(source, self.label, self.recipe.excluded), self.root)


@dataclass(frozen=True)
class Rival:
    """Constant velocity at its best on one motion of everyone, or of the six subjects."""

    label: str
    subjects: tuple[str, ...] | None = None

    @property
    def recipe(self) -> None:
        """It learns nothing."""
        return None

    def run(
        self, source: Source, model: SLDS | HMM | None
    ) -> tuple[list[Errors], tuple[float, float], list[Errors]]:
        """See `best_rival`."""
        return best_rival(_people(source, self.label, self.subjects))


def jobs(source: Source) -> Iterator[Forecast | Rival]:
    """Every variant with the root as measured, the default with the other roots too."""
    for label in MOTIONS:
        for recipe in held_out(source, label, *source.some(VARIANTS)):
            yield Forecast(recipe, label)
        for recipe in held_out(source, label, VARIANTS[0]):
            yield from (Forecast(recipe, label, root) for root in ROOTS if root != "clean")
        yield from (Rival(label), Rival(label, SPLICED))


def claims(results: Results) -> list[Claim]:
    """The default model against the targets."""
    found = []
    for label, target in TARGETS.items():
        error = rms(_left_out(results, label, VARIANTS[0]))
        best = rms(results[Rival(label)][0])
        found.append(Claim(f"one frame ahead, {label}", error, target, "°"))
        share = 100.0 * error / best
        found.append(Claim(f"the same, beside the best constant velocity, {label}", share, SHARE, " %"))
    return found


def section(source: Source, results: Results) -> list[str]:
    """The tables."""
    lines = [
        "## One frame ahead",
        "",
        f"{NOISE:g} degrees of noise on the angles, RMSE in degrees against the clean ones, every frame",
        "but the first of each segment. Constant velocity has the best noise of a grid, chosen on these very",
        "frames.",
        "",
    ]
    for label in MOTIONS:
        best, (process, measured), own = results[Rival(label)]
        six, _, six_own = results[Rival(label, SPLICED)]
        rows = [
            _row(Recipe.named(*v), _left_out(results, label, v), _six(results, label, v))
            for v in source.some(VARIANTS)
        ]
        for root in ("noisy", "blank"):
            of = label, VARIANTS[0], root
            name = f"{Recipe.named(*VARIANTS[0])}; root {ROOTS[root]}"
            rows.append(_row(name, _left_out(results, *of), _six(results, *of)))
        name = f"constant velocity ({process:g}° a frame a frame, {measured:g}° measured)"
        rows += [_row(name, best, six), _row("constant velocity, each angle at its own best", own, six_own)]
        lines += table([label, "pooled", "mean over subjects", "the six"], rows)
        people = by_person(_left_out(results, label, VARIANTS[0]))
        rivals = by_person(best)
        lines += table(
            [f"{label}, by subject", *people],
            [
                ["default model", *map(number, people.values())],
                ["constant velocity", *(number(rivals[name]) for name in people)],
            ],
        )
    return lines


def errors(slds: SLDS, segments: Sequence[Segment], root: str = "clean") -> list[Errors]:
    """Forecasts against the clean poses, of every frame but each first; `root` is one of ROOTS."""
    ys = [noisy(s, NOISE, ROOT_NOISE if root == "noisy" else 0.0) for s in segments]
    if root == "blank":
        for y in ys:
            y[:, :2] = np.nan
    return _apart(segments, [forecast.mean for forecast in predict(slds, ys)])


def rival_errors(slds: SLDS, segments: Sequence[Segment]) -> list[Errors]:
    """The same of a model that keeps to its own R; `predict` may raise it."""
    found = forecasts(slds, [noisy(s, NOISE) for s in segments])
    return _apart(segments, [forecast.mean for forecast in found])


def best_rival(segments: Sequence[Segment]) -> tuple[list[Errors], tuple[float, float], list[Errors]]:
    """Its errors at the best noise of all, that noise (process, measured), and with each angle's own best."""
    grid = list(product(PROCESS, MEASURED))
    rows = [rival_errors(rival(*noises), segments) for noises in grid]
    totals: Array = np.array([sum(e.squares for e in row) for row in rows])
    best, own = int(totals.sum(1).argmin()), totals.argmin(0)
    each = [
        replace(e, squares=np.array([rows[i][n].squares[angle] for angle, i in enumerate(own)]))
        for n, e in enumerate(rows[best])
    ]
    return rows[best], grid[best], each


def _apart(segments: Sequence[Segment], forecasts: Sequence[Array]) -> list[Errors]:
    """Of forecasts (T or more, 8), the first of which is not counted."""
    found = []
    for s, forecast in zip(segments, forecasts, strict=True):
        apart = (forecast[: len(s.y)] - centred(s.y))[1:, ANGLES]
        found.append(Errors(s.person, s.label, (apart**2).sum(0), len(apart)))
    return found


def _people(source: Source, label: str, subjects: tuple[str, ...] | None) -> list[Segment]:
    everyone = tuple(name for person in folds(source, label) for name in person)
    return straight(source, label, everyone if subjects is None else subjects)


def _left_out(results: Results, label: str, variant: Variant, root: str = "clean") -> list[Errors]:
    """Of everybody by the model that was learned without them."""
    return _errors(results, label, variant, root, six=False)


def _six(results: Results, label: str, variant: Variant, root: str = "clean") -> list[Errors]:
    """Of the six subjects by the model that was learned without all six."""
    return _errors(results, label, variant, root, six=True)


def _errors(results: Results, label: str, variant: Variant, root: str, *, six: bool) -> list[Errors]:
    return [
        e
        for job, found in results.items()
        if isinstance(job, Forecast) and (job.label, job.root) == (label, root)
        if job.recipe.variant == variant and (job.recipe.excluded == SPLICED) == six
        for e in found
    ]


def _row(name: str, everyone: list[Errors], six: list[Errors]) -> list[str]:
    return [name, *map(number, (rms(everyone), float(np.mean([*by_person(everyone).values()])), rms(six)))]
