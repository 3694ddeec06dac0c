import numpy as np

from tracker.survey.mosaic import BEYOND, _lower_medians


def test_the_median_is_of_the_values_that_count_alone(rng):
    values = rng.integers(0, 200, size=(9, 4, 6, 3)).astype(np.uint8)
    number = rng.integers(1, 10, size=(4, 6))
    number[0, 0] = 0
    counted = np.arange(9)[:, None, None] < number
    given = np.where(counted[..., None], values, np.uint8(BEYOND))
    want, got = np.full((2, 4, 6, 3), BEYOND, np.uint8)
    for i, j in np.argwhere(number > 0):
        want[i, j] = np.sort(values[: number[i, j], i, j], axis=0)[(number[i, j] - 1) // 2]
    _lower_medians(given, number, got)
    np.testing.assert_array_equal(got, want)
