"""The page of a batch: a row a clip with picture, gait in a sentence, warnings and report."""

import base64
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from markupsafe import Markup

from tracker.report.document import STYLES, Document, linked_from, write_page
from tracker.report.thumbnail import thumbnail
from tracker.run.read import OVERLAY, REPORT, RunError, read_news
from videos.container import VideoError

PAGE = Document("report/overview.html", STYLES)
MADE = Markup('<meta name="generator" content="figtrack batch">')
WIDTH = 240  # pixels of a row's picture


def write_overview(path: Path, place: Path, clips: Iterable[tuple[str, Path | None, str]]) -> None:
    """Write the page, which will be in the folder `place`; `clips` are name, folder of the run, None if it
    failed, and how it ended."""
    rows = [_row(*clip, place) for clip in clips]
    write_page(path, PAGE, {}, title=place.name, head=MADE, rows=rows)


def _row(video: str, run: Path | None, said: str, place: Path) -> dict[str, object]:
    """The content of a row; without a run that failed or was removed meanwhile."""
    row: dict[str, object] = {"video": video, "said": said}
    with suppress(RunError):
        if run is not None:
            row["news"] = read_news(run)
            if (run / REPORT).exists():
                row["report"] = linked_from(place, run / REPORT)
            with suppress(VideoError):
                row["picture"] = base64.b64encode(thumbnail(run / OVERLAY, WIDTH)).decode("ascii")
    return row
