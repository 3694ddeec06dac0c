"""One spoiled input: what is asked for, what is wrong with it, and words of the line that must say so."""

from collections.abc import Callable
from dataclasses import dataclass

HUGE = "9" * 30


@dataclass(frozen=True)
class Case:
    """One command on one spoiled input.

    name    : of the case, unlike all others
    command : a key of `stock.COMMANDS`, or words
    spoil   : does it to the folder
    says    : in the one line that must come
    more    : further words
    exit    : status; 0 where the work can be done and a warning says what is wrong
    """

    name: str
    command: str
    spoil: Callable
    says: str
    more: str = ""
    exit: int = 1
