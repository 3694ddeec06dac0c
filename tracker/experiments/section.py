"""One experiment as the page and the file of numbers show it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np


class Verdict(StrEnum):
    """Whether what the papers say is so here."""

    HOLDS = "holds"
    PARTLY = "holds in part"
    FAILS = "does not hold"
    OPEN = "not tested"


@dataclass(frozen=True)
class Claim:
    """What the papers say, whether it is so here, and the numbers that say it."""

    paper: str
    verdict: Verdict
    here: str


@dataclass(frozen=True)
class Table:
    """Cells in words; the first column names the row."""

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Plot:
    """A picture: SVG text, what it shows for who cannot see it, and what is said below it."""

    svg: str
    alt: str
    caption: str


@dataclass(frozen=True)
class Heading:
    """An experiment's name among the numbers, its title and the papers' figures."""

    key: str
    title: str
    source: str


@dataclass(frozen=True)
class Section:
    """One experiment; `method` says in a few sentences what was done."""

    heading: Heading
    method: str
    claims: tuple[Claim, ...]
    tables: tuple[Table, ...] = ()
    plots: tuple[Plot, ...] = ()


def left_out(heading: Heading, why: str) -> Section:
    """An experiment that these captures do not allow."""
    claim = Claim(f"{heading.source} of the papers", Verdict.OPEN, f"Left out: {why}.")
    return Section(heading, "", (claim,))


def spread(values: Sequence[float], digits: int = 1) -> str:
    """Their mean and, if there are several, the least and the greatest: 2.3 (1.9 to 2.8)."""
    return pooled_and_range(float(np.mean(values)), dict(enumerate(values)), digits) if len(values) else "-"


def pooled_and_range(pooled: float, each: Mapping[Any, float], digits: int = 1) -> str:
    """A figure of all and, if there are several, the least and the greatest of each by itself."""
    if len(each) < 2:
        return f"{pooled:.{digits}f}"
    return f"{pooled:.{digits}f} ({min(each.values()):.{digits}f} to {max(each.values()):.{digits}f})"


def verdict(holds: bool, partly: bool = False) -> Verdict:
    """The best that is so."""
    return Verdict.HOLDS if holds else Verdict.PARTLY if partly else Verdict.FAILS


def share_verdict(cases: Sequence[bool]) -> Verdict:
    """Of a claim made of every case: it holds in part from half of them."""
    return verdict(all(cases), 2 * sum(cases) >= len(cases))
