"""Sequences of different lengths in one array: a row for each sequence and frame, ordered by frame.

Within a frame the longest sequence comes first. Sequences that have ended have no row.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from dynamics.chain import batches, in_order
from dynamics.gaussian import Array, Ints
from dynamics.slds import SLDS

Result = TypeVar("Result")

PAIRS = 1024  # pairs of switching states processed at a time: more do not fit the processor's cache


@dataclass(frozen=True)
class Frames:
    """The frames of several sequences, longest first.

    y, hints : (rows, M) and (rows, K)
    first    : frame t has the rows first[t] to first[t + 1]
    before   : (rows,) the row of the same sequence a frame before
    lengths  : frames of each sequence
    """

    y: Array
    hints: Array
    first: Ints
    before: Ints
    lengths: Ints

    def at(self, t: int) -> slice:
        return slice(int(self.first[t]), int(self.first[t + 1]))

    def sequences(self) -> list[Ints]:
        return [self.first[:T] + n for n, T in enumerate(self.lengths)]

    def back(self, start: int = 1, stop: int | None = None) -> Iterator[tuple[slice, slice]]:
        """From frame stop - 1, or the last, back to `start`: rows of the frame before, and its own."""
        last = len(self.first) - 2 if stop is None else stop - 1
        for now in map(self.at, range(last, start - 1, -1)):
            yield slice(int(self.before[now.start]), int(self.before[now.stop - 1]) + 1), now

    def chunks(self, size: int) -> Iterator[tuple[slice, Iterator[tuple[slice, slice]]]]:
        """All rows but frame 0's, from the last back, in blocks of about `size`, each with its `back`."""
        stop = len(self.first) - 1
        while stop > 1:
            start = int(np.searchsorted(self.first, self.first[stop] - size))
            start = max(1, min(stop - 1, start))
            yield slice(int(self.first[start]), int(self.first[stop])), self.back(start, stop)
            stop = start


def frame_batches(slds: SLDS, ys: Sequence[Array]) -> list[list[int]]:
    """Groups of sequences to process together, as many as fit the processor's cache, longest first."""
    return batches(ys, most=max(1, PAIRS // slds.K**2))


def in_batches(
    slds: SLDS, ys: Sequence[Array], hints: Sequence[Array] | None, infer: Callable[[Frames], list[Result]]
) -> list[Result]:
    """The result of `infer` for each sequence, in the order given; each call of `infer` gets one batch.

    ValueError: a sequence without a frame.
    """
    if not all(len(y) for y in ys):
        raise ValueError("every sequence must have a frame at least")
    chosen = frame_batches(slds, ys)
    return in_order(chosen, (infer(_frames(slds, ys, hints, numbers)) for numbers in chosen))


def _frames(slds: SLDS, ys: Sequence[Array], hints: Sequence[Array] | None, numbers: Sequence[int]) -> Frames:
    lengths = np.array([len(ys[n]) for n in numbers])
    counts = (lengths > np.arange(lengths[0])[:, None]).sum(1)
    first = np.concatenate([[0], np.cumsum(counts)])
    rows = int(first[-1])
    before = np.arange(rows) - np.repeat(np.append(0, counts[:-1]), counts)
    frames = Frames(np.empty((rows, len(slds.C))), np.zeros((rows, slds.K)), first, before, lengths)
    for n, own in zip(numbers, frames.sequences(), strict=True):
        frames.y[own] = ys[n]
        if hints is not None:
            frames.hints[own] = hints[n]
    return frames
