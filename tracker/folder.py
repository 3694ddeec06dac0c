"""Where results go: made aside, renamed when complete, so that nothing half-written bears the final name."""

import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

# The file that a complete run leaves last, and a key in it that says it is ours.
MARKERS = {
    "run.json": "figtrack",
    "compare.json": "models",
    "demo.json": "figtrack",
    "reproduce.json": "figtrack",
}


class FolderError(Exception):
    """A folder or file that results cannot be written to."""


@contextmanager
def fresh_folder(path: Path, *, overwrite: bool, inputs: Iterable[Path] = ()) -> Iterator[Path]:
    """A new folder to write into, which becomes `path` when the block ends well or vanishes if it does not.

    Args:
        path: the final place; a link is followed.
        overwrite: whether a complete run may be replaced. Anything else is never replaced.
        inputs: files that the work reads, which must not lie in the folder that is replaced.

    Raises:
        FolderError: a file in its place, a folder that cannot be written, a complete run without `overwrite`,
            a folder that holds something else or one of the inputs.
    """
    _check_folder(path, overwrite)
    place = _real(path)
    for kept, what in [(Path.cwd(), "the folder you are in"), *((Path(i), str(i)) for i in inputs)]:
        if _real(kept).is_relative_to(place):
            raise FolderError(f"{path} would be replaced, and with it {what}; choose another --out")
    with _workshop(place) as workshop:
        new = workshop / "new"
        new.mkdir()
        yield new
        _check_folder(path, overwrite)  # another run may have been quicker
        _exchange(new, place, workshop / "old")


@contextmanager
def fresh_file(path: Path, *, overwrite: bool) -> Iterator[Path]:
    """A name to write to, which becomes `path` when the block ends well or vanishes if it does not.

    Raises:
        FolderError: a folder in its place, a folder that cannot be written, or a file without `overwrite`.
    """
    _check_file(path, overwrite)
    place = _real(path)
    with _workshop(place) as workshop:
        new = workshop / place.name
        yield new
        _check_file(path, overwrite)
        new.replace(place)


def _check_folder(path: Path, overwrite: bool) -> None:
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
    if not _holds_run(path):
        raise FolderError(f"{path} holds files that are no run of figtrack; choose another --out")
    if not overwrite:
        raise FolderError(
            f"{path} holds a complete run; choose another --out, or replace it with --overwrite"
        )


def _check_file(path: Path, overwrite: bool) -> None:
    if path.is_dir():
        raise FolderError(f"{path} is a folder; --out wants a file, choose another name")
    if path.exists() and not overwrite:
        raise FolderError(f"{path} exists; choose another --out, or replace it with --overwrite")


def _holds_run(path: Path) -> bool:
    for name, key in MARKERS.items():
        # Another program's run.json may be missing, binary or no object.
        with suppress(OSError, ValueError):
            news = json.loads((path / name).read_text(encoding="utf-8"))
            if isinstance(news, dict) and key in news:
                return True
    return False


@contextmanager
def _workshop(place: Path) -> Iterator[Path]:
    """A hidden folder beside `place`, gone afterwards; so are the parents made for it that hold nothing."""
    made = [parent for parent in place.parents if not parent.exists()]
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        workshop = Path(tempfile.mkdtemp(prefix=f".{place.name}.", suffix=".part", dir=place.parent))
    except OSError as error:
        raise FolderError(
            f"cannot write into {place.parent} ({error.strerror}); choose another --out"
        ) from error
    try:
        yield workshop
    finally:
        shutil.rmtree(workshop, ignore_errors=True)
        for parent in made:
            with suppress(OSError):
                parent.rmdir()


def _exchange(new: Path, place: Path, old: Path) -> None:
    try:
        if place.exists():
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
