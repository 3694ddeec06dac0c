"""Several models on one clip: a run's folder for each, and a page that compares them."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from kinematics.figure_file import load_figure
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.clip.outlines import look
from tracker.clip.plan import prepare, start_frame
from tracker.progress import Progress
from tracker.report.chapter import Chapter
from tracker.report.drawing import write_film
from tracker.report.html_tables import SCORE_COLUMNS, in_columns, table_rows
from tracker.report.page import linked, write_comparison
from tracker.report.results import write_run
from tracker.report.sheets import write_error_plot, write_sheet
from tracker.run.read import FILM, REPORT
from tracker.run.score import Score, places, score
from tracker.tables.keypoints import Marks
from videos.playable import Playable


def compare_models(
    job: Job, truth: Marks, models: Sequence[str], folder: Path, progress: Progress, notes: Sequence[str] = ()
) -> str:
    """Follow the clip with every model, write all into `folder`, and return the table as text.

    Only frames up to `job.stop` are scored, and none whose marks were used as anchors. ValueError: no frame
    of the truth after the start can be scored, or two models have one name; else raises as `clip.follow`.
    """
    figure = load_figure(job.figure)
    jobs = {Path(model).name.removesuffix(".npz"): replace(job, model=model) for model in models}
    if len(jobs) < len(models):
        raise ValueError(f"two of the models {', '.join(models)} have one name; rename a file")
    # Errors in any model or the truth are raised before the work.
    plans = [prepare(each) for each in jobs.values()]
    start = start_frame(job)
    given = _anchors_of(job, _within(truth, job.stop, figure.scored), start)
    truth = {frame: marks for frame, marks in truth.items() if frame not in given}
    if given and not any(frame > start for frame in truth):
        raise ValueError(
            f"all {len(given)} truth frames after frame {start} are anchors; give --truth with other frames"
        )
    score(_within(truth, job.stop, figure.scored), {}, start, figure)

    seen = look(plans[0], progress)
    chapters: dict[str, Chapter] = {}
    scores: dict[str, Score] = {}
    films: list[Playable] = []  # a single one, which all pages share
    for name, each in jobs.items():
        finished = follow(each, progress, seen=seen)
        (folder / name).mkdir()
        films = films or [write_film(finished, folder / FILM, progress)]
        chapters[name] = replace(write_run(finished, folder / name, progress, film=films[0]), name=name)
        for warning in finished.warnings:
            progress.warn(f"{name}: {warning}")
        reached = _within(truth, finished.frames - 1, figure.scored)
        if not any(frame > start for frame in reached):
            raise ValueError(
                f"the truth marks no frame from {start + 1} to {finished.frames - 1}, the film's last; "
                "mark some or give another --truth"
            )
        scores[name] = score(reached, places(finished.track), start, figure)
    write_error_plot(scores, folder / "errors.png")
    sheet = folder / "failure.png"
    write_sheet(job.video, {name: each.track for name, each in chapters.items()}, scores, sheet)
    said = [f"{len(given)} anchors not scored"] if given else []
    page, told = folder / REPORT, list(chapters.values())
    write_comparison(page, films[0], told, scores, sheet, [*said, *notes])
    if not linked(films[0]):
        films[0].path.unlink()
    summary = {"models": {name: result.summary() for name, result in scores.items()}}
    (folder / "compare.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    return "\n".join([in_columns([SCORE_COLUMNS, *table_rows(scores)]), *said])


def _anchors_of(job: Job, truth: Marks, start: int) -> set[int]:
    """Frames after the start whose marks the tracker was given as anchors."""
    told = job.marks if job.anchors else {}
    return {frame for frame, marks in truth.items() if frame > start and marks == told.get(frame)}


def _within(truth: Marks, last: int | None, scored: Sequence[str]) -> Marks:
    """The marks of frames up to `last` that have a scored joint."""
    return {
        frame: marks
        for frame, marks in truth.items()
        if (last is None or frame <= last) and not marks.keys().isdisjoint(scored)
    }
