"""Gaps in the middle of clean segments, filled in every way there is.

A gap takes all freedoms. It sits in the middle of a segment at least gap + 2 SIDE frames long, and everything
that is left of the segment is shown.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from dynamics.gaussian import Array
from dynamics.motion.gaps import interpolate
from dynamics.periodic.filling import around
from dynamics.periodic.filling import fill as periodic
from dynamics.slds import SLDS
from dynamics.store import Model
from dynamics.stride import Stride
from kinematics.mocap import Sequence as Capture
from tests.benchmarks.motion.data import (
    DEFAULT,
    SPLICED,
    STATES,
    STRIDE,
    Results,
    Variant,
    held_out,
    named,
    of_variant,
    straight,
)
from tests.benchmarks.page import Claim, number, table
from tracker.experiments.measures import SIDE, Errors, Fill, across, best_path, gap_errors, gappy, rms, spans
from tracker.experiments.study import FPS, Recipe
from tracker.models.centred import ANGLES
from tracker.models.learn import NOISE
from tracker.motion.fill import angles_evidence

HEADING = "Gaps"
TARGETS = {("walk", 10): 2.2, ("walk", 25): 4.0, ("walk", 50): 6.5, ("run", 10): 4.5, ("run", 25): 6.0}
SIX_TARGETS = {("walk", 10): 1.6, ("walk", 25): 2.2, ("walk", 50): 2.6}
INSIDE = (85.0, 97.0)  # per cent of angles within two sigma
SEED = 11
LINE, SPLINE = "straight line", "cubic spline"
CHOSEN, PERIODIC = "more probable of the two", "harmonic stride"
PATH, PAPERS, POSE = (
    "best path (papers)",
    "sampled paths, papers' switch",
    "sampled paths, switch by the pose",
)


@dataclass(frozen=True)
class Gap:
    """One gap filled.

    errors   : of the poses in it
    inside   : (6,) how many frames of each angle lie within two sigma; NaN where no deviation was asked for
    evidence : of the angles about it, nats, as `figtrack interpolate` weighs it; NaN where not asked for
    """

    errors: Errors
    inside: Array
    evidence: float


@dataclass(frozen=True)
class Filling:
    """Gaps of one length in one motion of the people left out, filled in one way.

    learned : whom the model leaves out
    """

    learned: Recipe
    label: str
    gap: int
    way: str

    @property
    def recipe(self) -> Recipe | None:
        """None for the ways without a model."""
        return None if self.way in (LINE, SPLINE) else self.learned

    def run(self, source: Path, model: Model | None) -> list[Gap]:
        """Each segment's gap."""
        fill = self._fill(model)
        captures = [s.capture for s in straight(source, self.label, self.learned.held)]
        return [self._gap(fill, model, c) for c in captures if spans(c.y, self.gap)]

    def _gap(self, fill: Fill, model: Model | None, capture: Capture) -> Gap:
        first = (len(capture.y) - self.gap) // 2
        rows = np.arange(first, first + self.gap)
        shown, offset = gappy(capture.y, slice(first, first + self.gap))
        if isinstance(model, Stride):
            found = periodic(model, shown, rows, FPS)
            away = found.poses.mean + offset - capture.y[rows]
            sd = np.sqrt(np.diagonal(found.poses.cov, axis1=1, axis2=2))
            inside = (np.abs(away) <= 2.0 * sd)[:, ANGLES].sum(0)
            errors = Errors(capture.subject, (away[:, ANGLES] ** 2).sum(0), self.gap)
            return Gap(errors, inside, found.log_evidence)
        evidence = np.nan
        if isinstance(model, SLDS) and self.way == POSE:
            evidence = angles_evidence(model, shown[around(shown, rows, FPS)], FPS)
        return Gap(gap_errors(fill, capture, self.gap), np.full(6, np.nan), evidence)

    def _fill(self, model: Model | None) -> Fill:
        if self.way in (LINE, SPLINE, PERIODIC):
            return partial(across, 3 if self.way == SPLINE else 1)
        assert isinstance(model, SLDS)
        if self.way == PATH:
            return partial(best_path, model)
        recurrent = self.way == POSE
        return lambda y: interpolate(model, y, np.random.default_rng(SEED), recurrent=recurrent).mean


def jobs(source: Path) -> Iterator[Filling]:
    """Every way at every gap."""
    for label, gap in TARGETS:
        for way, variant, _ in _rows():
            if way != CHOSEN:
                for recipe in (*held_out(source, label, variant), Recipe(*variant, SPLICED)):
                    yield Filling(recipe, label, gap, way)


def claims(results: Results) -> Iterator[Claim]:
    """Of what `figtrack interpolate` does."""
    for (label, gap), target in TARGETS.items():
        error = rms(_errors(results, label, gap, CHOSEN, DEFAULT))
        yield Claim(f"{label}, gap of {gap}", error, target, unit="°")
    for (label, gap), target in SIX_TARGETS.items():
        error = rms(_errors(results, label, gap, CHOSEN, DEFAULT, six=True))
        yield Claim(f"{label}, gap of {gap}, six subjects", error, target, unit="°")
    for label, gap in TARGETS:
        text = f"{label}, gap of {gap}, within two sigma"
        yield Claim(text, _inside(results, label, gap), *reversed(INSIDE), unit="%")


def section(source: Path, results: Results) -> list[str]:
    rows = [
        [name, *(number(rms(_errors(results, label, gap, way, variant))) for label, gap in TARGETS)]
        for way, variant, name in _rows()
    ]
    return [
        f"All freedoms are missing in the middle of a clean segment with at least {SIDE} more frames",
        "on either side. RMSE in degrees. `figtrack interpolate` takes the more probable of stride",
        "and default model; the sigma above is the stride's.",
        "",
        *table(["way", *(f"{label}, {gap} frames" for label, gap in TARGETS)], rows),
    ]


def _rows() -> list[tuple[str, Variant, str]]:
    """The way, the model's variant, and the name of each row."""
    rows = [(way, DEFAULT, f"{named(STATES, 2)}: {way}") for way in (POSE, PAPERS, PATH)]
    rows += [(PATH, (1, order, NOISE), f"{named(1, order)}: Kalman smoother") for order in (2, 1)]
    rows += [(way, DEFAULT, way) for way in (LINE, SPLINE)]
    first = [(CHOSEN, DEFAULT, CHOSEN), (PERIODIC, STRIDE, PERIODIC)]
    return [*first, *rows]


def _errors(
    results: Results, label: str, gap: int, way: str, variant: Variant, *, six: bool = False
) -> list[Errors]:
    """Of everybody by the model that was learned without them; of the six by the one without all six."""
    if way != CHOSEN:
        return [found.errors for found in _gaps(results, label, gap, way, variant, six)]
    strides = _gaps(results, label, gap, PERIODIC, STRIDE, six)
    switching = _gaps(results, label, gap, POSE, DEFAULT, six)
    return [
        (one if one.evidence >= other.evidence else other).errors
        for one, other in zip(strides, switching, strict=True)
    ]


def _gaps(results: Results, label: str, gap: int, way: str, variant: Variant, six: bool) -> list[Gap]:
    """The same gaps in the same order for every way."""
    return [
        g
        for job, found in sorted(
            ((job, found) for job, found in results.items() if isinstance(job, Filling)),
            key=lambda item: sorted(item[0].learned.held),
        )
        if (job.label, job.gap, job.way) == (label, gap, way)
        if of_variant(job.learned, variant, six)
        for g in found
    ]


def _inside(results: Results, label: str, gap: int) -> float:
    """Per cent of everybody's angles within two sigma of the stride."""
    found = _gaps(results, label, gap, PERIODIC, STRIDE, six=False)
    cells = 6 * gap * len(found)
    return 100.0 * sum(float(g.inside.sum()) for g in found) / cells if cells else float("nan")
