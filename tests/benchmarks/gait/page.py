"""The page of gait figures."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from tests.benchmarks.gait.measure import TALL, Case, Figure, Moment
from tests.benchmarks.gait.truth import CLEAR, LOW
from tests.benchmarks.page import Claim, chapter, claim_table, table, written
from tracker.gait.figures import Gait

LABELS = ("walk", "run")
STANCE = {"walk": 3.0, "run": 5.0}  # points that are wanted
INSIDE = 85.0, 97.0  # per cent of two-sigma intervals
FIGURES = (
    "stride time",
    "step time",
    "stance share",
    "double support",
    "flight time",
    "hip extension peak",
    "knee flexion peak",
    "step length",
    "stride length",
    "speed",
)
RELATIVE = {"step length", "stride length", "speed"}  # errors are told in per cent
LEARNED = ("02", "05", "07", "08", "09", "10", "26", "29", "32", "35", "49", "wd2")
METHOD = """\
The films of [rendered.md](rendered.md) are followed from marks; walkers are {tall:g} m tall. An end of the
sole rests while it is lower than {low:g} leg lengths and slower than half the mean pace; a foot strikes when
one first rests and leaves when none does. Where nearby limits move a moment by over {clear:g} ms, as of feet
that slip, it is unclear.
"""
LEARNING = """\
Late is positive; inside: the share within two standard errors (95 % is right). The weights were learned from
the captures named learned.
"""
COUNTED = "Counted per leg where both legs have the figure, else per film."
CLIPS = """\
Hand-marked walks, whose true contacts are unknown: a comfortable stance is 58 to 65 % of a stride, a slow
one more. myogait gives 58.9 (near) and 61.9 (far) for `gym_walk_rl`.
"""


def page(cases: Sequence[Case], clips: Mapping[str, Gait], tried: str) -> str:
    """The whole text.

    Args:
        clips: gait of the open clips of walks by name.
        tried: a line that says why the figures are not those of the report; empty where they are.
    """
    seeds = [each.seed for each in cases]
    by = f"{written('gait')}, seeds {min(seeds)} to {max(seeds)}.\n{tried}"
    method = METHOD.format(tall=TALL, low=LOW, clear=1e3 * CLEAR)
    wanted = claim_table([*claims(cases), *clip_claims(clips)])
    return "\n".join(
        [
            *chapter("# Gait figures", by, method),
            *chapter("## What is wanted", wanted),
            *chapter("## Moments", LEARNING, table(MOMENTS, moment_rows(cases)), nobodys(cases)),
            *chapter("## Figures", COUNTED, table(ERRORS, figure_rows(cases))),
            *chapter("## Open clips", CLIPS, table(OPEN, clip_rows(clips))),
        ]
    )


MOMENTS = ("moments", "number", "median, ms", "half within, ms", "nine in ten within, ms", "inside, %")
ERRORS = ("figure", "number", "median error", "half within", "nine in ten within", "inside, %")
OPEN = ("clip", "strides", "stance near, %", "far, %", "double support, %", "step length, m", "speed, m/s")


def claims(cases: Sequence[Case]) -> Iterator[Claim]:
    """What is wanted of the films."""
    for label in LABELS:
        own = [each for each in cases if each.kinds["gait"] == label]
        for kind, words in (("strike", "strikes"), ("off", "leavings")):
            late = _late(own, kind)
            yield Claim(f"{words} of {label}s, half within", _within(late, 0.5), 20.0, unit="ms")
            yield Claim(f"{words} of {label}s, nine in ten within", _within(late, 0.9), 45.0, unit="ms")
        points = [figure.told - figure.true for figure in _figures(own, "stance share")]
        yield Claim(f"stance of {label}s, half within", _within(points, 0.5), STANCE[label], unit="points")
    moments = [moment for each in cases for moment in each.moments]
    yield Claim("moments inside", _inside_moments(moments), INSIDE[1], INSIDE[0], unit="%")
    for name in ("stance share", "step time"):
        yield Claim(f"{name} inside", _inside(_figures(cases, name)), INSIDE[1], INSIDE[0], unit="%")
    for name in ("step length", "speed"):
        yield Claim(f"{name}, half within", _within(_shares(_figures(cases, name)), 0.5), 3.0, unit="%")
    named = [each for each in cases if each.moments]
    right = sum(each.runs == (each.kinds["gait"] == "run") for each in named)
    yield Claim("walk or run rightly named", 100.0 * right / max(len(named), 1), 100.0, 97.0, unit="%")
    for i, leg in enumerate(("near", "far")):
        strides = float(sum(each.strides[i] for each in cases))
        yield Claim(f"strides of the {leg} leg", strides, np.inf, 100.0)


def clip_claims(clips: Mapping[str, Gait]) -> Iterator[Claim]:
    """What is wanted of the open clips."""
    stances = [value for gait in clips.values() for value in _stances(gait) if value is not None]
    yield Claim("open walks: least stance of a leg", min(stances), 68.0, 54.0, unit="%")
    yield Claim("open walks: greatest", max(stances), 68.0, 54.0, unit="%")
    for leg, stance, known in zip(("near", "far"), _stances(clips["gym_walk_rl"]), (58.9, 61.9), strict=True):
        yield Claim(f"`gym_walk_rl`: stance, {leg}", stance or np.nan, known + 5.0, known - 5.0, unit="%")
    for name in ("markers_walk_lr", "desert_walk_rl"):
        yield Claim(f"`{name}`: speed", _both(clips[name], "speed"), 1.7, 1.0, unit="m/s")


def nobodys(cases: Sequence[Case]) -> str:
    """How many strides are compared with none."""
    missed, unclear = sum(each.missed for each in cases), sum(each.unclear for each in cases)
    told = sum(sum(each.strides) for each in cases) + missed + unclear
    return (
        f"Of {told} strides found, {missed} over half a stride from any true one and {unclear} with unclear "
        "moments are left out."
    )


def moment_rows(cases: Sequence[Case]) -> Iterable[list[str]]:
    """Rows under MOMENTS."""
    for label in LABELS:
        own = [each for each in cases if each.kinds["gait"] == label]
        seen = [each for each in own if each.capture.split("_")[0] in LEARNED]
        others = [each for each in own if each not in seen]
        for kind, words in (("strike", "strikes"), ("off", "leavings")):
            for of, group in (("learned", seen), ("others", others)):
                late = _late(group, kind)
                moments = [m for each in group for m in each.moments if m.kind == kind]
                yield [f"{label}s, {words}, {of}", *_spread(late, 0), f"{_inside_moments(moments):.0f}"]


def figure_rows(cases: Sequence[Case]) -> Iterable[list[str]]:
    """Rows under ERRORS; of lengths and speed, errors in per cent."""
    for label in LABELS:
        own = [each for each in cases if each.kinds["gait"] == label]
        for name in FIGURES:
            figures = _figures(own, name)
            if figures:
                relative = name in RELATIVE
                errors = _shares(figures) if relative else [figure.told - figure.true for figure in figures]
                unit, scale = ("%", 1.0) if relative else ("ms", 1e3) if "time" in name else ("points", 1.0)
                errors = [scale * error for error in errors]
                yield [f"{label}s, {name}, {unit}", *_spread(errors, 1), f"{_inside(figures):.0f}"]


def clip_rows(clips: Mapping[str, Gait]) -> Iterable[list[str]]:
    """Rows under OPEN."""
    for name, gait in clips.items():
        stances = [f"{value:.1f}" if value is not None else "-" for value in _stances(gait)]
        yield [
            f"`{name}`",
            ", ".join(str(len(strides.sound)) for strides in gait.strides.values()),
            *stances,
            *(
                f"{_both(gait, what):.{digits}f}" if gait.named(what) else "-"
                for what, digits in (("double support", 1), ("step length", 2), ("speed", 2))
            ),
        ]


def _stances(gait: Gait) -> list[float | None]:
    stance = gait.named("stance share")
    legs = (None, None) if stance is None else (stance.near, stance.far)
    return [None if value is None else value.mean for value in legs]


def _both(gait: Gait, name: str) -> float:
    measure = gait.named(name)
    return np.nan if measure is None or measure.both is None else measure.both.mean


def _late(cases: Iterable[Case], kind: str) -> list[float]:
    """Milliseconds."""
    return [1e3 * moment.late for each in cases for moment in each.moments if moment.kind == kind]


def _figures(cases: Iterable[Case], name: str) -> list[Figure]:
    return [figure for each in cases for figure in each.figures if figure.name == name]


def _shares(figures: Iterable[Figure]) -> list[float]:
    """Errors in per cent of what is true."""
    return [100.0 * (figure.told / figure.true - 1.0) for figure in figures]


def _inside(figures: Sequence[Figure]) -> float:
    return _share([abs(figure.told - figure.true) < 2.0 * figure.error for figure in figures])


def _inside_moments(moments: Sequence[Moment]) -> float:
    return _share([abs(moment.late) < 2.0 * moment.error for moment in moments])


def _share(inside: Sequence[bool]) -> float:
    return 100.0 * float(np.mean(inside)) if inside else np.nan


def _spread(errors: Sequence[float], digits: int) -> list[str]:
    """How many there are, their median, and within what half and nine in ten of them lie."""
    shares = [_within(errors, 0.5), _within(errors, 0.9)]
    return [str(len(errors)), f"{_of(errors, 0.5):+.{digits}f}", *(f"{share:.{digits}f}" for share in shares)]


def _within(errors: Sequence[float], share: float) -> float:
    return _of([abs(error) for error in errors], share)


def _of(values: Sequence[float], share: float) -> float:
    return float(np.quantile(values, share)) if values else np.nan
