"""Write docs/measure.md: how much of a pose network's faults `track --measure` repairs.

    python -m tests.benchmarks.evaluation.points CLIPS docs/measure.md

CLIPS holds the videos, each with its NAME.keypoints.csv. The points are smooth paths through the hand marks,
spoiled. Two processes, of one thread each where the environment says so as in `make measure`; about ten
minutes.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.benchmarks.evaluation.cases import QUIET, START, marks_of, measured
from tests.benchmarks.evaluation.spoiled import (
    Damage,
    by_frame,
    constant_velocity,
    filled,
    median,
    splined,
    spoil,
)
from tests.benchmarks.evaluation.ways import DEFAULT
from tests.benchmarks.page import chapter, table, written
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.foreign.dlc import write_dlc
from tracker.foreign.points import Points
from tracker.progress import Progress
from tracker.run.score import Score, places, score
from tracker.settings import Settings

DRAWS = 3  # of the damage a clip
ASKED = Damage(exchanged=0.1, missing=0.1)
ACCELERATIONS = (0.3, 1.0, 3.0, 10.0)  # px a frame squared; the best on these very clips is shown
POINTS_ALONE = f"`--measure --no-templates`, {DEFAULT}"
BOTH = f"`--measure`, {DEFAULT}"
MEDIAN = "median of five frames"
SMOOTHER = "constant-velocity smoother"
WORSE = {
    "5 px jitter alone": Damage(),
    "10 % of frames exchanged, 10 % of points missing": ASKED,
    "half of the frames exchanged": Damage(exchanged=0.5),
    "ten frames on end exchanged": Damage(stretch=10),
    "half of the points missing": Damage(missing=0.5),
    "no point in ten frames on end": Damage(hole=10),
    "both legs on the near one in 20 % of the frames": Damage(both=0.2),
    "12 px jitter": Damage(jitter=12.0),
}
REPAIRS: dict[str, Callable[[Points, float], Points]] = {
    "as they are, gaps filled by lines": lambda points, _: filled(points),
    MEDIAN: lambda points, _: median(points),
    **{
        f"{SMOOTHER}, {a:g}": lambda points, jitter, a=a: constant_velocity(points, a, jitter)
        for a in ACCELERATIONS
    },
}
FOLLOWED = {
    f"no points, {DEFAULT}": (DEFAULT, False, True),
    "`--measure --no-templates`, cv": ("cv", True, False),
    POINTS_ALONE: (DEFAULT, True, False),
    BOTH: (DEFAULT, True, True),
}
USE = """\
    figtrack track walk.mp4 --keypoints walk.keypoints.csv --measure walk.dlc.csv
    figtrack track walk.mp4 --keypoints walk.keypoints.csv --measure walk.dlc.csv --no-templates --out alone

add the points of a pose network as an uncertain measurement: DeepLabCut CSV, OpenPose JSON (file or
folder), COCO keypoints, labelme or TRC in pixels, [named as marks](annotate.md#marks-from-other-programs).
The marked frame gives limb lengths and the near leg. `--no-templates` uses the points alone, which is worse
where points are missing or poor. `compare` has both options.

- Exchanged legs, gaps and jitter are repaired; run.json lists the exchanged frames. A constant offset of the
  network's joints, or a return from a long gap with exchanged legs, is not noticed.
- Points have Student t errors with the measured jitter, at least `point` leg lengths; less likely ones than
  `point_likelihood` are absent. `exchange` and `one_leg` are the prior shares of frames with exchanged legs
  and with both legs on one ([settings.md](settings.md)).
- Frames without points are predicted, or `lost` without templates. `hidden`: a joint has no point near it.
"""
METHOD = """\
The points are splines through the hand marks, damaged; points of real networks have offsets of their own.
Errors are means in leg lengths at the hand marks after frame 0. The rivals know no limb lengths and no start
marks. Measured jitter and the state of both legs on one were added after a look at these tables.
"""
TRIED = ", ".join(f"{acceleration:g}" for acceleration in ACCELERATIONS)
AS_ASKED = f"""\
Each clip has {DRAWS} draws. Direction is the median error of leg links, swaps are frames that
stay exchanged.
The smoother's acceleration (px a frame squared) is the best of {TRIED} on these clips.
"""
OTHER = "Mean error, and clips lost in brackets; 5 px jitter unless stated."


@dataclass(frozen=True)
class Found:
    """What a way makes of spoiled points.

    exchanged : frames named the wrong way round: those there are, those of them that were found, and others
        that were taken for such; None for who does not say
    """

    score: Score
    exchanged: tuple[int, int, int] | None = None


Row = list[Found]


def main() -> None:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.evaluation.points", description=__doc__)
    parser.add_argument("clips", type=Path, help="folder of the marked clips")
    parser.add_argument("out", type=Path, help="the page, Markdown")
    asked = parser.parse_args()
    clips, progress = sorted(asked.clips.glob("*.mp4")), Progress()

    def row(way: str, damage: Damage, draws: int, name: str) -> Row:
        return measured(repaired, product(clips, [way], [damage], range(draws)), progress, name)

    asked_for = {way: row(way, ASKED, DRAWS, way) for way in (*REPAIRS, *FOLLOWED)}
    ways = (MEDIAN, _best(asked_for), POINTS_ALONE, BOTH)
    worse = {name: {way: row(way, damage, 1, name) for way in ways} for name, damage in WORSE.items()}
    asked.out.write_text(page(clips, asked_for, worse), encoding="utf-8")


def repaired(clip: Path, way: str, damage: Damage, draw: int) -> Found:
    """Errors of one way on one clip; `draw` seeds the damage."""
    marks = marks_of(clip)
    rng = np.random.default_rng([draw, *clip.stem.encode()])
    bad = spoil(splined(marks), damage, rng)
    if way in REPAIRS:
        return Found(score(marks, by_frame(REPAIRS[way](bad.points, damage.jitter)), START))
    model, measure, templates = FOLLOWED[way]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "points.csv"
        write_dlc(bad.points, path)
        job = Job(
            *(clip, marks),
            model=model,
            settings=Settings(templates=templates),
            start=START,
            stop=max(marks),
            measure=path if measure else None,
        )
        run = follow(job, QUIET)
    result = score(marks, places(run.track), START)
    if run.points is None:
        return Found(result)
    said, true = set(run.points.exchanged), bad.exchanged
    return Found(result, (len(true), len(said & true), len(said - true)))


def page(clips: Sequence[Path], asked: dict[str, Row], worse: dict[str, dict[str, Row]]) -> str:
    """The whole text."""
    smoother = _best(asked)
    kept = {way: row for way, row in asked.items() if not way.startswith(SMOOTHER) or way == smoother}
    lost = f"lost of {len(clips) * DRAWS}"
    header = ("way", "mean error", "direction, °", lost, "swaps", "exchanges found")
    others = [[name, *(_worse(row) for row in ways.values())] for name, ways in worse.items()]
    return "\n".join(
        [
            *chapter("# Points of a pose network", USE),
            *chapter(
                f"## How much is repaired, on {len(clips)} open clips", f"{written('measure')}.", METHOD
            ),
            *chapter(
                "### Legs exchanged in 10 % of the frames, 10 % of the points missing, 5 px jitter",
                AS_ASKED,
                table(header, [[way, *_cells(row)] for way, row in kept.items()]),
            ),
            *chapter("### Other damage", OTHER, table(("damage", *worse[next(iter(worse))]), others)),
        ]
    )


def _best(asked: dict[str, Row]) -> str:
    """The smoother that is best on these clips."""
    return min((way for way in asked if way.startswith(SMOOTHER)), key=lambda way: _mean(asked[way]))


def _mean(row: Row) -> float:
    return float(np.mean([found.score.mean_error_leg for found in row]))


def _lost(row: Row) -> int:
    return sum(found.score.first_failure_frame is not None for found in row)


def _cells(row: Row) -> list[str]:
    angles = np.concatenate([found.score.link_errors for found in row])
    said = [found.exchanged for found in row if found.exchanged is not None]
    there, right, wrong = np.sum(said, axis=0) if said else (0, 0, 0)
    return [
        f"{_mean(row):.3f}",
        f"{np.median(angles):.1f}",
        str(_lost(row)),
        str(sum(found.score.swaps for found in row)),
        f"{right} of {there}, {wrong} falsely" if said else "-",
    ]


def _worse(row: Row) -> str:
    return f"{_mean(row):.3f}" + (f" ({_lost(row)})" if _lost(row) else "")


if __name__ == "__main__":
    main()
