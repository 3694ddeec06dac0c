"""Time of a run by stage."""

import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")


class Clock:
    """Seconds spent by stage; time of a stage within another counts for the inner one only."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)

    def timed(self, stage: str, items: Iterable[T]) -> Iterator[T]:
        """The items, with the time that producing each takes counted for the stage."""
        iterator = iter(items)
        while True:
            with self.stage(stage):
                try:
                    item = next(iterator)
                except StopIteration:
                    return
            yield item

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        began, before = time.perf_counter(), sum(self.spent.values())
        try:
            yield
        finally:
            nested = sum(self.spent.values()) - before
            self.spent[name] += time.perf_counter() - began - nested

    def per_frame(self, frames: int) -> dict[str, float]:
        return {stage: round(seconds / frames, 5) for stage, seconds in self.spent.items()}
