"""The page of the papers' experiments: one file, readable on a phone, light or dark."""

import html
from collections.abc import Sequence
from pathlib import Path

from tracker.experiments.section import Claim, Plot, Section, Table, Verdict

MARKS = {Verdict.HOLDS: "yes", Verdict.PARTLY: "partly", Verdict.FAILS: "no", Verdict.OPEN: "open"}


def write_page(sections: Sequence[Section], about: str, notes: Sequence[str], path: Path) -> None:
    """The page: what was found in short, then a part for each experiment.

    Args:
        about: one sentence on the captures.
        notes: cautions.
    """
    page = _PAGE.format(
        about=html.escape(about),
        summary=_summary(sections),
        notes="".join(f"<li>{html.escape(note)}</li>" for note in notes),
        sections="".join(_section(section) for section in sections),
    )
    path.write_text(page, encoding="utf-8")


def _summary(sections: Sequence[Section]) -> str:
    rows = "".join(
        f"<tr><td><a href='#{s.heading.key}'>{html.escape(s.heading.title)}</a></td>"
        f"<td>{html.escape(c.paper)}</td><td>{_badge(c.verdict)}</td></tr>"
        for s in sections
        for c in s.claims
    )
    head = "<tr><th>experiment</th><th>the papers</th><th>here</th></tr>"
    return (
        f"<div class='wide'><table class='summary'><thead>{head}</thead><tbody>{rows}</tbody></table></div>"
    )


def _section(section: Section) -> str:
    heading = section.heading
    method = f"<p>{html.escape(section.method)}</p>" if section.method else ""
    parts = [_claim(claim) for claim in section.claims]
    parts += [_figure(_table(table), table.caption) for table in section.tables]
    parts += [_figure(_plot(plot), plot.caption) for plot in section.plots]
    return (
        f"<section id='{heading.key}'><h2>{html.escape(heading.title)}</h2>"
        f"<p class='source'>{html.escape(heading.source)}</p>{method}{''.join(parts)}</section>"
    )


def _claim(claim: Claim) -> str:
    return (
        f"<div class='claim {MARKS[claim.verdict]}'><p><strong>Papers:</strong> "
        f"{html.escape(claim.paper)}</p><p>{_badge(claim.verdict)} {html.escape(claim.here)}</p></div>"
    )


def _badge(verdict: Verdict) -> str:
    return f"<span class='badge {MARKS[verdict]}'>{verdict.value}</span>"


def _figure(body: str, caption: str) -> str:
    return f"<figure>{body}<figcaption>{html.escape(caption)}</figcaption></figure>"


def _table(table: Table) -> str:
    def line(cells: Sequence[str], kind: str) -> str:
        return "<tr>" + "".join(f"<{kind}>{html.escape(cell)}</{kind}>" for cell in cells) + "</tr>"

    body = "".join(line(row, "td") for row in table.rows)
    head = line(table.head, "th")
    return f"<div class='wide'><table><thead>{head}</thead><tbody>{body}</tbody></table></div>"


def _plot(plot: Plot) -> str:
    return f"<div class='wide plot' role='img' aria-label='{html.escape(plot.alt)}'>{plot.svg}</div>"


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>The papers' experiments on these captures</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 0 auto; padding: 1rem; }}
h2 {{ margin: 2.5rem 0 0; }} .source {{ margin: 0 0 .5rem; opacity: .75; }}
.wide {{ overflow-x: auto; }} figure {{ margin: 1.2rem 0; }}
figcaption {{ font-size: .875rem; opacity: .85; }}
table {{ border-collapse: collapse; font-size: .9375rem; }}
th, td {{ text-align: left; vertical-align: top; padding: .3rem .9rem .3rem 0; }}
th, td {{ border-bottom: 1px solid #8884; }}
figure td {{ white-space: nowrap; font-variant-numeric: tabular-nums; }}
.summary td:last-child {{ white-space: nowrap; }}
.plot svg {{ width: 100%; min-width: 38rem; height: auto; }} .plot text {{ fill: currentColor; }}
.claim {{ border-left: 4px solid #888; padding: .1rem 0 .1rem .8rem; margin: .8rem 0; }}
.claim p {{ margin: .2rem 0; }}
.claim.yes {{ border-color: #009e73; }} .claim.partly {{ border-color: #d09a00; }}
.claim.no {{ border-color: #c1272d; }}
.badge {{ border-radius: 3px; padding: 0 .45em; font-size: .875rem; font-weight: 600; white-space: nowrap;
  color: #fff; background: #666; }}
.badge.yes {{ background: #007a59; }} .badge.partly {{ background: #8a6400; }}
.badge.no {{ background: #b02025; }}
</style></head><body>
<h1>The papers' experiments on these captures</h1>
<p>{about}</p>
<p>The papers: Pavlović, Rehg, Cham, Murphy, <cite>A dynamic Bayesian network approach to figure tracking
using learned dynamic models</cite>, ICCV 1999; Pavlović, Rehg, MacCormick, <cite>Learning switching linear
models of human motion</cite>, NIPS 2000. Theirs were other captures: what they report is compared with what
the same experiments give here.</p>
{summary}
<ul>{notes}</ul>
{sections}
</body></html>
"""
