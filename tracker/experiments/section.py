"""One experiment as the page and the file of numbers show it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

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
class Section:
    """One experiment.

    key     : its name among the numbers
    title   : heading
    source  : the papers' figures
    method  : what was done, in a few sentences
    numbers : what was measured, for programs; JSON kinds only
    """

    key: str
    title: str
    source: str
    method: str
    claims: tuple[Claim, ...]
    tables: tuple[Table, ...] = ()
    plots: tuple[Plot, ...] = ()
    numbers: dict[str, object] = field(default_factory=dict)


def left_out(key: str, title: str, source: str, why: str) -> Section:
    """An experiment that these captures do not allow."""
    claim = Claim(f"{source} of the papers", Verdict.OPEN, f"Left out: {why}.")
    return Section(key, title, source, "", (claim,), numbers={"left_out": why})


def spread(values: Sequence[float], digits: int = 1) -> str:
    """Their mean and, if there are several, the least and the greatest: 2.3 (1.9 to 2.8)."""
    if not len(values):
        return "-"
    mean = f"{np.mean(values):.{digits}f}"
    if len(values) < 2:
        return mean
    return f"{mean} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def share_verdict(share: float) -> Verdict:
    """Of a claim made of every case, by the share of cases in which it is so."""
    if share >= 1.0:
        return Verdict.HOLDS
    return Verdict.PARTLY if share >= 0.5 else Verdict.FAILS
