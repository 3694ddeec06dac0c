"""Where the time of a run went."""

import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")


class Clock:
    """Seconds spent inside iterators, by stage; what one iterator takes from another counts once."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)

    def timed(self, stage: str, items: Iterable[T]) -> Iterator[T]:
        iterator = iter(items)
        while True:
            began, before = time.perf_counter(), sum(self.spent.values())
            try:
                item = next(iterator)
            except StopIteration:
                return
            finally:
                nested = sum(self.spent.values()) - before
                self.spent[stage] += time.perf_counter() - began - nested
            yield item

    def per_frame(self, frames: int) -> dict[str, float]:
        return {stage: round(seconds / frames, 5) for stage, seconds in self.spent.items()}
