"""Gaps in the middle of clean segments, filled in every way there is.

A gap takes all freedoms. It sits in the middle of a segment at least gap + 2 SIDE frames long, and everything
that is left of the segment is shown.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from dynamics.hmm import HMM
from dynamics.motion.gaps import interpolate
from dynamics.slds import SLDS
from dynamics.viterbi import viterbi
from tests.benchmarks.motion.data import (
    ANGLES,
    MOTIONS,
    SPLICED,
    STATES,
    Array,
    Errors,
    Recipe,
    Segment,
    Source,
    by_person,
    centred,
    held_out,
    rms,
    shown,
    straight,
)
from tests.benchmarks.motion.page import Claim, Results, number, table
from tracker.experiments.gaps import spline
from tracker.experiments.gaps import straight as straight_line
from tracker.models.learn import NOISE

SIDE = 10
NEAREST = 15
TARGETS = {("walk", 10): 2.5, ("walk", 25): 4.2, ("walk", 50): 5.5, ("run", 10): 5.5, ("run", 25): 11.0}
DEFAULT = STATES, 2, NOISE
LINE, SPLINE, CLOSE = "straight line", "cubic spline", f"mean of the {NEAREST} nearest training stretches"
PATH, PAPERS, POSE = (
    "best path (papers)",
    "sampled paths, papers' switch",
    "sampled paths, switch by the pose",
)

Fill = Callable[[Array], Array]
Variant = tuple[int, int, float]


@dataclass(frozen=True)
class Filling:
    """Gaps of one length in one motion of the people left out, filled in one way.

    learned : whom the model, or the store of stretches, leaves out
    """

    learned: Recipe
    label: str
    gap: int
    way: str

    @property
    def recipe(self) -> Recipe | None:
        """None for the ways without a model."""
        return None if self.way in (LINE, SPLINE, CLOSE) else self.learned

    def run(self, source: Source, model: SLDS | HMM | None) -> list[Errors]:
        """Each segment's errors."""
        segments = source.some(straight(source, self.label, self.learned.excluded))
        return errors(self._fill(source, model), segments, self.gap)

    def _fill(self, source: Source, model: SLDS | HMM | None) -> Fill:
        if self.way == CLOSE:
            recipe = Recipe(excluded=self.learned.excluded, motions=(self.label,))
            return Nearest(shown(source, recipe), self.gap)
        if self.way in (LINE, SPLINE):
            return straight_line if self.way == LINE else spline
        assert isinstance(model, SLDS)
        return partial(best_path, model) if self.way == PATH else partial(sampled, model, self.way == POSE)


def jobs(source: Source) -> Iterator[Filling]:
    """Every way at every gap."""
    for label, gap in TARGETS:
        for way, variant, _ in _rows(source):
            for recipe in held_out(source, label, variant):
                yield Filling(recipe, label, gap, way)


def claims(results: Results) -> list[Claim]:
    """The default model and way against the targets."""
    found = []
    for (label, gap), target in TARGETS.items():
        error = rms(_errors(results, label, gap, POSE, DEFAULT, six=False))
        found.append(Claim(f"gap of {gap} frames, {label}", error, target, "°"))
    return found


def section(source: Source, results: Results) -> list[str]:
    """The tables."""
    lines = [
        "## Gaps",
        "",
        f"All freedoms missing in the middle of a clean segment that has at least {SIDE} frames more",
        "on either side; everything else of it is shown. RMSE in degrees: pooled over all frames / mean over",
        "subjects / the six.",
        "",
    ]
    for label in MOTIONS:
        gaps = [gap for motion, gap in TARGETS if motion == label]
        rows = [
            [name, *(_cell(results, label, gap, way, variant) for gap in gaps)]
            for way, variant, name in _rows(source)
        ]
        lines += table([label, *(f"{gap} frames" for gap in gaps)], rows)
        of = {gap: by_person(_errors(results, label, gap, POSE, DEFAULT, six=False)) for gap in gaps}
        people = sorted({name for found in of.values() for name in found})
        lines += table(
            [f"{label}, default, by subject", *people],
            [[f"{gap} frames", *(number(of[gap].get(name)) for name in people)] for gap in gaps],
        )
    return lines


def errors(fill: Fill, segments: Sequence[Segment], gap: int) -> list[Errors]:
    """Each segment that is long enough with its gap filled, against what was there."""
    found = []
    for s in long_enough(segments, gap):
        first = (len(s.y) - gap) // 2
        hole = slice(first, first + gap)
        y = s.y.copy()
        y[hole] = np.nan
        shown = centred(y)
        offset = np.nanmean(y - shown, axis=0)
        apart = (fill(shown)[hole] + offset - s.y[hole])[:, ANGLES]
        found.append(Errors(s.person, s.label, (apart**2).sum(0), gap))
    return found


def long_enough(segments: Sequence[Segment], gap: int) -> list[Segment]:
    """Those with SIDE frames or more on both sides of such a gap."""
    return [s for s in segments if len(s.y) >= gap + 2 * SIDE]


def best_path(slds: SLDS, y: Array) -> Array:
    """Smoothed along the papers' best switching path; with one state a motion, a Kalman smoother."""
    return np.asarray(viterbi(slds, y).states.mean[:, : y.shape[1]])


def sampled(slds: SLDS, recurrent: bool, y: Array) -> Array:
    """`dynamics.motion.gaps` with one seed for all."""
    return interpolate(slds, y, np.random.default_rng(11), recurrent=recurrent).mean


class Nearest:
    """The mean of the NEAREST stretches of the training data whose SIDE frames before and after fit best."""

    def __init__(self, segments: Sequence[Segment], gap: int) -> None:
        span = gap + 2 * SIDE
        windows = [
            np.swapaxes(sliding_window_view(centred(s.y), span, axis=0), 1, 2)
            for s in segments
            if len(s.y) >= span
        ]
        self.gap = gap
        self.stretches = np.concatenate(windows)
        self.sides = np.r_[0:SIDE, SIDE + gap : span]
        self.context = self._context(self.stretches)

    def __call__(self, y: Array) -> Array:
        first = (len(y) - self.gap) // 2
        here = y[first - SIDE : first + self.gap + SIDE]
        distance = ((self.context - self._context(here[None])) ** 2).sum(1)
        nearest = np.argpartition(distance, NEAREST)[:NEAREST]
        filled = y.copy()
        filled[first : first + self.gap] = self.stretches[nearest, SIDE : SIDE + self.gap].mean(0)
        return filled

    def _context(self, stretches: Array) -> Array:
        return np.ascontiguousarray(stretches[:, self.sides, ANGLES].reshape(len(stretches), -1))


def _rows(source: Source) -> list[tuple[str, Variant, str]]:
    """The way, the model's variant, and the name of each row."""
    rows = [
        (way, (states, 2, NOISE), f"{Recipe.named(states, 2)}: {way}")
        for states in sorted({4, STATES}, reverse=True)
        for way in ((POSE, PAPERS, PATH) if states == STATES else (POSE, PATH))
    ]
    rows.append((POSE, (STATES, 1, NOISE), f"{Recipe.named(STATES, 1)}: {POSE}"))
    rows += [(PATH, (1, order, NOISE), f"{Recipe.named(1, order)}: Kalman smoother") for order in (2, 1)]
    rows += [(way, DEFAULT, way) for way in (LINE, SPLINE, CLOSE)]
    return source.some(rows)


def _cell(results: Results, label: str, gap: int, way: str, variant: Variant) -> str:
    everyone = _errors(results, label, gap, way, variant, six=False)
    six = _errors(results, label, gap, way, variant, six=True)
    people = list(by_person(everyone).values())
    means = rms(everyone), float(np.mean(people)) if people else None, rms(six)
    return " / ".join(map(number, means))


def _errors(results: Results, label: str, gap: int, way: str, variant: Variant, *, six: bool) -> list[Errors]:
    return [
        e
        for job, found in results.items()
        if isinstance(job, Filling) and (job.label, job.gap, job.way) == (label, gap, way)
        if job.learned.variant == variant and (job.learned.excluded == SPLICED) == six
        for e in found
    ]
