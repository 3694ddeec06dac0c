"""Starts whose feet are not marked, or only by guess, in the open and behind a hedge."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.evaluation.disturbances import guessed
from tracker.tables.keypoints import Mark


@dataclass(frozen=True)
class Feet:
    """What a start lacks of its feet.

    unmarked : joints without a mark
    guessed  : joints whose marks are guesses
    hedge    : whether a hedge stands before them
    """

    unmarked: Collection[str] = ()
    guessed: Collection[str] = ()
    hedge: bool = False

    def start(self, row: dict[str, Mark], rng: np.random.Generator) -> dict[str, Mark]:
        """What is left of the marks of one frame."""
        left = {name: mark for name, mark in row.items() if name not in self.unmarked}
        return guessed(left, self.guessed, rng)


TOES = ("near_toe", "far_toe")
ANKLES = ("near_ankle", "far_ankle")
FEET = {
    "all marked": Feet(),
    "no toes": Feet(TOES),
    "no far ankle, no toes": Feet(("far_ankle", *TOES)),
    "no ankles, no toes": Feet((*ANKLES, *TOES)),
    "no ankles, no toes, behind a hedge": Feet((*ANKLES, *TOES), hedge=True),
    "ankles and toes guessed, behind a hedge": Feet(guessed=(*ANKLES, *TOES), hedge=True),
}
