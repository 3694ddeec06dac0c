"""The page of a batch: a row a clip, with a picture, its gait in a sentence, its warnings and its report."""

import base64
import html
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

import cv2

from tracker.report.document import STYLES, Document, write_page
from tracker.report.results import OVERLAY, REPORT
from tracker.run.read import RunError, read_news
from videos.frames import Video, VideoError

PAGE = Document("report/overview.html", STYLES)
MADE = '<meta name="generator" content="figtrack batch">'
WIDTH = 240  # pixels of a row's picture


@dataclass(frozen=True)
class Row:
    """A clip of the batch.

    video : what it is called
    run   : the folder of its run, None where it failed
    said  : how it ended, and why where it failed
    """

    video: str
    run: Path | None
    said: str


def write_overview(path: Path, place: Path, rows: Sequence[Row]) -> None:
    """The page, whose links are relative to the folder `place` that it will lie in."""
    table = ["<div class='wide'><table class='overview'><tbody>"]
    table += (_row(row, place) for row in rows)
    table.append("</tbody></table></div>")
    parts = {"title": [html.escape(place.name)], "table": table, "head": [MADE]}
    write_page(path, PAGE, {}, parts)


def is_overview(path: Path) -> bool:
    """Whether a file is such a page."""
    return MADE in path.read_bytes()[:1000].decode("utf-8", errors="replace")


def _row(row: Row, place: Path) -> str:
    name, said = html.escape(row.video), html.escape(row.said)
    try:
        news = None if row.run is None else read_news(row.run)
    except RunError:  # somebody took it away meanwhile
        news = None
    if row.run is None or news is None:
        return f"<tr><td></td><th scope='row'>{name}</th><td><p class='warning'>{said}</p></td></tr>"
    lines = [f"<p class='headline'>{html.escape(news.headline)}</p><p class='soft'>{said}</p>"]
    lines += (f"<p class='warning'>{html.escape(text)}</p>" for text in news.warnings)
    report = row.run / REPORT
    if report.exists():
        link = quote(Path(os.path.relpath(report, place)).as_posix())
        name = f"<a href='{link}'>{name}</a>"
    picture = "".join(_picture(row.run / OVERLAY))
    return f"<tr><td>{picture}</td><th scope='row'>{name}</th><td>{''.join(lines)}</td></tr>"


def _picture(clip: Path) -> Iterator[str]:
    try:
        image = next(iter(Video(clip))).image
    except (VideoError, StopIteration):
        return
    height = round(image.shape[0] * WIDTH / image.shape[1])
    small = cv2.resize(image, (WIDTH, height), interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", cv2.cvtColor(small, cv2.COLOR_RGB2BGR))
    yield f"<img alt='' src='data:image/jpeg;base64,{base64.b64encode(data.tobytes()).decode('ascii')}'>"
