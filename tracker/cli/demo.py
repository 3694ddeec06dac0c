"""The whole story on a rendered walk: encoded, followed with constant velocity and the learned model."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tracker import __version__
from tracker.clip.job import Job
from tracker.progress import Progress
from tracker.report.comparison import compare_models
from tracker.run.folder import fresh_folder
from tracker.scene.film import Scene, render, truth_table
from tracker.tables.keypoints import read_keypoints
from tracker.tables.table import write_table
from videos.writer import Writer

MODELS = ("walk-run", "cv")
FRAMES = 90
CRF = 26  # h264 quality: visible blocks
NOTE = (
    "A rendered clip: it shows that all parts work and where the two models part, not how well real "
    "footage is followed. Only the marks of frame 0 are used for tracking; the others are the truth."
)


def run_demo(
    out: Path,
    seed: int,
    *,
    overwrite: bool,
    progress: Progress,
    models: Sequence[str] = MODELS,
    frames: int = FRAMES,
) -> tuple[Path, str]:
    """Render, track, compare; gives the page to open and the table."""
    with fresh_folder(out, overwrite=overwrite) as aside:
        with progress.task("rendering a walk", frames) as advance:
            scene = render(seed, frames=frames, advance=advance)
        video, marks = write_scene(scene, aside)
        job = Job(video, read_keypoints(marks), models[0], called=str(out / video.name))
        table = compare_models(job, job.marks, models, aside, progress, [NOTE])
        news = {"figtrack": __version__, "seed": seed}
        (aside / "demo.json").write_text(json.dumps(news) + "\n", encoding="utf-8")
    return out / "report.html", table


def write_scene(scene: Scene, folder: Path) -> tuple[Path, Path]:
    """The clip and its marks as walk.mp4 and walk.keypoints.csv."""
    video, marks = folder / "walk.mp4", folder / "walk.keypoints.csv"
    height, width = scene.images[0].shape[:2]
    with Writer(video, scene.fps, (width, height), crf=CRF) as writer:
        for image in scene.images:
            writer.write(np.asarray(image))
    rows = ((t, name, f"{x:.2f}", f"{y:.2f}", seen) for t, name, x, y, seen in truth_table(scene))
    write_table(marks, ("frame", "keypoint", "x", "y", "visible"), rows)
    return video, marks
