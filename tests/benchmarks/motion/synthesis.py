"""Motions that a model makes by itself, against the captures it was learned from.

Subjects count alike in the captures' spectrum and stride, as they do in learning. The switching models repeat
one gait; the harmonic stride draws a person each time, and persons are to differ as the captures' do.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import welch

from dynamics.gaussian import Array
from dynamics.motion.tasks import synthesise
from dynamics.periodic.synthesis import synthesise_stride
from dynamics.slds import SLDS
from dynamics.store import Model
from dynamics.stride import Stride
from kinematics.mocap import POSE_COLUMNS
from kinematics.mocap import Sequence as Capture
from tests.benchmarks.motion.data import MOTIONS, SHOWN_STATES, Job, Results, both, named, study
from tests.benchmarks.motion.data import STRIDE as HARMONIC
from tests.benchmarks.page import Claim, number, table
from tracker.experiments.measures import WIDER, out_of_range
from tracker.experiments.study import FPS, Recipe
from tracker.models.centred import ANGLES, centred

HEADING = "Synthesis"
FRAMES = 500
SEEDS = 10
PERSONS = 50  # drawn from the harmonic stride
WINDOW = 64  # frames of a Hann window, overlapping by half, the mean taken off
HIGHEST = 6.0  # Hz
WEAKEST = 0.01  # of an angle's highest peak
BOUND = 1.0  # the same, for motions that need only be bounded
SHORTEST, LONGEST = 12, 60  # frames of a stride
OUT, STRIDE, SPECTRUM, RUN_STRIDE = 4.0, 10.0, 1.6, 20.0  # targets; per cent, but the spectrum's decibels
LEAST_SPREAD, MOST_SPREAD = 70.0, 130.0  # per cent of the captures'
HEADER = ("model, switch", "out, %", "far out, %", "stride (least to most)", "spectrum, dB")

HIPS = POSE_COLUMNS.index("hip_near"), POSE_COLUMNS.index("hip_far")


@dataclass(frozen=True)
class Likeness:
    """How like the captures: out and far_out are shares of frames with an angle out of its range, widened by
    WIDER and BOUND; stride is in frames, one a seed; decibels is the spectrum's distance, None for segments
    too short for one."""

    finite: bool
    out: float
    far_out: float
    strides: tuple[float, ...]
    stride: float
    decibels: float | None

    @property
    def stride_error(self) -> float:
        """Of the seeds' median, as a share; infinite where there is none."""
        if not self.finite:
            return float("inf")
        return abs(float(np.median(self.strides)) / self.stride - 1.0)


@dataclass(frozen=True)
class Making:
    """Motions of one model, learned on everyone; `recurrent` as in `synthesise`."""

    recipe: Recipe
    recurrent: bool

    def run(self, source: Path, model: Model | None) -> Likeness:
        assert isinstance(model, SLDS)
        known = both(study(source).lessons(self.recipe))
        return compare(model, known, self.recurrent)


@dataclass(frozen=True)
class Persons:
    """Stride times of people drawn from the harmonic stride, learned on everyone."""

    recipe: Recipe

    def run(self, source: Path, model: Model | None) -> tuple[Array, Array]:
        """Frames of the persons drawn, and of those captured."""
        assert isinstance(model, Stride)
        drawn = (
            synthesise_stride(model, 0, FRAMES, FPS, np.random.default_rng(seed)) for seed in range(PERSONS)
        )
        captured = _by_subject(both(study(source).lessons(self.recipe)))
        return np.array([stride([y]) for y in drawn]), np.array([stride(ys) for ys in captured])


def persons(label: str) -> Persons:
    """Of one motion."""
    return Persons(Recipe(*HARMONIC, motions=(label,)))


def jobs(source: Path) -> Iterator[Job]:
    """Every model with both switches, and the harmonic stride's persons."""
    for label in MOTIONS:
        yield persons(label)
        for states in SHOWN_STATES:
            for recurrent in (True, False):
                yield Making(Recipe(states, 2, motions=(label,)), recurrent)


def claims(results: Results) -> list[Claim]:
    """The default model, switch by the pose, against the targets."""
    walk, run = (results[Making(Recipe(motions=(label,)), True)] for label in MOTIONS)
    decibels = float("nan") if walk.decibels is None else walk.decibels
    return [
        Claim("synthesised walk: frames out of range", 100.0 * walk.out, OUT, unit="%"),
        Claim("synthesised walk: stride off the data's", 100.0 * walk.stride_error, STRIDE, unit="%"),
        Claim("synthesised walk: spectrum off the data's", decibels, SPECTRUM, unit="dB"),
        Claim("synthesised run: frames not finite, or far out", 100.0 * run.far_out, 0.0, unit="%"),
        Claim("synthesised run: stride off the data's", 100.0 * run.stride_error, RUN_STRIDE, unit="%"),
        *(
            Claim(
                f"spread of stride times, {label}, of the captures'",
                100.0 * float(np.divide(*(times.std(ddof=1) for times in results[persons(label)]))),
                MOST_SPREAD,
                LEAST_SPREAD,
                unit="%",
            )
            for label in MOTIONS
        ),
    ]


def section(source: Path, results: Results) -> list[str]:
    rows, strides = [], []
    for label in MOTIONS:
        for states in SHOWN_STATES:
            for recurrent in (True, False):
                like = results[Making(Recipe(states, 2, motions=(label,)), recurrent)]
                switch = "by the pose" if recurrent else "papers'"
                rows.append([f"{label}, {named(states, 2)}, {switch}", *_cells(like)])
        strides.append(f"{like.stride:.1f} ({label})")
    return [
        f"{FRAMES} frames from each of {SEEDS} seeds, learned on everyone, with the switch by the pose and",
        f"the papers'. Out: frames with an angle out of the data's range, widened by {100 * WIDER:g} %; far",
        "out: by a whole range. Stride: frames, from the autocorrelation of near hip less far hip, median",
        f"of the seeds; the data's are {' and '.join(strides)}. Spectrum: distance in decibels (rms) up to",
        f"{HIGHEST:g} Hz, where the data have at least {100 * WEAKEST:g} % of the angle's peak. The",
        f"spread of stride times is that of {PERSONS} people drawn from the harmonic stride.",
        "",
        *table(HEADER, rows),
    ]


def compare(slds: SLDS, captures: Sequence[Capture], recurrent: bool) -> Likeness:
    """Motions of FRAMES frames from several seeds."""
    made = [
        synthesise(slds, FRAMES, np.random.default_rng(seed), recurrent=recurrent)[1] for seed in range(SEEDS)
    ]
    y, known = np.concatenate(made), [c.y for c in captures]
    finite = bool(np.isfinite(y[:, ANGLES]).all())
    out, far_out = (float(out_of_range(y, known, wider).mean()) for wider in (WIDER, BOUND))
    strides = tuple(stride([m]) for m in made) if finite else ()
    long = [c for c in captures if len(c.y) >= WINDOW]
    decibels = (
        _distance(spectrum([[m] for m in made]), spectrum(_by_subject(long))) if long and finite else None
    )
    usual = float(np.mean([stride(ys) for ys in _by_subject(captures)]))
    return Likeness(finite, out, far_out, strides, usual, decibels)


def stride(ys: Sequence[Array]) -> float:
    """Frames: the highest peak of the autocorrelation of the hips' difference, pooled over sequences."""
    lags = np.arange(SHORTEST, LONGEST + 1)
    height = np.full(len(lags), -np.inf)
    swings = [y[:, HIPS[0]] - y[:, HIPS[1]] for y in ys]
    swings = [swing - swing.mean() for swing in swings]
    for n, lag in enumerate(lags):
        pairs = [(swing[:-lag], swing[lag:]) for swing in swings if len(swing) >= lag + SHORTEST // 2]
        if pairs:
            scale = sum(float((a**2).sum() + (b**2).sum()) for a, b in pairs) / 2.0
            height[n] = sum(float(a @ b) for a, b in pairs) / scale
    n = int(height.argmax())
    if not 0 < n < len(lags) - 1 or not np.isfinite(height[n - 1 : n + 2]).all():
        return float(lags[n])
    before, here, after = height[n - 1 : n + 2]
    return float(lags[n] + 0.5 * (before - after) / (before - 2.0 * here + after))


def spectrum(groups: Sequence[Sequence[Array]]) -> Array:
    """(bins, 6) power of each angle up to HIGHEST, the constant left out; groups count alike."""
    return np.mean([np.mean([_welch(y) for y in ys], axis=0) for ys in groups], axis=0)


def _cells(like: Likeness) -> list[str]:
    strides = "not finite"
    if like.finite:
        least, most = min(like.strides), max(like.strides)
        strides = f"{float(np.median(like.strides)):.1f} ({least:.1f} to {most:.1f})"
    return [*map(number, (100.0 * like.out, 100.0 * like.far_out)), strides, number(like.decibels)]


def _welch(y: Array) -> Array:
    hertz, power = welch(y[:, ANGLES], fs=FPS, window="hann", nperseg=WINDOW, detrend="constant", axis=0)
    return np.asarray(power[(hertz > 0) & (hertz <= HIGHEST)])


def _distance(made: Array, wanted: Array) -> float:
    """Decibels, rms over angles and the bins that hold more than WEAKEST of the angle's peak."""
    strong = wanted >= WEAKEST * wanted.max(0)
    return float(np.sqrt(np.mean((10.0 * np.log10(made[strong] / wanted[strong])) ** 2)))


def _by_subject(captures: Sequence[Capture]) -> list[list[Array]]:
    subjects = dict.fromkeys(c.subject for c in captures)
    return [[centred(c.y) for c in captures if c.subject == subject] for subject in subjects]
