"""Pages as single documents: style, scripts and data are embedded, and nothing is fetched."""

import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import resources
from itertools import chain
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from jinja2 import Environment, FunctionLoader
from markupsafe import Markup

ROWS = 1000  # rows of an array that are converted to lists at a time
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
            data=_script(data),
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


def written(data: object) -> Iterator[str]:
    """Data as JSON, in pieces: lists take ten times an array's memory, so long arrays are converted by parts.

    Raises:
        ValueError: a number is not finite.
        TypeError: JSON has no such type.
    """
    if isinstance(data, dict):
        parts: Iterator[Iterator[str]] = (
            chain([f"{_dumped(str(key))}:"], written(data[key])) for key in data
        )
        yield from _between("{}", parts)
    elif isinstance(data, list | tuple):
        yield from _between("[]", map(written, data))
    elif isinstance(data, np.ndarray) and len(data):
        rows = (data[first : first + ROWS].tolist() for first in range(0, len(data), ROWS))
        yield from _between("[]", (iter([_dumped(some)[1:-1]]) for some in rows))
    else:
        yield _dumped([] if isinstance(data, np.ndarray) else data)


def _between(brackets: str, parts: Iterable[Iterator[str]]) -> Iterator[str]:
    yield brackets[0]
    for number, part in enumerate(parts):
        if number:
            yield ","
        yield from part
    yield brackets[1]


def _dumped(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _script(data: object) -> Iterator[Markup]:
    # "</script>" in a file's name would end the element; JSON allows "<" to be escaped.
    return (Markup(piece.replace("<", "\\u003c")) for piece in written(data))


def _joined(*names: str) -> Markup:
    return Markup("".join(map(_read, names)))


def _read(name: str) -> str:
    room, _, file = name.partition("/")
    return (resources.files(f"tracker.{room}") / "page" / file).read_text(encoding="utf-8")


_PAGES = Environment(loader=FunctionLoader(_read), autoescape=True, trim_blocks=True, lstrip_blocks=True)
