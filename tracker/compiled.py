"""Compiled functions, kept from run to run where there is a place for them."""

from collections.abc import Callable
from typing import Any, TypeVar

import numba

from tracker.progress import Progress

Function = TypeVar("Function", bound=Callable[..., Any])

_told: list[bool] = []  # whether it is said that nothing is kept; empty while all is kept


def compiled(**options: Any) -> Callable[[Function], Function]:
    """Return `numba.njit` with these options, its results kept beside the package or in the user's cache.

    Where neither can be written the function is compiled for this process alone.
    """

    def decorated(function: Function) -> Function:
        try:
            kept: Function = numba.njit(cache=True, **options)(function)
        except RuntimeError:  # numba finds no folder to keep it in
            _told[:] = _told or [False]
            kept = numba.njit(**options)(function)
        return kept

    return decorated


def tell_unkept(progress: Progress) -> None:
    """Note once a process that what is compiled is not kept, where it is not."""
    if _told == [False]:
        _told[:] = [True]
        progress.note(
            "neither figtrack's own folder nor the user's cache can be written: the tracker is compiled "
            "anew; NUMBA_CACHE_DIR names a folder that keeps it"
        )
