"""A run's folder: made aside, renamed when complete, so that nothing half-written bears the final name."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MARKERS = ("run.json", "compare.json", "demo.json")  # the last file that a complete run leaves


class FolderError(Exception):
    """An output folder that cannot be written."""


@contextmanager
def fresh_folder(path: Path, *, overwrite: bool) -> Iterator[Path]:
    """A new folder to write into, which becomes `path` when the block ends well or vanishes if it does not.

    Raises:
        FolderError: a file in its place, a folder that cannot be written, a complete run without `overwrite`,
            or a folder that holds something else.
    """
    _check(path, overwrite)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        aside = Path(tempfile.mkdtemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent))
    except OSError as error:
        raise FolderError(
            f"cannot write into {path.parent}: {error.strerror}; choose another --out"
        ) from error
    try:
        aside.chmod(0o755)
        yield aside
        _check(path, overwrite)
        _exchange(aside, path)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _check(path: Path, overwrite: bool) -> None:
    if path.exists() and not path.is_dir():
        raise FolderError(f"{path} is a file; --out wants a folder, choose another name")
    if not path.exists() or not any(path.iterdir()):
        return
    if not any((path / marker).is_file() for marker in MARKERS):
        raise FolderError(f"{path} holds files that are no run of figtrack; choose another --out")
    if not overwrite:
        raise FolderError(
            f"{path} holds a complete run; choose another --out, or replace it with --overwrite"
        )


def _exchange(new: Path, path: Path) -> None:
    if not path.exists():
        new.rename(path)
        return
    old = Path(tempfile.mkdtemp(prefix=f".{path.name}.", suffix=".old", dir=path.parent))
    path.rename(old / path.name)
    new.rename(path)
    shutil.rmtree(old, ignore_errors=True)
