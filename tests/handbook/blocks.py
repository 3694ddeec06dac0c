"""The blocks of code in the README and the pages of docs/, and the commands in them."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", *sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")))
FIGTRACK = ("figtrack", ".venv/bin/figtrack")
PYTHON = ("python", "python3", ".venv/bin/python")
PROGRAMS = (
    *FIGTRACK,
    *PYTHON,
    "make",
    "dask",
    "export",
    "pip",
    "cd",
    "git",
    "curl",
    "source",
    "sudo",
    "eval",
)


@dataclass(frozen=True)
class Block:
    """One block of a page: commands, Python, or what is merely shown; `line` counts from 1."""

    page: str
    line: int
    text: str

    @property
    def kind(self):
        if any(line.split()[0] in PROGRAMS for line in self.lines):
            return "commands"
        return "python" if self.lines[0].startswith(("import ", "from ")) else "shown"

    @property
    def file(self):
        """The name of the file that it is to be saved as, which a comment at its top gives; "" for none."""
        named = re.fullmatch(r"# (\w+\.toml)", self.lines[0])
        return named[1] if named else ""

    @property
    def lines(self):
        """Its lines but the empty ones; a backslash at an end joins two."""
        return [line for line in self.text.replace("\\\n", " ").splitlines() if line.strip()]

    @property
    def commands(self):
        """The words of every command."""
        return [shlex.split(line, comments=True) for line in self.lines]


def blocks_of(page):
    """The blocks of a page, in order."""
    return blocks_in((ROOT / page).read_text(encoding="utf-8"), page)


def blocks_in(text, page="page"):
    """The blocks of a Markdown text."""
    tokens = [
        token for token in MarkdownIt("commonmark").parse(text) if token.type in ("fence", "code_block")
    ]
    return [Block(page, token.map[0] + 1, token.content) for token in tokens]
