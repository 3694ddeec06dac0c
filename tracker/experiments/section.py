"""One experiment as the file of numbers has it, and the page of all: one file, readable on a phone."""

import io
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import IO, Any

import matplotlib
import numpy as np
from markupsafe import Markup

from dynamics.gaussian import Array
from tracker.report.document import STYLES, Document, write_page
from tracker.report.html_tables import html_table
from tracker.tables.poses import PoseSequence

TITLE = "The papers' experiments on these captures"
PAGE = Document("experiments/findings.html", (*STYLES, "experiments/findings.css"))
SVG: Any = {
    "savefig.format": "svg",
    "savefig.transparent": True,
    "svg.fonttype": "none",
    "svg.hashsalt": "figtrack",
}
INKS = ("#000000", "#111111")  # of which the page has its own, be it light or dark


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
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Plot:
    """A picture: what draws it into a file, what it shows for who cannot see it, and what stands below it."""

    draw: Callable[[IO[bytes]], None]
    alt: str
    caption: str

    @property
    def svg(self) -> Markup:
        """An SVG element whose ink is the page's own."""
        out = io.BytesIO()
        with matplotlib.rc_context(SVG):
            self.draw(out)
        # Its metadata holds the time at which it was drawn.
        text = re.sub("<metadata>.*?</metadata>", "", out.getvalue().decode("utf-8"), flags=re.DOTALL)
        for ink in INKS:
            text = text.replace(ink, "currentColor")
        return Markup(text[text.index("<svg") :])


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
    claims: Sequence[Claim]
    tables: Sequence[Table] = ()
    plots: Sequence[Plot] = ()


def left_out(heading: Heading, why: str) -> Section:
    """An experiment that these captures do not allow."""
    return Section(heading, "", [Claim(f"{heading.source} of the papers", Verdict.OPEN, f"Left out: {why}.")])


def spread(values: Collection[float], digits: int = 1, pooled: float | None = None) -> str:
    """Their mean, or a `pooled` figure, and, if there are several, the least and the greatest: 2.3 (1.9 to
    2.8)."""
    if not values:
        return "-"
    middle = f"{np.mean(list(values)) if pooled is None else pooled:.{digits}f}"
    ends = f" ({min(values):.{digits}f} to {max(values):.{digits}f})"
    return middle + ends if len(values) > 1 else middle


def verdict(holds: bool, partly: bool = False) -> Verdict:
    """HOLDS where a claim holds, else PARTLY where it does in part, else FAILS."""
    return Verdict.HOLDS if holds else Verdict.PARTLY if partly else Verdict.FAILS


def share_verdict(cases: Sequence[bool]) -> Verdict:
    """The verdict on a claim made of every case: it holds in part from half of them."""
    return verdict(all(cases), 2 * sum(cases) >= len(cases))


def as_sequence(name: str, y: Array, first: int = 0) -> PoseSequence:
    """Poses (T, 8), from frame `first` on, as motion pictures take them."""
    return PoseSequence(name, first, y, ("",) * len(y), (), None)


def write_findings(sections: Sequence[Section], about: str, notes: Sequence[str], path: Path) -> None:
    """The page: a sentence about the captures, what was found in short, cautions, then a part for each
    experiment."""
    link, badge = Markup("<a href='#{}'>{}</a>"), Markup("<b>{}</b>")
    rows = [
        (link.format(s.heading.key, s.heading.title), c.paper, badge.format(c.verdict.value))
        for s in sections
        for c in s.claims
    ]
    write_page(
        path,
        PAGE,
        {},
        title=TITLE,
        about=about,
        summary=html_table(("experiment", "the papers", "here"), rows),
        notes=notes,
        sections=sections,
        html_table=html_table,
    )
