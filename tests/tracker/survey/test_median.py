import numpy as np
import pytest

from tracker.survey.median import BEYOND, comparisons, medians


@pytest.mark.parametrize("count", [1, 2, 3, 5, 8, 13, 60])
def test_the_network_sorts_any_number_of_values(count, rng):
    values = rng.integers(0, 256, size=(count, 50))
    sorted_by_network = values.copy()
    for i, j in comparisons(count):
        a, b = sorted_by_network[i].copy(), sorted_by_network[j].copy()
        sorted_by_network[i], sorted_by_network[j] = np.minimum(a, b), np.maximum(a, b)
    np.testing.assert_array_equal(sorted_by_network, np.sort(values, axis=0))


def test_the_median_is_of_the_values_that_count_alone(rng):
    values = rng.integers(0, 200, size=(9, 4, 6, 3)).astype(np.uint8)
    number = rng.integers(1, 10, size=(4, 6))
    counted = np.arange(9)[:, None, None] < number
    want = np.empty((4, 6, 3), np.uint8)
    for i in range(4):
        for j in range(6):
            want[i, j] = np.sort(values[: number[i, j], i, j], axis=0)[(number[i, j] - 1) // 2]
    given = np.where(counted[..., None], values, np.uint8(BEYOND))
    np.testing.assert_array_equal(medians(given, number), want)
