"""The page of the papers' experiments: one file, readable on a phone, light or dark."""

import html
from collections.abc import Sequence
from pathlib import Path

from tracker.experiments.section import Claim, Section, Table, Verdict
from tracker.report.document import STYLES, Document, write_page
from tracker.report.html_tables import html_table

TITLE = "The papers' experiments on these captures"
PAGE = Document("experiments/findings.html", (*STYLES, "experiments/findings.css"))
MARKS = {Verdict.HOLDS: "yes", Verdict.PARTLY: "partly", Verdict.FAILS: "no", Verdict.OPEN: "open"}


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
