"""The page as one document: its style, its scripts and what it starts with are written into it."""

import json
from importlib import resources
from typing import Any

SCRIPTS = ("marks.js", "picture.js", "film.js", "figure.js", "side.js", "saving.js", "page.js")


def compose(opening: Any, nonce: str) -> str:
    """The page.

    Args:
        opening: what it starts with, as JSON can hold it.
        nonce: what the page's policy asks of its own style and scripts.
    """
    # "</script>" in a file's name would end the element; JSON may spell "<" as it likes.
    start = json.dumps(opening).replace("<", "\\u003c")
    parts = {
        "{{nonce}}": nonce,
        "{{style}}": _read("style.css"),
        "{{scripts}}": "\n".join(_read(name) for name in SCRIPTS),
        "{{opening}}": start,
    }
    page = _read("page.html")
    for mark, text in parts.items():
        page = page.replace(mark, text)
    return page


def _read(name: str) -> str:
    return (resources.files("tracker.annotate") / "page" / name).read_text(encoding="utf-8")
