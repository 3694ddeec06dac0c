"""Compiled functions, cached on disk between runs where possible, and the inner functions that they call.

The cached code of a function includes the functions it calls. These have no cache of their own: numba's cache
index names the types of arguments, and one that is renamed later, such as a named tuple, would stop the next
version.

Assigning an array to a slice, or summing an expression of whole arrays, takes numba a second or more to
compile; an equivalent loop takes next to nothing.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])

unkept: list[str] = []  # functions that are compiled for this process only


def part(**options: Any) -> Callable[[Function], Function]:
    """Return `numba.njit` with these options, uncached, for functions that compiled ones call."""
    decorate: Callable[[Function], Function] = numba.njit(**options)
    return decorate


def compiled(**options: Any) -> Callable[[Function], Function]:
    """Return `numba.njit` with these options, its results cached beside the package or in the user's cache.

    Where neither can be written, the function is compiled for this process only.
    """

    def decorated(function: Function) -> Function:
        try:
            return part(cache=True, **options)(function)
        except RuntimeError:  # numba finds no folder for its cache
            unkept.append(function.__name__)
            return part(**options)(function)

    return decorated
