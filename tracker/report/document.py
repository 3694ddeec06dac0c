"""Pages as one document each: style, scripts and data are written into it, and nothing is fetched."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

COMMON = "report/common"  # style and script of all pages
STYLES = ("report/style.css",)  # of those that are files
# A file may show what is in it and the film beside it.
POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; "
    "media-src blob: file: 'self'"
)


@dataclass(frozen=True)
class Document:
    """A page and what is written into it, files as "room/name" of the tracker's rooms that have pages."""

    page: str
    styles: tuple[str, ...]
    scripts: tuple[str, ...] = ()

    def compose(self, data: object, parts: Mapping[str, Iterable[str]], nonce: str = "") -> Iterator[str]:
        """The page, piece by piece.

        Args:
            data: what its scripts start with, as JSON can hold it.
            parts: what stands in its places, by their names; "head" and "kind" (of its body) may be left out.
            nonce: what the page's policy asks of its own style and scripts.
        """
        # "</script>" in a file's name would end the element; JSON may spell "<" as it likes.
        written = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
        every = {"head": (), "kind": (), **parts, "nonce": [nonce], "data": [written]}
        every["style"] = map(_read, (f"{COMMON}.css", *self.styles))
        every["scripts"] = map(_read, (f"{COMMON}.js", *self.scripts))
        page = _read("report/frame.html").replace("{{body}}", _read(self.page))
        for i, piece in enumerate(re.split(r"\{\{(\w+)\}\}", page)):
            yield from every[piece] if i % 2 else [piece]


def write_page(path: Path, page: Document, data: object, parts: Mapping[str, Iterable[str]]) -> None:
    """Write a page that is a file, piece by piece: a long clip in it is never in memory."""
    policy = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    head = [policy, *parts.get("head", ())]
    # A file's name may be no text at all.
    with path.open("w", encoding="utf-8", errors="replace") as file:
        file.writelines(page.compose(data, {**parts, "head": head}))


def _read(name: str) -> str:
    room, _, file = name.partition("/")
    return (resources.files(f"tracker.{room}") / "page" / file).read_text(encoding="utf-8")
