"""Compiled functions, kept from run to run where there is a place for them, and the parts that these call.

What is kept of a function holds its parts. These are not kept apart, as numba's index of what is kept names
the types of arguments: one that is renamed later, as a named tuple of records, would stop the next version.

To assign an array to a slice, or to sum up an expression of whole arrays, takes numba a second or more to
compile; a loop that does the same takes next to nothing.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])

unkept: list[str] = []  # functions that are compiled for this process alone


def part(**options: Any) -> Callable[[Function], Function]:
    """Return `numba.njit` with these options, for what compiled functions call."""
    decorate: Callable[[Function], Function] = numba.njit(**options)
    return decorate


def compiled(**options: Any) -> Callable[[Function], Function]:
    """Return `numba.njit` with these options, its results kept beside the package or in the user's cache.

    Where neither can be written the function is compiled for this process alone.
    """

    def decorated(function: Function) -> Function:
        try:
            return part(cache=True, **options)(function)
        except RuntimeError:  # numba finds no folder to keep it in
            unkept.append(function.__name__)
            return part(**options)(function)

    return decorated
