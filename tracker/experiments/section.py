"""One experiment as the file of numbers has it, and the page of all: one file, readable on a phone."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from tracker.report.document import STYLES, Document, write_page
from tracker.report.html_tables import html_table

TITLE = "The papers' experiments on these captures"
PAGE = Document("experiments/findings.html", (*STYLES, "experiments/findings.css"))


class Verdict(StrEnum):
    """Whether what the papers say is so here."""

    HOLDS = "holds"
    PARTLY = "holds in part"
    FAILS = "does not hold"
    OPEN = "not tested"


MARKS = {Verdict.HOLDS: "yes", Verdict.PARTLY: "partly", Verdict.FAILS: "no", Verdict.OPEN: "open"}


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


def write_findings(sections: Sequence[Section], about: str, notes: Sequence[str], path: Path) -> None:
    """The page: a sentence about the captures, what was found in short, cautions, then a part for each
    experiment."""
    parts = {
        "title": [html.escape(TITLE)],
        "about": [html.escape(about)],
        "summary": [_summary(sections)],
        "notes": [f"<p class='note'>{html.escape(note)}</p>" for note in notes],
        "sections": map(_section, sections),
    }
    write_page(path, PAGE, {}, parts)


def _summary(sections: Sequence[Section]) -> str:
    rows = [
        (f"<a href='#{s.heading.key}'>{html.escape(s.heading.title)}</a>", html.escape(c.paper), _badge(c))
        for s in sections
        for c in s.claims
    ]
    return html_table(("experiment", "the papers", "here"), rows)


def _section(section: Section) -> str:
    heading = section.heading
    method = f"<p>{html.escape(section.method)}</p>" if section.method else ""
    parts = [_claim(claim) for claim in section.claims]
    parts += [_figure(_table(table), table.caption) for table in section.tables]
    for plot in section.plots:
        picture = f"<div class='wide plot' role='img' aria-label='{html.escape(plot.alt)}'>{plot.svg}</div>"
        parts.append(_figure(picture, plot.caption))
    return (
        f"<section id='{heading.key}'><h2>{html.escape(heading.title)}</h2>"
        f"<p class='soft'>{html.escape(heading.source)}</p>{method}{''.join(parts)}</section>"
    )


def _claim(claim: Claim) -> str:
    return (
        f"<div class='claim {MARKS[claim.verdict]}'><p><b>Papers:</b> {html.escape(claim.paper)}</p>"
        f"<p>{_badge(claim)}: {html.escape(claim.here)}</p></div>"
    )


def _badge(claim: Claim) -> str:
    return f"<b>{claim.verdict.value}</b>"


def _figure(body: str, caption: str) -> str:
    return f"<figure>{body}<figcaption>{html.escape(caption)}</figcaption></figure>"


def _table(table: Table) -> str:
    return html_table(table.head, [[html.escape(cell) for cell in row] for row in table.rows])
