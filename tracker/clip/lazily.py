"""What is known of the frames of a film, made frame by frame when asked for, which keeps long films small."""

from collections import ChainMap
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import TypeVar

Value = TypeVar("Value")


class Lazily(Mapping[int, Value]):
    """A value of each of some frames, which a function makes whenever it is asked for."""

    def __init__(self, frames: Collection[int], make: Callable[[int], Value]) -> None:
        self._frames, self._make = frames, make

    def __getitem__(self, frame: int) -> Value:
        if frame not in self._frames:
            raise KeyError(frame)
        return self._make(frame)

    def __iter__(self) -> Iterator[int]:
        return iter(self._frames)

    def __len__(self) -> int:
        return len(self._frames)


def together(parts: Sequence[Mapping[int, Value]]) -> Mapping[int, Value]:
    """The values of several parts of a film; of a frame in two of them, those of the first."""
    return ChainMap(*parts)  # type: ignore[arg-type]  # it is only read
