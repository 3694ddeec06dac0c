"""What pages of figures share: Markdown tables, claims beside what was measured, which command wrote them."""

import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import inf


@dataclass(frozen=True)
class Claim:
    """A figure that is to lie between two bounds; NaN where nothing was measured, which reaches nothing.

    most : infinite where there is no upper bound
    unit : told after the text; figures then have two decimals, else three digits
    """

    text: str
    value: float
    most: float
    least: float = 0.0
    unit: str = ""

    @property
    def reached(self) -> bool:
        """Whether it lies there."""
        return self.least <= self.value <= self.most

    def row(self) -> list[str]:
        """The cells of its row in `claim_table`."""
        wanted = f"{self.least:g} to {self.most:g}"
        if self.least == 0.0 or self.most == inf:
            wanted = f"≥{self.least:g}" if self.most == inf else f"≤{self.most:g}"
        measured = f"{self.value:.2f}" if self.unit else f"{self.value:.3g}"
        text = self.text + (f", {self.unit}" if self.unit else "")
        return [text, wanted, measured, "yes" if self.reached else "**no**"]


def chapter(heading: str, *parts: str | Iterable[str]) -> list[str]:
    """Lines of a heading and of what is under it, each part a text or the lines of a table."""
    lines = [heading, ""]
    for part in parts:
        lines += [part.rstrip("\n"), ""] if isinstance(part, str) else part
    return lines


def claim_table(claims: Iterable[Claim]) -> list[str]:
    """Lines of a table, an empty one after it."""
    return table(("target", "wanted", "measured", "reached"), [claim.row() for claim in claims])


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table, an empty one after it."""
    head, *body = [f"|{' |'.join(line)}|" for line in (header, *rows)]
    return [head, f"|{'---|' * len(header)}", *body, ""]


def number(value: float | None) -> str:
    """Two decimals, or a dash for what was not measured."""
    return "-" if value is None or value != value else f"{value:.2f}"


def written(command: str) -> str:
    """Which command wrote a page, at which commit and when."""
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
    )
    return f"Written by `make {command}` at commit {commit.stdout.strip()} on {datetime.now(UTC):%Y-%m-%d}"
