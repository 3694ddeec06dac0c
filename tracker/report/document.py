"""Pages as single documents: style, scripts and data are embedded, and nothing is fetched."""

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from jinja2 import Environment, FunctionLoader
from markupsafe import Markup

COMMON = "report/common"  # style and script of all pages
STYLES = ("report/style.css",)  # further style of pages that are files
# Content policy of pages that are files: only embedded content and the film beside it.
POLICY = Markup(
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; "
    "media-src blob: file: 'self'"
)


@dataclass(frozen=True)
class Document:
    """A page and its embedded files, given as "room/name" in the tracker's packages."""

    page: str
    styles: tuple[str, ...]
    scripts: tuple[str, ...] = ()

    def compose(self, data: object, nonce: str = "", **shown: Any) -> Iterator[str]:
        """The page, in pieces.

        Args:
            data: for its scripts, arrays and JSON types.
            nonce: of its style and scripts for the page's content policy.
            shown: variables of its template; text that is no Markup is escaped.
        """
        return _PAGES.get_template("report/frame.html").generate(
            page=self.page,
            style=_joined(f"{COMMON}.css", *self.styles),
            scripts=_joined(f"{COMMON}.js", *self.scripts),
            # "</script>" in a file's name would end the element; JSON allows "<" to be escaped.
            data=Markup(as_json(data).replace("<", "\\u003c")),
            nonce=nonce,
            **shown,
        )


def write_page(path: Path, page: Document, data: object, **shown: Any) -> None:
    """Write a page to a file in pieces, so that a long clip in it is never wholly in memory."""
    # A file's name may be no valid UTF-8.
    with path.open("w", encoding="utf-8", errors="replace") as file:
        file.writelines(page.compose(data, policy=POLICY, **shown))


def linked_from(folder: Path, path: Path) -> str:
    """The relative address of a file for a page in a folder."""
    return quote(os.fsencode(Path(os.path.relpath(path, folder)).as_posix()))


def as_json(data: object) -> str:
    """Data as JSON, arrays as lists. ValueError: a number is not finite; TypeError: JSON has no such type."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False, default=np.ndarray.tolist)


def _joined(*names: str) -> Markup:
    return Markup("".join(map(_read, names)))


def _read(name: str) -> str:
    room, _, file = name.partition("/")
    return (resources.files(f"tracker.{room}") / "page" / file).read_text(encoding="utf-8")


_PAGES = Environment(loader=FunctionLoader(_read), autoescape=True, trim_blocks=True, lstrip_blocks=True)
