"""A finished run written into its folder."""

import json
import time
from dataclasses import asdict
from pathlib import Path

from tracker import __version__
from tracker.clip.again import film_told
from tracker.clip.follow import Run
from tracker.progress import Progress
from tracker.report.chapter import Chapter, headline
from tracker.report.drawing import write_film, write_overlay
from tracker.report.page import linked, write_report
from tracker.run.read import FILM, NEWS, OVERLAY, REPORT, START
from tracker.run.write import write_tables
from tracker.tables.keypoints import write_marks
from videos.playable import Playable


def write_run(
    finished: Run,
    folder: Path,
    progress: Progress,
    key: str = "",
    *,
    overlay: bool = True,
    report: bool = True,
    film: Playable | None = None,
) -> Chapter:
    """Write tables, overlay.mp4, gait.json, report.html and, last, run.json; returns the report's content.

    A film too large for the report stays beside it as film.mp4, unless `film` is given. `key` identifies a
    job of a batch.
    """
    began = time.perf_counter()
    write_tables(finished.track, folder, finished.frames, finished.fps)
    write_marks(folder / START, finished.job.passed(finished.start))
    if overlay:
        write_overlay(finished, folder / OVERLAY, progress)
    told = Chapter.of(finished)
    if told.gait is not None:
        figures = json.dumps(told.gait.summary(), indent=2)
        (folder / "gait.json").write_text(figures + "\n", encoding="utf-8")
    if report:
        shown = film or write_film(finished, folder / FILM, progress)
        write_report(folder / REPORT, told, shown)
        if film is None and not linked(shown):
            shown.path.unlink()
    write = (time.perf_counter() - began) / len(finished.track)
    job = finished.job
    news = {
        "figtrack": __version__,
        "video": job.called or str(job.video),
        "film": film_told(job),
        "model": job.model,
        "smooth": job.smooth,
        "anchors": job.anchors,
        "measure": None if finished.points is None else asdict(finished.points),
        "settings": finished.settings.model_dump(mode="json"),
        "options": job.asked(),
        "fps": finished.fps,
        "frames": finished.frames,
        "size": finished.size,
        "start": {
            "frame": finished.start,
            "marks": "given" if job.found is None else "found",
            "near_leg": "given" if job.found is None else job.found.near_leg,
        },
        "rate": job.rate or round(finished.rate, 2),
        "height": job.height,
        "scale": job.scale,
        "camera": {"moves": told.camera > 0.0, "pixels": round(told.camera, 1)},
        "facing": finished.track.view.side,
        "headline": headline(told),
        "seconds_per_frame": finished.seconds | {"write": round(write, 5)},
        "warnings": told.warnings,
    } | ({"job": key} if key else {})
    (folder / NEWS).write_text(json.dumps(news, indent=2) + "\n", encoding="utf-8")
    return told
