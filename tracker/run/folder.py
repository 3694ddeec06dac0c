"""Folders of results, written under a temporary name and renamed when complete, so never incomplete."""

import os
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from stat import S_IMODE
from typing import Any

from kinematics.text_file import read_json
from tracker.run.read import FILM, REPORT, RUN_FILES, START

try:
    import fcntl
except ImportError:  # Windows, where leftovers are not removed
    fcntl = None  # type: ignore[assignment]

CORRECTED = "corrected.keypoints.csv"  # in a run's folder: corrected marks, not yet followed
# The file that a complete run writes last, a key by which it is recognised, and the other results beside it.
MARKERS = {
    "run.json": ("figtrack", {*RUN_FILES, START, REPORT, FILM, CORRECTED}),
    "compare.json": ("models", {"errors.png", "failure.png", REPORT, FILM}),
    "demo.json": ("figtrack", {"walk.mp4", "walk.keypoints.csv", "demo.mp4", "demo.LICENSE.txt"}),
    "reproduce.json": ("figtrack", {"reproduce.html"}),
}
PART, DRAWN = ".part", 8  # ending of temporary folders, and number of random letters before it
LOCK = "lock"  # file in a temporary folder, locked by its process; the system unlocks it when that ends


class FolderError(Exception):
    """A folder or file to which results cannot be written."""


def holds_run(path: Path) -> bool:
    """Whether this folder holds complete results of a figtrack command."""
    return bool(_markers(path))


def _markers(path: Path) -> dict[str, dict[str, Any]]:
    """The contents of the markers in a folder by their names."""
    found = {}
    for name, (key, _) in MARKERS.items():
        # run.json may be missing, or another program's: binary or no JSON object.
        with suppress(OSError, ValueError, RecursionError):
            news = read_json(path / name)
            if isinstance(news, dict) and key in news:
                found[name] = news
    return found


@contextmanager
def fresh_folder(
    path: Path,
    *,
    overwrite: bool,
    inputs: Iterable[Path | None] = (),
    replaceable: Callable[[Path], bool] = holds_run,
    corrected: bool = False,
) -> Iterator[Path]:
    """A new folder to write into, which becomes `path` when the block succeeds and is removed when it fails.

    What a replaced run's folder holds beside its results is in the new one too.

    Args:
        path: the final place; a link is followed.
        overwrite: whether a complete run may be replaced. Anything else is never replaced.
        inputs: input files, None for none, which must not lie in the folder that is replaced.
        replaceable: tells whether a folder holds a complete run.
        corrected: whether corrections in it are what the new one follows; others are never replaced.

    Raises:
        FolderError: a file at this place, a folder that cannot be written, a complete run without
            `overwrite`, a folder that holds something else or one of the inputs.
    """
    place = _real(path)
    _sweep(place)
    check_folder(path, overwrite, replaceable, corrected)
    check_inputs(path, inputs)
    with _workshop(place) as workshop:
        new = workshop / "new"
        yield new
        check_folder(path, overwrite, replaceable, corrected)  # another run may have finished meanwhile
        _exchange(new, place, workshop / "old")


@contextmanager
def fresh_file(path: Path, *, overwrite: bool, inputs: Iterable[Path | None] = ()) -> Iterator[Path]:
    """A temporary name to write to, which becomes `path`, or its link's target, when the block succeeds and
    is removed when it fails.

    Permissions of a replaced file are kept. Input files (None for none) are never replaced. FolderError: a
    folder, a device or an input at this place, a folder that cannot be written, or a file without
    `overwrite`.
    """
    place = _real(path)
    _sweep(place)
    check_file(path, overwrite, inputs)
    with _workshop(place) as workshop:
        new = workshop / "new" / place.name
        yield new
        check_file(path, overwrite)
        if place.exists():
            new.chmod(S_IMODE(place.stat().st_mode))
        new.replace(place)


@contextmanager
def swept(paths: Iterable[Path]) -> Iterator[None]:
    """In this block others may make `paths`; before and after it leftovers of killed processes are removed.

    A complete run that was being replaced at that moment is restored.
    """
    places = [_real(path) for path in paths]
    for place in places:
        _sweep(place)
    try:
        yield
    finally:
        for place in places:
            _sweep(place)


def check_inputs(path: Path, inputs: Iterable[Path | None]) -> None:
    """FolderError if replacing the folder would remove one of the inputs."""
    for kept, what in [
        (Path.cwd(), "the folder you are in"),
        *((each, str(each)) for each in inputs if each is not None),
    ]:
        if _real(kept).is_relative_to(_real(path)):
            raise FolderError(f"{path} would be replaced, and with it {what}; keep the two apart")


def check_folder(
    path: Path, overwrite: bool, replaceable: Callable[[Path], bool], corrected: bool = False
) -> None:
    """FolderError if no folder of results can be put there, by the rules of `fresh_folder`."""
    if not path.exists():
        return
    if not path.is_dir():
        raise FolderError(f"{path} is a file; --out wants a folder, choose another name")
    if os.path.ismount(path):  # Path.is_mount is true for every "."
        raise FolderError(
            f"{path} is where a disk is mounted and cannot be renamed; choose a folder inside it"
        )
    if not any(path.iterdir()):
        return
    if not replaceable(path):
        raise FolderError(f"{path} holds files that are no run of figtrack; choose another --out")
    if not overwrite:
        raise FolderError(
            f"{path} holds a complete run; choose another --out, or replace it with --overwrite"
        )
    waiting = [path / CORRECTED, *path.glob(f"*/{CORRECTED}")]  # of a run, or of each run of a comparison
    if held := [] if corrected else [table.parent for table in waiting if table.exists()]:
        raise FolderError(
            f"{held[0]} holds corrections that were not followed yet; follow on in 'figtrack correct', or "
            f"move {CORRECTED} away"
        )


def check_file(path: Path, overwrite: bool, inputs: Iterable[Path | None] = ()) -> None:
    """FolderError if no file can be put there, by the rules of `fresh_file`."""
    if path.exists() and any(each is not None and each.exists() and path.samefile(each) for each in inputs):
        raise FolderError(f"{path} is what the work reads; choose another --out")
    if path.is_dir():
        raise FolderError(f"{path} is a folder; --out wants a file, choose another name")
    if path.exists() and not path.is_file():
        raise FolderError(f"{path} is no ordinary file and cannot be replaced; choose another --out")
    if path.exists() and not overwrite:
        raise FolderError(f"{path} exists; choose another --out, or replace it with --overwrite")


@contextmanager
def _workshop(place: Path) -> Iterator[Path]:
    """A hidden folder beside `place` with another in it, "new"; removed afterwards, with its new parents."""
    made = [parent for parent in place.parents if not parent.exists()]
    workshop = place.parent / f".{place.name}.{secrets.token_hex(DRAWN // 2)}{PART}"
    lock = None
    try:  # begins before the folder is made, or Ctrl-C at that moment would leave it
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            lock = _locked(workshop)
            (workshop / "new").mkdir()
        except OSError as error:
            raise FolderError(
                f"cannot write into {place.parent} ({error.strerror}); choose another --out"
            ) from error
        yield workshop
    finally:
        try:
            _removed(workshop, made)
        except KeyboardInterrupt:  # a second one within seconds is ignored while this cleans up
            _removed(workshop, made)
            raise
        finally:
            if lock is not None:
                os.close(lock)


def _removed(workshop: Path, made: list[Path]) -> None:
    """Remove the folder, and those of the parents made for it that are empty."""
    shutil.rmtree(workshop, ignore_errors=True)
    for parent in made:
        with suppress(OSError):
            parent.rmdir()


def _locked(workshop: Path) -> int | None:
    """Make the folder and lock it until the returned descriptor is closed; None where locks do not exist."""
    while True:
        workshop.mkdir(0o700, exist_ok=True)
        if fcntl is None:
            return None
        with suppress(FileNotFoundError):  # another process removed it as a leftover before it was locked
            lock = os.open(workshop / LOCK, os.O_RDWR | os.O_CREAT, 0o600)
            with suppress(OSError):  # a file system without locks, on which leftovers are not removed
                fcntl.flock(lock, fcntl.LOCK_EX)
            if (workshop / LOCK).exists():
                return lock
            os.close(lock)


def _sweep(place: Path) -> None:
    """Remove temporary folders of killed processes beside `place`; runs that they had moved are restored."""
    if fcntl is None:
        return
    for workshop in place.parent.glob(f".{escape(place.name)}.{'?' * DRAWN}{PART}"):
        with suppress(OSError):
            lock = os.open(workshop / LOCK, os.O_RDWR | os.O_CREAT, 0o600)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # fails while the process runs
                if (workshop / "old").exists() and not place.exists():
                    (workshop / "old").rename(place)
                shutil.rmtree(workshop, ignore_errors=True)
            finally:
                os.close(lock)


def _exchange(new: Path, place: Path, old: Path) -> None:
    try:
        if place.exists():
            new.chmod(S_IMODE(place.stat().st_mode))
            if holds_run(place):
                _carry(place, new)
            place.rename(old)
        new.rename(place)
    except BaseException as error:
        if old.exists() and not place.exists():
            old.rename(place)
        if isinstance(error, OSError):
            raise FolderError(
                f"cannot put the results at {place} ({error.strerror}); choose another --out"
            ) from error
        raise


def _carry(place: Path, new: Path) -> None:
    """Link into the new folder what lies beside the results; all stays in `place`, so nothing can be lost."""
    results = _results(place)

    def ours(folder: str, names: list[str]) -> list[str]:
        return [name for name in names if Path(folder, name) in results]

    try:
        shutil.copytree(place, new, symlinks=True, ignore=ours, copy_function=_link, dirs_exist_ok=True)
    except shutil.Error as error:
        (kept, *_, reason), *_ = error.args[0]
        raise FolderError(f"{kept} cannot be kept beside the new results ({reason}); move it away") from error


def _link(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without links
        shutil.copy2(source, target)


def _results(folder: Path) -> set[Path]:
    """What a command wrote into a folder and into those of its runs, which count where nothing else is."""
    told = _markers(folder)
    models = told.get("compare.json", {}).get("models")
    runs = {*(models if isinstance(models, dict) else ()), *["demo-track"] * ("demo.json" in told)}
    found = {folder / name for marker in told for name in (marker, *MARKERS[marker][1])}
    for run in (each for each in folder.iterdir() if each.name in runs and each.is_dir()):
        found |= _results(run)
        found |= {run} if found.issuperset(run.iterdir()) else set()
    return found


def _real(path: Path) -> Path:
    return Path(os.path.realpath(path))
