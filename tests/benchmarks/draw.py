"""Print ten docstrings and ten sentences of docs/, drawn by a seed, to be read as a stranger reads them.

    python -m tests.benchmarks.draw SEED

Each should stand alone: whole sentences, words of the field and of the glossary of ARCHITECTURE.md.
"""

import argparse
import ast
import random
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
PACKAGES = ("kinematics", "dynamics", "videos", "tracker")
DRAWN = 10
SENTENCE_END = re.compile(r"(?<=[^.][.!?])\s+(?=[A-Z`*\[])")


def main() -> None:
    """Draw and print."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.draw", description=__doc__)
    parser.add_argument("seed", type=int)
    drawn = random.Random(parser.parse_args().seed)
    for found in (list(docstrings()), list(sentences())):
        for where, text in drawn.sample(found, DRAWN):
            print(f"{where}\n    {text}\n")


def docstrings() -> Iterator[tuple[str, str]]:
    """Where each docstring of the packages is, and its text."""
    for path in sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and (
                text := ast.get_docstring(node)
            ):
                name = getattr(node, "name", "")
                yield f"{path.relative_to(ROOT)} {name}".rstrip(), text.replace("\n", "\n    ")


def sentences() -> Iterator[tuple[str, str]]:
    """The page of each sentence of docs/ and the sentence; neither code nor tables have any."""
    for path in sorted((ROOT / "docs").glob("*.md")):
        tokens = MarkdownIt("commonmark").enable("table").parse(path.read_text(encoding="utf-8"))
        for before, token in pairwise(tokens):
            if before.type == "paragraph_open" and not token.content.startswith("!["):
                yield from (
                    (path.name, text) for text in SENTENCE_END.split(token.content.replace("\n", " "))
                )


if __name__ == "__main__":
    main()
