"""Write docs/robustness.md: what bad start marks, bad pictures, short films, hidden feet and shrubs do to a
track.

    python -m tests.benchmarks.evaluation.robustness DATA docs/robustness.md

DATA holds video/ and video_hard/, of which each clip has its NAME.keypoints.csv, and mocap/trials.csv. Every
disturbance comes alone, on the clips of video/. Two processes, of one thread each where the environment says
so as in `make robustness`; about forty minutes.
"""

import argparse
from collections.abc import Sequence
from functools import partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kinematics.recover import PoseError
from tests.benchmarks.evaluation import misplaced, parts
from tests.benchmarks.evaluation.cases import BEFORE_ALL, QUIET, START, Ours, marks_of, measured, measured_by
from tests.benchmarks.evaluation.disturbances import (
    DISTURBANCES,
    GUESS_NOISE,
    START_NOISE,
    Film,
    behind_hedge,
    moved,
    read_film,
    write_film,
)
from tests.benchmarks.evaluation.feet import FEET
from tests.benchmarks.evaluation.films import CLOSER, CONTRAST, FILMS, GAMMA, ROLL, VIEW
from tests.benchmarks.evaluation.ways import DEFAULT
from tests.benchmarks.page import Claim, chapter, claim_table, table, written
from tracker.cli.demo import write_scene
from tracker.clip.asked import asked
from tracker.clip.follow import follow
from tracker.clip.job import Following, Job
from tracker.clip.start import FoundError, StartError
from tracker.progress import Progress
from tracker.run.score import Score, places, score
from tracker.scene.film import render
from tracker.settings import Settings
from tracker.tables.keypoints import Marks, read_keypoints

Scores = dict[str, list[Score | None]]

DRAWS = 30  # of start marks a clip
DROPPED = "every second frame"
SEEN_WORSE = tuple(name for name in DISTURBANCES if name not in ("none", DROPPED))
METHOD = f"""\
One disturbance each, `{DEFAULT}` with default settings. Errors are in leg lengths against the
undisturbed marks after frame 0; a refusal counts 1.
"""
WALKS = range(100, 140)  # seeds of rendered walks: no setting was chosen by these
OURS = Ours(DEFAULT)
WAYS = {
    DEFAULT: OURS,
    f"{DEFAULT}, no occlusion by the scene": Ours(DEFAULT, Settings(covered=0.0)),
    "cv": Ours("cv"),
}
SHRUBS = f"""\
The walks of `figtrack demo --seed N`, N from {WALKS.start} to {WALKS.stop - 1}.
"""
HIDDEN_FEET = f"""\
Marks missing in frame 0, where the hedge covers the feet. A guess is marked as not visible and has
{GUESS_NOISE:g} px of noise.
"""
STARTS = f"Every mark of frame 0 gets {START_NOISE:g} px of Gaussian noise."
PICTURES = f"""\
Against the light: grey levels to the power of {GAMMA:g}. Haze: {100 * CONTRAST:.0f} % of the contrast. The
accompanying camera shows {100 * VIEW:.0f} % of the width. Others roll by
{ROLL:g} degrees either way, or zoom to {CLOSER:g} times the size. Half and double speed keep the frame rate.
"""
SOAK = """\
`make soak` runs random commands on random films for an hour, kills a third, and checks how each ends.
32,658 commands found nine faults, all mended. An early interrupt shows a traceback.
"""

SHOTS = {**DISTURBANCES, **FILMS}


def main() -> None:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.evaluation.robustness", description=__doc__
    )
    parser.add_argument("data", type=Path, help="folder of the marked clips and the captures")
    parser.add_argument("out", type=Path, help="the page, Markdown")
    options = parser.parse_args()
    clips, hard = (sorted((options.data / name).glob("*.mp4")) for name in ("video", "video_hard"))
    progress = Progress()
    wrong, cut = misplaced.cases([*clips, *hard]), list(product([*clips, *hard], parts.VIEWS))
    told_of = partial(misplaced.told, options.data / "mocap" / "trials.csv")
    told = measured(told_of, wrong, progress, "marks put wrongly")
    alone = measured(parts.told, cut, progress, "parts of films")
    answers = dict(zip(wrong, told, strict=True)), dict(zip(cut, alone, strict=True))
    without = partial(disturbed, False)
    unmarked = measured_by(SHOTS, [*clips, *hard], without, progress, "disturbed pictures, no marks")
    options.out.write_text(page(clips, unmarked, *measure(clips, progress), *answers), encoding="utf-8")


def measure(clips: Sequence[Path], progress: Progress) -> tuple[Scores, Scores, Scores, Scores]:
    """Scores of everything asked, in the order of the page.

    By disturbance, one a clip; by clip, one a draw of the start; by what the start lacks of its feet, one a
    clip; by way, one a rendered walk.
    """
    starts = measured_by(clips, range(DRAWS), from_moved_marks, progress, "disturbed starts")
    walks = measured(past_shrubs, zip(WALKS, strict=True), progress, "rendered walks")
    return (
        measured_by(SHOTS, clips, partial(disturbed, True), progress, "disturbed pictures"),
        {clip.stem: row for clip, row in starts.items()},
        measured_by(FEET, clips, without_feet, progress, "feet not marked"),
        {name: [scores[name] for scores in walks] for name in WAYS},
    )


def disturbed(marked: bool, name: str, clip: Path) -> Score | None:
    """The score of a clip whose pictures are disturbed, from its marks or without; None, here and below,
    where the start is refused."""
    film = SHOTS[name](read_film(clip, marks_of(clip)))
    return _score_film(film, film.marks if marked else None)


def from_moved_marks(clip: Path, draw: int) -> Score | None:
    """The score of a clip whose start marks are moved by noise; `draw` seeds it."""
    marks = marks_of(clip)
    rng = np.random.default_rng([draw, *clip.stem.encode()])
    return _score(clip, marks | {START: moved(marks[START], rng)}, marks)


def without_feet(name: str, clip: Path) -> Score | None:
    """The score of a clip whose start marks lack feet as FEET tells."""
    feet, marks = FEET[name], marks_of(clip)
    rng = np.random.default_rng(list(clip.stem.encode()))
    given = marks | {START: feet.start(marks[START], rng)}
    if feet.hedge:
        return _score_film(behind_hedge(read_film(clip, marks)), given)
    return _score(clip, given, marks)


def past_shrubs(seed: int) -> dict[str, Score | None]:
    """By way, the score of the walk that is rendered from a seed."""
    with TemporaryDirectory() as folder:
        video, table_of_marks = write_scene(render(seed), Path(folder))
        marks = read_keypoints(table_of_marks)
        return {name: _score(video, marks, marks, way) for name, way in WAYS.items()}


def lost(found: Score | None) -> bool:
    """Whether the figure was not followed to the last mark; a refusal is no better."""
    return found is None or found.first_failure_frame is not None


def page(
    clips: Sequence[Path],
    unmarked: Scores,
    pictures: Scores,
    starts: Scores,
    feet: Scores,
    walks: Scores,
    wrong: misplaced.Answers,
    alone: parts.Answers,
) -> str:
    """The whole text, of what came of disturbed films without marks, of what `measure` returns, and of marks
    put wrongly and parts of films."""
    wanted = [*claims(clips, pictures, starts), *misplaced.claims(wrong), *parts.claims(alone)]
    return "\n".join(
        [
            *chapter("# Robustness on the open clips", f"{written('robustness')}.", METHOD),
            *chapter("## What is wanted", claim_table(wanted)),
            *chapter("## Disturbed pictures", PICTURES, _by_row(clips, pictures, unmarked)),
            *chapter("## Disturbed start marks", STARTS, _summaries("clip", starts)),
            *misplaced.section(wrong),
            *parts.section(alone),
            *chapter("## Feet that are not marked", HIDDEN_FEET, _by_row(clips, feet)),
            *chapter("## Legs behind shrubs", SHRUBS, _summaries("way", walks)),
            *chapter("## Soak", SOAK),
        ]
    )


def claims(clips: Sequence[Path], pictures: Scores, starts: Scores) -> list[Claim]:
    """What the default model is to withstand."""
    runs = [found for row in starts.values() for found in row]
    walks = ["walk" in clip.stem for clip in clips]
    return [
        Claim("share of runs lost from disturbed start marks", float(np.mean([lost(r) for r in runs])), 0.05),
        Claim(f"clips followed, {DROPPED}", _kept(pictures[DROPPED]), len(clips), 0.75 * len(clips)),
        *(
            Claim(
                f"walks lost, {name}",
                sum(lost(found) for found, walk in zip(pictures[name], walks, strict=True) if walk),
                0,
            )
            for name in SEEN_WORSE
        ),
    ]


def _score_film(film: Film, given: Marks | None) -> Score | None:
    """Errors against the film's own marks of a track that starts from those given, or from none."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mov"
        write_film(film, path)
        return _score(path, given, film.marks)


def _score(video: Path, given: Marks | None, truth: Marks, way: Ours = OURS) -> Score | None:
    """Errors against the true marks of a track that starts from those given, or from none."""
    start = BEFORE_ALL if given is None else START
    try:
        if given is None:
            job = asked(Following(model=way.model), video, None, way.settings, QUIET)
        else:
            job = Job(video, given, model=way.model, settings=way.settings, start=START, stop=max(truth))
        return score(truth, places(follow(job, QUIET).track), start)
    except (StartError, FoundError, PoseError):
        return None


def _kept(row: Sequence[Score | None]) -> int:
    return sum(not lost(found) for found in row)


def _by_row(clips: Sequence[Path], scores: Scores, unmarked: Scores | None = None) -> list[str]:
    """A table of how many clips were followed, which were not, and their errors, from marks and without."""
    header, rows = ["disturbance", f"followed of {len(clips)}", "mean error", "worst"], []
    for name, row in scores.items():
        lost_ones = [clip.stem for clip, found in zip(clips, row, strict=True) if lost(found)]
        followed, errors = ", not ".join([f"{_kept(row)}", *lost_ones]), _errors(row)
        rows.append([name, followed, f"{np.mean(errors):.3f}", f"{max(errors):.3f}"])
    if unmarked is not None:
        header += [f"of {len(unmarked[DROPPED])} without marks", "mean error"]
        for cells, row in zip(rows, unmarked.values(), strict=True):
            cells += [f"{_kept(row)}", f"{np.mean(_errors(row)):.3f}"]
    return table(header, rows)


def _summaries(what: str, scores: Scores) -> list[str]:
    """A table of runs, a row for each name of what is asked."""
    runs = min(len(row) for row in scores.values())
    return table(
        (what, f"lost of {runs}", "median of mean errors", "worst"),
        [[name, *_summary(row)] for name, row in scores.items()],
    )


def _summary(row: Sequence[Score | None]) -> list[str]:
    """The cells of a row of runs."""
    errors = _errors(row)
    return [f"{len(row) - _kept(row)}", f"{np.median(errors):.3f}", f"{max(errors):.3f}"]


def _errors(row: Sequence[Score | None]) -> list[float]:
    """Mean errors, leg lengths; a refusal counts 1."""
    return [1.0 if found is None else found.mean_error_leg for found in row]


if __name__ == "__main__":
    main()
