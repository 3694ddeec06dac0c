"""The page of a batch: a row a clip with picture, gait in a sentence, warnings and report."""

import base64
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import cv2
from markupsafe import Markup

from tracker.report.document import STYLES, Document, linked_from, write_page
from tracker.run.read import OVERLAY, REPORT, RunError, read_news
from videos.container import VideoError
from videos.frames import Video

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
    """The first frame as a small JPEG in base64; "" if there is none."""
    try:
        image = next(iter(Video(clip))).image
    except VideoError:
        return ""
    height = round(image.shape[0] * WIDTH / image.shape[1])
    small = cv2.resize(image, (WIDTH, height), interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", cv2.cvtColor(small, cv2.COLOR_RGB2BGR))
    return base64.b64encode(data.tobytes()).decode("ascii")
