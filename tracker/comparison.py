"""Several models on one clip: a run's folder each, and the page that sets them side by side."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tracker.clip import Job, Run, follow, start_frame, write_run
from tracker.compare import Score, places, score
from tracker.keypoints import Marks
from tracker.progress import Progress
from tracker.report import text_table, write_error_plot, write_page, write_sheet


def compare_models(
    job: Job, truth: Marks, models: Sequence[str], folder: Path, progress: Progress, notes: Sequence[str] = ()
) -> str:
    """Follow the clip with every model, write all into `folder`, and give the table as text.

    Raises:
        ValueError: a truth without marked frames after the start; and whatever `clip.follow` raises.
    """
    runs: dict[str, Run] = {}
    scores: dict[str, Score] = {}
    for model in models:
        finished = follow(replace(job, model=model), progress)
        name = Path(model).stem
        (folder / name).mkdir()
        write_run(finished, folder / name, progress)
        runs[name] = finished
        scores[name] = score(truth, places(finished.track), start_frame(job))
    write_error_plot(scores, folder / "errors.png")
    write_sheet(runs, scores, folder / "failure.png")
    write_page(job.video.name, runs, scores, folder, notes)
    summary = {"models": {name: result.summary() for name, result in scores.items()}}
    (folder / "compare.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    return text_table(scores)
