"""Pixelwise medians of many pictures by a sorting network, whose comparisons act on whole pictures."""

from collections.abc import Iterator

import numpy as np

from tracker.picture.pyramid import Image, Ints

BEYOND = 255  # value of missing pixels, which sort last


def medians(values: Image, number: Ints) -> Image:
    """(h, w, c): the lower median of the first `number` (h, w) in order of (T, h, w, c), at least one.

    The values are sorted in place; missing ones must be BEYOND.
    """
    for i, j in comparisons(len(values)):
        low = np.minimum(values[i], values[j])
        np.maximum(values[i], values[j], out=values[j])
        values[i] = low
    middle = np.maximum(number - 1, 0)[None, ..., None] // 2
    return np.asarray(np.take_along_axis(values, middle, axis=0)[0])


def comparisons(count: int) -> Iterator[tuple[int, int]]:
    """Pairs (i, j), i < j, of a network that sorts `count` values by exchanging pairs in disorder.

    Batcher's merge exchange: Knuth (1998), section 5.2.2, algorithm M.
    """
    top = 1 << max((count - 1).bit_length() - 1, 0)
    p = top
    while p > 0 and count > 1:
        q, r, d = top, 0, p
        while True:
            yield from ((i, i + d) for i in range(count - d) if i & p == r)
            if q == p:
                break
            d, q, r = q - p, q // 2, p
        p //= 2
