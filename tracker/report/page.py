"""report.html, one document with its numbers, pictures and, unless it is large, its film."""

import base64
import html
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

from tracker.report.chapter import Chapter, headline, unusual
from tracker.report.document import STYLES, Document, write_page
from tracker.report.html_tables import comparison_table, gait_table
from tracker.run.score import LOST_ERROR, Score, error_curve
from videos.playable import Playable

SCRIPTS = ("plots", "saving", "player", "figure", "page")
PAGE = Document("report/page.html", STYLES, tuple(f"report/{name}.js" for name in SCRIPTS))
LARGEST = 60_000_000  # bytes of a film that is written into a page; a larger one is linked
BLOCK = 3 * 2**18  # bytes turned to base64 at a time: whole groups of three


def linked(film: Playable) -> bool:
    """Whether pages link to a film, which then has to stay where it is."""
    return film.path.stat().st_size > LARGEST


def write_report(path: Path, chapter: Chapter, film: Playable) -> None:
    """The page of one run."""
    _write(path, chapter.video, film, [chapter], chapter.warnings)


def write_comparison(
    path: Path,
    video: str,
    film: Playable,
    chapters: Sequence[Chapter],
    scores: Mapping[str, Score],
    failure: Path,
    notes: Sequence[str] = (),
) -> None:
    """The page of several runs of one clip beside the marks, all from the same frame on, by the scores of
    every chapter by name.

    `failure` is the sheet of frames where the tracks part; notes are said above everything else.
    """
    warnings = [f"{chapter.name}: {text}" for chapter in chapters for text in chapter.warnings]
    first = chapters[0].track.first
    errors = [
        {
            "name": name,
            "lost": score.first_failure_frame,
            "points": [[int(t) - first, round(e, 4)] for t, e in zip(*error_curve(score), strict=True)],
        }
        for name, score in scores.items()
    ]
    sheet = [_SHEET, "data:image/png;base64,", *_base64(failure), "'></div></section>"]
    table = _ERRORS.format(limit=LOST_ERROR, joints=_told(chapters[0]), table=comparison_table(scores))
    _write(path, video, film, chapters, warnings, notes, table, sheet, {"models": errors, "lost": LOST_ERROR})


def _write(
    path: Path,
    video: str,
    film: Playable,
    chapters: Sequence[Chapter],
    warnings: Sequence[str],
    notes: Sequence[str] = (),
    table: str = "",
    sheet: Iterable[str] = (),
    errors: Mapping[str, object] | None = None,
) -> None:
    shown = {"link": _link(film, path), "start": round(film.start, 6), "size": film.size}
    data = {"chapters": [chapter.drawn() for chapter in chapters], "errors": errors, "film": shown}
    parts: dict[str, Iterable[str]] = {
        "title": [html.escape(video)],
        "kind": ["several"] if len(chapters) > 1 else (),
        "notes": [f"<p class='note'>{html.escape(text)}</p>" for text in notes],
        "warnings": [f"<p class='warning'>{html.escape(text)}</p>" for text in warnings],
        "table": [table],
        "clips": [_CLIP.format(number=number) for number in range(len(chapters))],
        "film": () if linked(film) else _base64(film.path),
        "tabs": _tabs(chapters),
        "chapters": [_chapter(number, chapter) for number, chapter in enumerate(chapters)],
        "sheet": sheet,
    }
    write_page(path, PAGE, data, parts)


def _told(chapter: Chapter) -> str:
    *names, last = (name.replace("_", " ") for name in chapter.track.figure.scored)
    return html.escape(f"{', '.join(names)} and {last}" if names else last)


def _link(film: Playable, page: Path) -> str | None:
    """Where the page finds the film; None if that is within it."""
    return quote(Path(os.path.relpath(film.path, page.parent)).as_posix()) if linked(film) else None


def _tabs(chapters: Sequence[Chapter]) -> Iterator[str]:
    if len(chapters) > 1:
        for number, chapter in enumerate(chapters):
            pressed = "true" if number == 0 else "false"
            name = html.escape(chapter.name)
            yield f"<button type='button' data-tab='{number}' aria-pressed='{pressed}'>{name}</button>"


def _chapter(number: int, chapter: Chapter) -> str:
    facts = "".join(
        f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(value)}</dd></div>"
        for name, value in chapter.facts()
    )
    hidden = " hidden" if number else ""
    return (
        f"<article data-chapter='{number}'{hidden}>"
        f"<section class='card'><h2>Joint angles</h2><div class='plots'></div></section>"
        f"{_gait(chapter)}<section class='card'><h2>The run</h2><dl>{facts}</dl></section></article>"
    )


def _gait(chapter: Chapter) -> str:
    if chapter.gait is None:
        return ""
    cautions = "".join(f"<p class='note'>{html.escape(text)}</p>" for text in chapter.cautions())
    words = {"headline": headline(chapter), "unusual": unusual(chapter)}
    lines = "".join(f"<p class='{name}'>{html.escape(text)}</p>" for name, text in words.items() if text)
    cycles, table, reading = "", "", ""
    if chapter.gait.measures:
        counts = [len(chapter.gait.strides[side].sound) for side in ("near", "far")]
        cycles, table = _CYCLES, gait_table(chapter.gait)
        reading = _READING.format(near=counts[0], far=counts[1])
    return f"<section class='card gait'><h2>Gait</h2>{lines}{cautions}{cycles}{table}{reading}</section>"


def _base64(path: Path) -> Iterator[str]:
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            yield base64.b64encode(block).decode("ascii")


_CLIP = """<figure data-chapter='{number}'><div class='screen'>
<video muted playsinline preload='auto'></video></div><figcaption></figcaption></figure>"""

_ERRORS = """<section class='card'><h2>Errors</h2>{table} <p class='soft'>Against the marked joints, in leg
lengths, over {joints}. Lost: two marked frames in a row with a
mean above {limit}.</p></section>"""

_SHEET = """<section class='card'><h2>Where they part</h2><div class='wide sheet'>
<img alt='Each model at the frames where they part, a row each' src='"""

_CYCLES = """<h3>Angles over the stride</h3><div class='cycles'></div><p class='soft'>Degrees, from a foot's
strike, at 0 %, to its next, at 100 %. Thin: every stride; thick: their mean; band: two standard deviations of
the strides. The upright line is where the foot leaves the ground. Grey, where it is drawn: mean and two
standard deviations of people in motion capture, whose joints are placed otherwise than marks on a picture:
compare shape and range sooner than height.</p>"""

_READING = """<p class='soft'>Means over {near} of the near leg's strides and {far} of the far leg's,
&plusmn; two standard errors: how much the strides differ, and the poses' own uncertainty. A stride lasts
from a foot's strike to its next, a step from the other foot's strike to this one's; stance is the share of
a stride in which the foot is on the ground, double support that in which both are, and flight the time from
a foot's leaving to the other's strike. Symmetry is the near leg less the far one over their mean, in per
cent: 0 where they do alike.</p>"""
