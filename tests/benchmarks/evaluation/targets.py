"""What is wanted of a figure, beside what was measured."""

from collections.abc import Iterable
from dataclasses import dataclass

from tests.benchmarks.motion.page import table

HEADER = ("", "wanted", "measured", "reached")


@dataclass(frozen=True)
class Target:
    """A figure that is to lie between two bounds."""

    text: str
    value: float
    most: float
    least: float = 0.0

    @property
    def reached(self) -> bool:
        """Never by what is no number."""
        return self.least <= self.value <= self.most

    def row(self) -> list[str]:
        """A row under HEADER."""
        wanted = f"at most {self.most:g}" if self.least == 0.0 else f"{self.least:g} to {self.most:g}"
        return [self.text, wanted, f"{self.value:.3g}", "yes" if self.reached else "**no**"]


def target_table(targets: Iterable[Target]) -> list[str]:
    """Lines of a Markdown table."""
    return table(HEADER, [target.row() for target in targets])
