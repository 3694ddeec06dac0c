"""A note if compiled functions cannot be cached."""

from dynamics.compiled import compiled, part, unkept
from tracker.progress import Progress

__all__ = ["compiled", "part", "tell_unkept"]

_told: list[bool] = []


def tell_unkept(progress: Progress) -> None:
    """Print a note, once a process, if compiled functions cannot be cached."""
    if unkept and not _told:
        _told.append(True)
        progress.note(
            "neither figtrack's own folder nor the user's cache can be written: the tracker is compiled "
            "anew; NUMBA_CACHE_DIR names a folder that keeps it"
        )
