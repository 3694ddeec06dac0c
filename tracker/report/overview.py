"""The page of a batch: a row a clip with picture, gait in a sentence, warnings and report."""

import base64
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from tracker.report.document import STYLES, Document, linked_from, write_page
from tracker.report.thumbnail import thumbnail
from tracker.run.read import OVERLAY, REPORT, RunError, read_news
from videos.container import VideoError

PAGE = Document("report/overview.html", STYLES)
MADE = Markup('<meta name="generator" content="figtrack batch">')
WIDTH = 240  # pixels of a row's picture


@dataclass(frozen=True)
class Row:
    """A clip of the batch.

    video : its name
    run   : the folder of its run, None if it failed
    said  : how it ended, with the reason of a failure
    """

    video: str
    run: Path | None
    said: str


def write_overview(path: Path, place: Path, rows: Sequence[Row]) -> None:
    """Write the page, with links relative to the folder `place` in which it will be."""
    shown = [_shown(row, place) for row in rows]
    write_page(path, PAGE, {}, title=place.name, head=MADE, rows=shown)


def is_overview(path: Path) -> bool:
    """Whether a file is a page of a batch."""
    return MADE in path.read_bytes()[:1000].decode("utf-8", errors="replace")


def _shown(row: Row, place: Path) -> dict[str, object]:
    """The content of a row; without a run that failed or was removed meanwhile."""
    shown: dict[str, object] = {"video": row.video, "said": row.said}
    with suppress(RunError):
        if row.run is not None:
            shown["news"] = read_news(row.run)
            shown["picture"] = _picture(row.run / OVERLAY)
            report = row.run / REPORT
            if report.exists():
                shown["report"] = linked_from(place, report)
    return shown


def _picture(clip: Path) -> str:
    """A picture of a clip as a small JPEG in base64; "" if it cannot be read."""
    try:
        return base64.b64encode(thumbnail(clip, WIDTH)).decode("ascii")
    except VideoError:
        return ""
