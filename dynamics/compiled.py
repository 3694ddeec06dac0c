"""Compiled functions, kept from run to run where there is a place for them."""

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])

unkept: list[str] = []  # functions that are compiled for this process alone


def compiled(**options: Any) -> Callable[[Function], Function]:
    """Return `numba.njit` with these options, its results kept beside the package or in the user's cache.

    Where neither can be written the function is compiled for this process alone.
    """

    def decorated(function: Function) -> Function:
        try:
            kept: Function = numba.njit(cache=True, **options)(function)
        except RuntimeError:  # numba finds no folder to keep it in
            unkept.append(function.__name__)
            kept = numba.njit(**options)(function)
        return kept

    return decorated
