"""Tables of the motion figures, and targets with what was measured beside them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tests.benchmarks.motion.data import Job

Results = Mapping[Job, Any]


@dataclass(frozen=True)
class Claim:
    """Something that is to be `target` at most; NaN where a quick run measured nothing."""

    text: str
    value: float
    target: float
    unit: str = ""

    @property
    def reached(self) -> bool:
        """Never where nothing was measured."""
        return self.value <= self.target

    def row(self) -> list[str]:
        """A row under CLAIM_HEADER."""
        measured = f"{self.value:.2f}{self.unit}" if self.value == self.value else "not measured"
        return [self.text, f"{self.target:g}{self.unit}", measured, "yes" if self.reached else "**no**"]


CLAIM_HEADER = ("", "at most", "measured", "reached")


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table, an empty one after it."""
    lines = [header, ["---"] * len(header), *rows]
    return [f"| {' | '.join(line)} |" for line in lines] + [""]


def number(value: float | None) -> str:
    """Two decimals, or a dash for what was not measured."""
    return "-" if value is None or value != value else f"{value:.2f}"
