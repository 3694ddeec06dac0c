"""Pages as one document each: style, scripts and data are written into it, and nothing is fetched."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FunctionLoader
from markupsafe import Markup

COMMON = "report/common"  # style and script of all pages
STYLES = ("report/style.css",)  # of those that are files
# A file may show what is in it and the film beside it.
POLICY = Markup(
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; "
    "media-src blob: file: 'self'"
)


@dataclass(frozen=True)
class Document:
    """A page and what is written into it, files as "room/name" of the tracker's rooms that have pages."""

    page: str
    styles: tuple[str, ...]
    scripts: tuple[str, ...] = ()

    def compose(self, data: object, nonce: str = "", **shown: Any) -> Iterator[str]:
        """The page, piece by piece.

        Args:
            data: what its scripts start with, as JSON can hold it but for arrays.
            nonce: what the page's policy asks of its own style and scripts.
            shown: what its template names; text that is no Markup is escaped.
        """
        return _PAGES.get_template("report/frame.html").generate(
            page=self.page,
            style=_joined(f"{COMMON}.css", *self.styles),
            scripts=_joined(f"{COMMON}.js", *self.scripts),
            data=_script(data),
            nonce=nonce,
            **shown,
        )


def write_page(path: Path, page: Document, data: object, **shown: Any) -> None:
    """Write a page that is a file, piece by piece: a long clip in it is never in memory."""
    # A file's name may be no text at all.
    with path.open("w", encoding="utf-8", errors="replace") as file:
        file.writelines(page.compose(data, policy=POLICY, **shown))


def listed(values: object) -> object:
    """An array as JSON can hold it: lists, which take ten times its memory, of one array at a time."""
    if isinstance(values, np.ndarray):
        return values.tolist()
    raise TypeError(f"JSON holds no {type(values).__name__}")


def _script(data: object) -> Markup:
    # "</script>" in a file's name would end the element; JSON may spell "<" as it likes.
    written = json.dumps(data, separators=(",", ":"), allow_nan=False, default=listed)
    return Markup(written.replace("<", "\\u003c"))


def _joined(*names: str) -> Markup:
    return Markup("".join(map(_read, names)))


def _read(name: str) -> str:
    room, _, file = name.partition("/")
    return (resources.files(f"tracker.{room}") / "page" / file).read_text(encoding="utf-8")


_PAGES = Environment(loader=FunctionLoader(_read), autoescape=True, trim_blocks=True, lstrip_blocks=True)
