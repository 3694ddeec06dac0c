"""Folders of results: written under a temporary name and renamed when complete, never half-written."""

import json
import os
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from stat import S_IMODE

try:
    import fcntl
except ImportError:  # Windows: there nothing is swept
    fcntl = None  # type: ignore[assignment]

# The file that a complete run leaves last, and a key in it that says it is ours.
MARKERS = {
    "run.json": "figtrack",
    "compare.json": "models",
    "demo.json": "figtrack",
    "reproduce.json": "figtrack",
}
PART, DRAWN = ".part", 8  # how folders aside end, and how many random letters are before that
LOCK = "lock"  # in a folder aside, held by the process that works there; the system frees it when that dies


class FolderError(Exception):
    """A folder or file that results cannot be written to."""


def holds_run(path: Path) -> bool:
    """Whether a command of figtrack left its results in this folder."""
    for name, key in MARKERS.items():
        # Another program's run.json may be missing, binary or no object.
        with suppress(OSError, ValueError):
            if (path / name).is_file():
                news = json.loads((path / name).read_text(encoding="utf-8"))
                if isinstance(news, dict) and key in news:
                    return True
    return False


@contextmanager
def fresh_folder(
    path: Path,
    *,
    overwrite: bool,
    inputs: Iterable[Path | None] = (),
    replaceable: Callable[[Path], bool] = holds_run,
) -> Iterator[Path]:
    """A new folder to write into, which becomes `path` when the block ends well or vanishes if it does not.

    Args:
        path: the final place; a link is followed.
        overwrite: whether a complete run may be replaced. Anything else is never replaced.
        inputs: files that the work reads, None for none, which must not lie in the folder that is replaced.
        replaceable: tells a complete run.

    Raises:
        FolderError: a file in its place, a folder that cannot be written, a complete run without `overwrite`,
            a folder that holds something else or one of the inputs.
    """
    place = _real(path)
    _sweep(place)
    check_folder(path, overwrite, replaceable)
    check_inputs(path, inputs)
    with _workshop(place) as workshop:
        new = workshop / "new"
        yield new
        check_folder(path, overwrite, replaceable)  # another run may have been quicker
        _exchange(new, place, workshop / "old")


@contextmanager
def fresh_file(path: Path, *, overwrite: bool, inputs: Iterable[Path | None] = ()) -> Iterator[Path]:
    """A name to write to, which becomes `path`, or where that links, when the block ends well or vanishes if
    it does not.

    Who may read and write it stays as it was. Not one of the inputs, files that the work reads or None, is
    replaced. FolderError: a folder, a device or an input in its place, a folder that cannot be written, or a
    file without `overwrite`.
    """
    place = _real(path)
    _sweep(place)
    if place.exists() and place in [_real(each) for each in inputs if each is not None]:
        raise FolderError(f"{path} is what the work reads; choose another --out")
    check_file(path, overwrite)
    with _workshop(place) as workshop:
        new = workshop / "new" / place.name
        yield new
        check_file(path, overwrite)
        if place.exists():
            new.chmod(S_IMODE(place.stat().st_mode))
        new.replace(place)


@contextmanager
def swept(paths: Iterable[Path]) -> Iterator[None]:
    """Other processes make `paths` in this block; what those that are killed leave beside is gone after it.

    A complete run that was just being replaced comes back.
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
    """FolderError where one of the inputs, or the folder one is in, would be replaced with a folder."""
    for kept, what in [
        (Path.cwd(), "the folder you are in"),
        *((each, str(each)) for each in inputs if each is not None),
    ]:
        if _real(kept).is_relative_to(_real(path)):
            raise FolderError(f"{path} would be replaced, and with it {what}; keep the two apart")


def check_folder(path: Path, overwrite: bool, replaceable: Callable[[Path], bool]) -> None:
    """FolderError where a folder of results cannot be put, as `fresh_folder` has it."""
    if not path.exists():
        return
    if not path.is_dir():
        raise FolderError(f"{path} is a file; --out wants a folder, choose another name")
    if os.path.ismount(path):  # Path.is_mount takes every "." for one
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


def check_file(path: Path, overwrite: bool) -> None:
    """FolderError where a file cannot be put, as `fresh_file` has it."""
    if path.is_dir():
        raise FolderError(f"{path} is a folder; --out wants a file, choose another name")
    if path.exists() and not path.is_file():
        raise FolderError(f"{path} is no ordinary file and cannot be replaced; choose another --out")
    if path.exists() and not overwrite:
        raise FolderError(f"{path} exists; choose another --out, or replace it with --overwrite")


@contextmanager
def _workshop(place: Path) -> Iterator[Path]:
    """A hidden folder beside `place` with another in it, "new"; gone afterwards.

    So are the parents made for it that hold nothing.
    """
    made = [parent for parent in place.parents if not parent.exists()]
    workshop = place.parent / f".{place.name}.{secrets.token_hex(DRAWN // 2)}{PART}"
    lock = None
    try:  # before it is made, or Ctrl-C at that very moment would leave it
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
        except KeyboardInterrupt:  # what comes within seconds of it does not disturb this
            _removed(workshop, made)
            raise
        finally:
            if lock is not None:
                os.close(lock)


def _removed(workshop: Path, made: list[Path]) -> None:
    """Remove the folder, and of the parents made for it those that hold nothing."""
    shutil.rmtree(workshop, ignore_errors=True)
    for parent in made:
        with suppress(OSError):
            parent.rmdir()


def _locked(workshop: Path) -> int | None:
    """Make the folder, and hold its lock until what is returned is closed; None where there are no locks."""
    while True:
        workshop.mkdir(0o700, exist_ok=True)
        if fcntl is None:
            return None
        with suppress(FileNotFoundError):  # taken for one that is left over, before it was locked
            lock = os.open(workshop / LOCK, os.O_RDWR | os.O_CREAT, 0o600)
            with suppress(OSError):  # a disk without locks, on which nothing is swept
                fcntl.flock(lock, fcntl.LOCK_EX)
            if (workshop / LOCK).exists():
                return lock
            os.close(lock)


def _sweep(place: Path) -> None:
    """Remove what processes that were killed have left beside `place`; what they put aside comes back."""
    if fcntl is None:
        return
    for workshop in place.parent.glob(f".{escape(place.name)}.{'?' * DRAWN}{PART}"):
        with suppress(OSError):
            lock = os.open(workshop / LOCK, os.O_RDWR | os.O_CREAT, 0o600)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # fails where the process lives
                if (workshop / "old").exists() and not place.exists():
                    (workshop / "old").rename(place)
                shutil.rmtree(workshop, ignore_errors=True)
            finally:
                os.close(lock)


def _exchange(new: Path, place: Path, old: Path) -> None:
    try:
        if place.exists():
            new.chmod(S_IMODE(place.stat().st_mode))
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


def _real(path: Path) -> Path:
    return Path(os.path.realpath(path))
