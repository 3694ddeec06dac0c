"""One spoiled input: what is asked for, what is wrong with it, and words of the line that must say so."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.spoiled.spoil import nothing

HUGE = "9" * 30


@dataclass(frozen=True)
class Case:
    """One command on one spoiled input.

    name    : of the case, unlike all others
    command : a key of `stock.COMMANDS`, or words
    says    : in the one line that must come
    spoil   : does it to a path
    file    : which, in the folder; the folder itself if empty
    exit    : status; 0 where the work can be done and a warning says what is wrong
    """

    name: str
    command: str
    says: str
    spoil: Callable[[Path], object] = nothing
    file: str = ""
    exit: int = 1


def cases(command, file, *rows):
    """A case for each row (what is wrong, what spoils the file, what is said)."""
    return [Case(f"{command}: {file} {wrong}", command, says, spoil, file) for wrong, spoil, says in rows]


def refusals(*rows, exit=1):
    """A case for each row (what is wrong, command, what is said) of commands that are wrong themselves."""
    return [Case(wrong, command, says, exit=exit) for wrong, command, says in rows]
