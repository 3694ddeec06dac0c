"""The page of results on the open clips, Markdown."""

from collections.abc import Sequence
from math import inf

import numpy as np

from tests.benchmarks.evaluation.calibration import inside, nees
from tests.benchmarks.evaluation.cases import Outcome
from tests.benchmarks.evaluation.held_out import mean_error
from tests.benchmarks.evaluation.measure import Results
from tests.benchmarks.evaluation.ways import (
    ALONE,
    BOXES,
    CV,
    CV_ALONE,
    DEFAULT,
    FILTERED,
    FLOW,
    GRIDS,
    MANY_STATES,
    ONE_STATE,
    RIVALS,
)
from tests.benchmarks.page import Claim, chapter, claim_table, number, table, written
from tests.benchmarks.rivals import correlation
from tracker.run.score import Score

HEADER = ("way", "mean", "worst", "median", "leg angles", "lost", "swaps", "knee band, px")
HARD_HEADER = (
    "way",
    "hard: mean",
    "all: mean",
    "leg angles",
    "lost",
    "swaps",
    "labels right, %",
    "hard: NEES",
    "inside two sigma, %",
)
SWITCHED_HEADER = ("way", "mean", "worst", "hard: mean", "hard: worst", "lost of all", "swaps in all")
CALIBRATED = (DEFAULT, DEFAULT + FILTERED, CV)

METHOD = """\
Eight hand-marked clips are followed from the marks of frame 0 with the same settings and scored by all later
marks; [compare.md](compare.md) explains lost, swaps and leg angles. Errors are in leg lengths; marks repeat
to about 0.02. Poses are smoothed over the clip; `filtered` ones use no later frames. Knee band: rms distance
between the paths of the tracked knee and a coloured band at it, without the mean. Four hard clips are a walk
backwards, a narrow room, a street and a sprint.
"""
MODELS = f"""\
Worst: the largest mean error of a clip. `classic` is the registration of the papers, `{CV}` constant velocity
with the noise that is best on these clips, `alone` without the free state. The rivals have the options that
are best here and no model of motion: `{FLOW}` tracks points on every link by optical flow and RANSAC,
`{BOXES}` one box per link by OpenCV's {{tracker}}.
"""
CLIPS = """\
Mean error, with the frame of a loss in brackets; the last four are the hard clips.
"""
HARD_CLIPS = """\
Without marks the walker is found first and all marks are scored. Labels: frames whose motion is named
rightly.
"""
SWITCHES = """\
The default model without one part, on the eight and on the hard clips.
"""
CALIBRATION = """\
NEES is the mean of e' (P + R)^-1 e over the visible marks, toes included, with tracked covariance P and
mark covariance R (1.5 px; 4 px along the limb for hip and knees). 2 and 86.5 % inside two sigma are right.
"""
CHOICE = """\
The settings with the least mean error over the eight clips; held out, each clip has those that are best on
the others.
"""


def page(results: Results) -> str:
    """The whole text."""
    models = table(HEADER, [[name, *_summary(row)] for name, row in results.rows.items()])
    return "\n".join(
        [
            *chapter("# Results on the open clips", f"{written('evaluate')}.", METHOD),
            *chapter("## What is wanted", claim_table(claims(results))),
            *chapter("## Models and rivals", MODELS.format(tracker=correlation.kind()), models),
            *chapter("## Each clip", CLIPS, _clips(results)),
            *chapter("## Hard clips, and no marks", HARD_CLIPS, _hard(results)),
            *chapter("## One part disabled", SWITCHES, _switched(results)),
            *chapter("## Calibration", CALIBRATION, _calibration(results)),
            *chapter("## What tuning to these clips gives", CHOICE, _held_out(results)),
        ]
    )


def claims(results: Results) -> list[Claim]:
    """What the default model is to reach."""
    rows, own = results.rows, results.rows[DEFAULT]
    mean = mean_error(own)
    tuned, unseen = results.tuned[DEFAULT], results.tuned[CV].held_out
    rivals = min(mean_error(rows[name]) for name in RIVALS)
    worst = {True: 0.0, False: 0.0}
    for clip, found in zip(results.clips, own, strict=True):
        walks = "walk" in clip.stem
        worst[walks] = max(worst[walks], found.score.mean_error_leg)
    bands = [found.band for found in own if found.band is not None]
    spread = _spread(own)
    return [
        Claim("lost", _lost(own), 0),
        Claim("swaps", _swaps(own), 0),
        Claim("median error", _median(own), 0.035),
        Claim("worst walk", worst[True], 0.05),
        Claim("worst run", worst[False], 0.07),
        Claim("leg angles", _direction(own), 3.0, unit="°"),
        Claim(f"mean error against {CV}", mean / mean_error(rows[CV]), 0.5),
        Claim("the same, each clip held out", mean_error(tuned.held_out) / mean_error(unseen), 0.5),
        Claim("mean error against the best rival", mean / rivals, 0.35),
        *_against(rows, DEFAULT, ALONE),
        *_against(rows, DEFAULT, ONE_STATE),
        *_against(rows, MANY_STATES, ALONE),
        Claim("mean error held out against tuned", tuned.ratio, 1.2),
        Claim("knee against the colour band, px", max(bands), 3.0),
        Claim("NEES", nees(spread), 4.0, 1.0),
        Claim("inside two sigma", inside(spread), 0.95, 0.75),
        *_of_hard(results),
    ]


def cell(found: Score) -> str:
    """A clip's mean error, and where it was lost."""
    lost = found.first_failure_frame
    return f"{found.mean_error_leg:.3f}" + ("" if lost is None else f" ({lost})")


def _against(rows: dict[str, list[Outcome]], many: str, one: str) -> list[Claim]:
    errors = [[found.score.mean_error_leg for found in rows[name]] for name in (many, one)]
    text = f"{many} against {one}"
    return [
        Claim(f"{text}, mean", float(np.mean(errors[0]) / np.mean(errors[1])), 1.0),
        Claim(f"{text}, worst clip", max(m / o for m, o in zip(*errors, strict=True)), 1.1),
    ]


def _clips(results: Results) -> list[str]:
    """A row a clip: what each way that is compared on the hard clips has there."""
    ways = {name: results.rows[name] + row for name, row in results.hard.rows.items()}
    clips = [clip.stem for clip in (*results.clips, *results.hard.clips)]
    each = zip(*ways.values(), strict=True)
    return table(
        ("clip", *ways),
        [[name, *(cell(found.score) for found in row)] for name, row in zip(clips, each, strict=True)],
    )


def _switched(results: Results) -> list[str]:
    rows = {DEFAULT: results.rows[DEFAULT]} | results.switched
    hard = {DEFAULT: results.hard.rows[DEFAULT]} | results.hard.switched
    return table(
        SWITCHED_HEADER,
        [
            [name, *_summary(row)[:2], *_summary(hard[name])[:2], *_summary(row + hard[name])[4:6]]
            for name, row in rows.items()
        ],
    )


def _summary(row: Sequence[Outcome]) -> list[str]:
    """The cells under HEADER."""
    bands = [f"{found.band:.1f}" for found in row if found.band is not None]
    return [
        f"{mean_error(row):.3f}",
        f"{max(found.score.mean_error_leg for found in row):.3f}",
        f"{_median(row):.3f}",
        f"{_direction(row):.1f}",
        str(_lost(row)),
        f"{_swaps(row)}",
        ", ".join(bands) or "-",
    ]


def _calibration(results: Results) -> list[str]:
    rows = []
    for name, row in results.rows.items():
        if name in CALIBRATED:
            spread = _spread(row)
            clips = [nees(_spread([found])) for found in row]
            span = f"{min(clips):.1f} to {max(clips):.1f}"
            rows.append(
                [name, f"{nees(spread):.2f}", span, f"{100 * inside(spread):.0f} %", str(len(spread))]
            )
    return table(("way", "NEES", "of single clips", "inside two sigma", "marks"), rows)


def _of_hard(results: Results) -> list[Claim]:
    """What is to be reached on the hard clips, and without marks."""
    eight, hard = len(results.clips), results.hard
    four, unmarked = hard.rows[DEFAULT], hard.unmarked
    own = results.rows[DEFAULT] + four
    alone, constant = (results.rows[name] + hard.rows[name] for name in (CV_ALONE, CV))
    return [
        Claim("all clips: lost", _lost(own), 0),
        Claim("all clips: swaps", _swaps(own), 0),
        Claim("eight clips: mean error", mean_error(own[:eight]), 0.038),
        Claim("hard clips: mean error", mean_error(four), 0.05),
        Claim("all clips: leg angles", _direction(own), 2.8, unit="°"),
        Claim("all clips: frames rightly labelled", _labelled(own), inf, 0.97),
        Claim("hard clips: NEES", nees(_spread(four)), 4.0, 1.0),
        Claim("hard clips: inside two sigma", inside(_spread(four)), 0.95, 0.8),
        Claim(f"all clips: mean error against {CV_ALONE}", mean_error(own) / mean_error(alone), 0.4),
        Claim(f"all clips: mean error against {CV}", mean_error(own) / mean_error(constant), 1.0),
        Claim("no marks: lost", _lost(unmarked), 0),
        Claim("no marks: swaps", _swaps(unmarked), 0),
        Claim("no marks, eight clips: mean error", mean_error(unmarked[:eight]), 0.046),
        Claim("no marks, hard clips: mean error", mean_error(unmarked[eight:]), 0.065),
    ]


def _hard(results: Results) -> list[str]:
    """A row a way: the hard clips, and what it comes to on all."""
    eight, hard = len(results.clips), results.hard
    rows = {name: results.rows[name] + row for name, row in hard.rows.items()}
    rows[f"{DEFAULT}, no marks"] = hard.unmarked
    return table(
        HARD_HEADER,
        [
            [
                name,
                f"{mean_error(row[eight:]):.3f}",
                f"{mean_error(row):.3f}",
                f"{_direction(row):.1f}",
                str(_lost(row)),
                str(_swaps(row)),
                number(100 * _labelled(row)),
                f"{nees(_spread(row[eight:])):.2f}",
                f"{100 * inside(_spread(row[eight:])):.0f}",
            ]
            for name, row in rows.items()
        ],
    )


def _labelled(row: Sequence[Outcome]) -> float:
    """Mean share of frames rightly labelled; NaN where none is."""
    shares = [found.labelled for found in row if found.labelled is not None]
    return float(np.mean(shares)) if shares else np.nan


def _held_out(results: Results) -> list[str]:
    rows = []
    for name, tuned in results.tuned.items():
        chosen = ", ".join(f"{n} {v}" for n, v in zip(GRIDS[name].tried, tuned.best, strict=True))
        errors = [f"{mean_error(of):.3f}" for of in (tuned.tuned, tuned.held_out)]
        rows.append([name, chosen, *errors, f"{tuned.ratio:.2f}"])
    return table(("way", "best on all", "mean error tuned", "held out", "ratio"), rows)


def _lost(row: Sequence[Outcome]) -> int:
    return sum(found.score.first_failure_frame is not None for found in row)


def _swaps(row: Sequence[Outcome]) -> int:
    return sum(found.score.swaps for found in row)


def _median(row: Sequence[Outcome]) -> float:
    """Of the errors of all marks of all clips, leg lengths."""
    return float(np.median(np.concatenate([found.score.mark_errors for found in row])))


def _direction(row: Sequence[Outcome]) -> float:
    """Median error of all visible leg links' directions, degrees."""
    return float(np.median(np.concatenate([found.score.link_errors for found in row])))


def _spread(row: Sequence[Outcome]) -> np.ndarray:
    return np.concatenate([found.distances for found in row if found.distances is not None])
