"""Forecasts one frame ahead of noisy poses, against a constant-velocity Kalman filter at its best noise.

Constant velocity treats every angle by itself, so one run of a grid point serves each of them. Its noise is
chosen on the very frames that are scored, once for all angles and once for each angle: in its favour.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dynamics.motion.tasks import predict
from dynamics.slds import SLDS
from dynamics.store import Model
from tests.benchmarks.motion.data import (
    DEFAULT,
    MOTIONS,
    SHOWN_STATES,
    Results,
    Segment,
    Variant,
    held_out,
    named,
    of_variant,
    people,
    straight,
    summary,
)
from tests.benchmarks.page import Claim, number, table
from tracker.experiments.measures import Errors, forecast_errors, rival_errors, rms
from tracker.experiments.study import Recipe
from tracker.models.learn import NOISE as LEARNED_NOISE

HEADING = "One frame ahead"
NOISE = 2.0  # degrees
TARGETS = {"walk": 2.45, "run": 3.7}
SHARE = 65.0  # per cent of constant velocity's error: 35 % under it
PERSON_SHARE = 100.0  # the same of any one person, whose own best constant velocity is the rival
VARIANTS: tuple[Variant, ...] = (
    *((states, order, LEARNED_NOISE) for states in SHOWN_STATES for order in (2, 1)),
)


@dataclass(frozen=True)
class Forecast:
    """One model on the people it was learned without."""

    recipe: Recipe
    label: str

    def run(self, source: Path, model: Model | None) -> list[Errors]:
        """Each segment's errors."""
        assert isinstance(model, SLDS)
        return errors(model, straight(source, self.label, self.recipe.held))


class Best(NamedTuple):
    """Constant velocity at the best noises of all, with each angle's own best, and each person's error in
    degrees with the person's own best."""

    all: list[Errors]
    each_angle: list[Errors]
    each_person: dict[str, float]


@dataclass(frozen=True)
class Rival:
    """Constant velocity at its best on one motion of everyone."""

    label: str

    recipe = None  # it learns nothing

    def run(self, source: Path, model: Model | None) -> Best:
        return best_rival(straight(source, self.label))


def jobs(source: Path) -> Iterator[Forecast | Rival]:
    """Every variant, and constant velocity."""
    for label in MOTIONS:
        for recipe in held_out(source, label, *VARIANTS):
            yield Forecast(recipe, label)
        yield Rival(label)


def claims(results: Results) -> Iterator[Claim]:
    for label, target in TARGETS.items():
        mine, best = _errors(results, label, DEFAULT), results[Rival(label)]
        share = 100.0 * rms(mine) / rms(best.all)
        worst = max(100.0 * error / best.each_person[name] for name, error in people(mine).items())
        yield Claim(f"one frame ahead, {label}", rms(mine), target, unit="°")
        yield Claim(f"error over constant velocity's, {label}", share, SHARE, unit="%")
        yield Claim(
            "the largest of a person, constant velocity tuned to the person", worst, PERSON_SHARE, unit="%"
        )


def section(source: Path, results: Results) -> list[str]:
    rows = {named(*variant): [] for variant in VARIANTS}
    one, own = [], []
    for label in MOTIONS:
        for variant in VARIANTS:
            rows[named(*variant)] += _cells(_errors(results, label, variant))
        best = results[Rival(label)]
        one += _cells(best.all)
        own += _cells(best.each_angle)
    rows |= {"constant velocity": one, "constant velocity, each angle tuned": own}
    return [
        f"{NOISE:g} degrees of noise on the angles; RMSE in degrees against the clean ones, without the",
        "first frames, pooled and as the mean over subjects. Constant velocity has the best noise of",
        "a grid on these very frames.",
        "",
        *table(
            ["model", *(f"{label}{what}" for label in MOTIONS for what in ("", ", subjects"))],
            [[name, *cells] for name, cells in rows.items()],
        ),
    ]


def _cells(found: list[Errors]) -> list[str]:
    """Pooled, and the mean over subjects."""
    return [number(value) for value in summary(found)]


def errors(slds: SLDS, segments: Sequence[Segment]) -> list[Errors]:
    """Forecasts against the clean poses, of every frame but each first."""
    foreseen = predict(slds, [s.noisy(NOISE) for s in segments])
    return forecast_errors([s.capture for s in segments], [f.mean for f in foreseen])


def best_rival(segments: Sequence[Segment]) -> Best:
    """See `Best`."""
    tried = rival_errors([s.capture for s in segments], [s.noisy(NOISE) for s in segments])
    best, rows = min(tried, key=lambda pair: rms(tried[pair])), list(tried.values())
    own = np.array([sum(e.squares for e in row) for row in rows]).argmin(0)
    each = [
        replace(e, squares=np.array([rows[i][n].squares[angle] for angle, i in enumerate(own)]))
        for n, e in enumerate(tried[best])
    ]
    by_person = [people(row) for row in rows]
    least = {name: min(found[name] for found in by_person) for name in by_person[0]}
    return Best(tried[best], each, least)


def _errors(results: Results, label: str, variant: Variant) -> list[Errors]:
    """Of everybody by the model that was learned without them."""
    return [
        e
        for job, found in results.items()
        if isinstance(job, Forecast) and job.label == label
        if of_variant(job.recipe, variant, False)
        for e in found
    ]
