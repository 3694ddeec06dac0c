"""report.html: one document with its numbers, pictures and, unless it is large, its film."""

import base64
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from tracker.report.chapter import Chapter, headline, unusual
from tracker.report.document import STYLES, Document, linked_from, write_page
from tracker.report.html_tables import SCORE_COLUMNS, gait_table, html_table, table_rows
from tracker.run.score import LOST_ERROR, Score
from videos.playable import Playable

SCRIPTS = ("plots", "saving", "player", "figure", "page")
PAGE = Document("report/page.html", STYLES, tuple(f"report/{name}.js" for name in SCRIPTS))
LARGEST = 60_000_000  # largest film that is embedded in a page, bytes; a larger one is linked
BLOCK = 3 * 2**18  # bytes converted to base64 at a time, in whole groups of three


def linked(film: Playable) -> bool:
    """Whether pages link to a film, which then must stay where it is."""
    return film.path.stat().st_size > LARGEST


def write_report(path: Path, chapter: Chapter, film: Playable) -> None:
    """Write the page of one run."""
    _write(path, film, [chapter], warnings=chapter.warnings)


def write_comparison(
    path: Path,
    film: Playable,
    chapters: Sequence[Chapter],
    scores: Mapping[str, Score],
    failure: Path,
    notes: Sequence[str],
) -> None:
    """Write the page that compares several runs of one clip, all from the same start frame, with the scores
    of each chapter by name.

    `failure` is the sheet of frames where the tracks part; notes come first.
    """
    first = chapters[0].track.first
    errors = [
        {
            "name": name,
            "lost": score.first_failure_frame,
            "points": [[t - first, round(e, 4)] for t, e in score.frame_errors.items()],
        }
        for name, score in scores.items()
    ]
    _write(
        path,
        film,
        chapters,
        {"models": errors, "lost": LOST_ERROR},
        notes=notes,
        warnings=[f"{chapter.name}: {text}" for chapter in chapters for text in chapter.warnings],
        scores=html_table(SCORE_COLUMNS, table_rows(scores)),
        joints=_told(chapters[0]),
        lost=LOST_ERROR,
        sheet=_base64(failure),
    )


def _write(
    path: Path,
    film: Playable,
    chapters: Sequence[Chapter],
    errors: Mapping[str, object] | None = None,
    **shown: Any,
) -> None:
    link = linked_from(path.parent, film.path) if linked(film) else None  # an embedded film has none
    about = {"link": link, "start": round(film.start, 6), "size": film.size}
    write_page(
        path,
        PAGE,
        {"chapters": [chapter.drawn() for chapter in chapters], "errors": errors, "film": about},
        title=chapters[0].run.job.video.name,
        kind="several" if len(chapters) > 1 else "",
        chapters=chapters,
        said=lambda chapter: {"headline": headline(chapter), "unusual": unusual(chapter)},
        gait_table=gait_table,
        film=() if link else _base64(film.path),
        **shown,
    )


def _told(chapter: Chapter) -> str:
    *names, last = (name.replace("_", " ") for name in chapter.track.figure.scored)
    return f"{', '.join(names)} and {last}" if names else last


def _base64(path: Path) -> Iterator[str]:
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            yield base64.b64encode(block).decode("ascii")
