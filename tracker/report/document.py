"""Pages as one document each: style, scripts and data are written into it, and nothing is fetched."""

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

ROWS = 1000  # of an array that are lists at a time
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


def linked_from(folder: Path, path: Path) -> str:
    """The address of a file in a page that lies in a folder."""
    return quote(os.fsencode(Path(os.path.relpath(path, folder)).as_posix()))


def written(data: object) -> Iterator[str]:
    """Data as JSON, piece by piece: lists take ten times an array's memory, so no long one becomes a list.

    Raises:
        ValueError: a number is not finite.
        TypeError: JSON holds nothing of some type.
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
    # "</script>" in a file's name would end the element; JSON may spell "<" as it likes.
    return (Markup(piece.replace("<", "\\u003c")) for piece in written(data))


def _joined(*names: str) -> Markup:
    return Markup("".join(map(_read, names)))


def _read(name: str) -> str:
    room, _, file = name.partition("/")
    return (resources.files(f"tracker.{room}") / "page" / file).read_text(encoding="utf-8")


_PAGES = Environment(loader=FunctionLoader(_read), autoescape=True, trim_blocks=True, lstrip_blocks=True)
