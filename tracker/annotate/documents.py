"""Pages as one document each: its styles, its scripts and what it starts with are written into it."""

import json
from dataclasses import dataclass
from importlib import resources
from typing import Any


@dataclass(frozen=True)
class Document:
    """A page and what is written into it, files as "room/name" of the tracker's rooms that have pages."""

    page: str
    styles: tuple[str, ...]
    scripts: tuple[str, ...]

    def compose(self, opening: Any, nonce: str) -> str:
        """The page.

        Args:
            opening: what it starts with, as JSON can hold it.
            nonce: what the page's policy asks of its own style and scripts.
        """
        # "</script>" in a file's name would end the element; JSON may spell "<" as it likes.
        start = json.dumps(opening).replace("<", "\\u003c")
        parts = {
            "{{nonce}}": nonce,
            "{{style}}": "\n".join(map(_read, self.styles)),
            "{{scripts}}": "\n".join(map(_read, self.scripts)),
            "{{opening}}": start,
        }
        page = _read(self.page)
        for mark, text in parts.items():
            page = page.replace(mark, text)
        return page


_MARKING = ("marks.js", "picture.js", "film.js", "figure.js", "side.js", "saving.js", "page.js")
MARKING = Document(
    "annotate/page.html",
    ("annotate/base.css", "annotate/style.css"),
    tuple(f"annotate/{name}" for name in _MARKING),
)


def _read(name: str) -> str:
    room, _, file = name.partition("/")
    return (resources.files(f"tracker.{room}") / "page" / file).read_text(encoding="utf-8")
