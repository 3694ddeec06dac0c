from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest

from tracker.outline.viterbi import best_path, best_phases


# Frames, sizes, rows and columns; the last may lead from the end of a row to the next one's beginning.
@pytest.mark.parametrize("shape", [(3, 2, 3, 4), (6, 1, 2, 2)])
@pytest.mark.parametrize("reach", [1, 2, 3])
@pytest.mark.parametrize("moving", [0, 1])
def test_the_best_path_of_places_is_that_of_all_paths(moving, reach, shape, rng):
    step, resize = 0.3, 0.5
    score = 3.0 * rng.normal(size=shape).astype(np.float32)
    corners = moving * rng.integers(-1, 2, size=(shape[0], 2))
    ways = np.diff(corners, axis=0).tolist()
    states = list(product(*map(range, shape[1:])))

    @cache
    def cost(before, after, right, down):
        (s0, y0, x0), (s1, y1, x1) = before, after
        steps = [
            step * (x - x1) ** 2 + 4.0 * step * (y - y1) ** 2
            for y, x in product(range(shape[2]), range(shape[3]))
            if abs(x - x1) <= reach
            and abs(y - y1) <= reach // 2
            # A place beyond the edge of the frame before is the one at the edge.
            and np.clip([y + down, x + right], 0, [shape[2] - 1, shape[3] - 1]).tolist() == [y0, x0]
        ]
        return resize * (s0 != s1) + min(steps, default=np.inf) if abs(s0 - s1) <= 1 else np.inf

    def worth(path):
        total = sum(float(score[t, s, y, x]) for t, (s, y, x) in enumerate(path))
        return total - sum(cost(*each, *way) for each, way in zip(pairwise(path), ways, strict=True))

    best = max(product(states, repeat=len(score)), key=worth)
    found = [tuple(each) for each in best_path(score, corners, step, resize, reach).tolist()]
    assert worth(found) == pytest.approx(worth(best), abs=1e-6)


@pytest.mark.parametrize("way", [1, -1])
def test_the_best_path_of_phases_is_that_of_all_paths(way, rng):
    T, P, change, slip = 4, 5, 0.3, 0.8
    speeds = way * np.array([0.6, 1.4])
    score = rng.normal(size=(T, P))

    def worth(path):
        total = sum(score[t, p] for t, (_, p) in enumerate(path))
        for (s0, p0), (s1, p1) in pairwise(path):
            steps = np.rint(speeds[s1]) + np.array([-1.0, 0.0, 1.0])
            steps = steps[(p0 + steps) % P == p1]
            if not len(steps):
                return -np.inf
            total -= change * (s0 != s1) + 0.5 * np.min(((speeds[s1] - steps) / slip) ** 2)
        return total

    states = list(product(range(2), range(P)))
    best = max(worth(path) for path in product(states, repeat=T))
    value, path = best_phases(score, speeds, change, slip)
    assert value == pytest.approx(best, rel=1e-9)
    assert worth([tuple(each) for each in path.tolist()]) == pytest.approx(best, rel=1e-9)
