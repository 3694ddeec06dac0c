"""One experiment's part of the results file, and the page of all: one file, readable on a phone."""

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
INKS = ("#000000", "#111111")  # colours that the page replaces by its own, light or dark


class Verdict(StrEnum):
    """Whether a claim of the papers holds on these captures."""

    HOLDS = "holds"
    PARTLY = "holds in part"
    FAILS = "does not hold"
    OPEN = "not tested"


@dataclass(frozen=True)
class Claim:
    """A claim of the papers, whether it holds here, and the numbers that show it."""

    paper: str
    verdict: Verdict
    here: str


@dataclass(frozen=True)
class Table:
    """Cells as text; the first column names the row."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Plot:
    """A picture: the function that draws it into a file, alternative text, and caption."""

    draw: Callable[[IO[bytes]], None]
    alt: str
    caption: str

    @property
    def svg(self) -> Markup:
        """An SVG element in the page's colours."""
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
    """An experiment's name in the results file, its title, and the papers' figures."""

    key: str
    title: str
    source: str


@dataclass(frozen=True)
class Section:
    """One experiment; `method` describes it in a few sentences."""

    heading: Heading
    method: str
    claims: Sequence[Claim]
    tables: Sequence[Table] = ()
    plots: Sequence[Plot] = ()


def left_out(heading: Heading, why: str) -> Section:
    """The section of an experiment that these captures do not allow."""
    return Section(heading, "", [Claim(f"{heading.source} of the papers", Verdict.OPEN, f"Left out: {why}.")])


def spread(values: Collection[float], digits: int = 1, pooled: float | None = None) -> str:
    """The mean of values, or a `pooled` figure, with the range if there are several: 2.3 (1.9 to 2.8)."""
    if not values:
        return "-"
    middle = f"{np.mean(list(values)) if pooled is None else pooled:.{digits}f}"
    ends = f" ({min(values):.{digits}f} to {max(values):.{digits}f})"
    return middle + ends if len(values) > 1 else middle


def verdict(holds: bool, partly: bool = False) -> Verdict:
    """HOLDS if a claim holds, else PARTLY if it holds in part, else FAILS."""
    return Verdict.HOLDS if holds else Verdict.PARTLY if partly else Verdict.FAILS


def share_verdict(cases: Sequence[bool]) -> Verdict:
    """The verdict on a claim about all cases: it holds in part if at least half of them hold."""
    return verdict(all(cases), 2 * sum(cases) >= len(cases))


def as_sequence(name: str, y: Array, first: int = 0) -> PoseSequence:
    """Poses (T, 8), from frame `first` on, as a sequence for the pictures of the motion commands."""
    return PoseSequence(name, first, y, ("",) * len(y), (), 0, None)


def write_findings(sections: Sequence[Section], about: str, notes: Sequence[str], path: Path) -> None:
    """Write the page: a sentence about the captures, a summary, cautions, then a part for each experiment."""
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
