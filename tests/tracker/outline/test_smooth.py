import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.ndimage import convolve1d, gaussian_filter1d

from tracker.outline.smooth import smooth, sums_around


@pytest.mark.parametrize("shape", [(30,), (30, 2), (3, 2), (1,)])
@pytest.mark.parametrize("spread", [1.0, 1.5, 10.0])
def test_frames_are_smoothed_as_scipy_does(shape, spread, rng):
    values = rng.normal(size=shape)
    assert_allclose(smooth(values, spread), gaussian_filter1d(values, spread, axis=0, mode="nearest"))


def test_beyond_the_ends_there_is_nothing_to_sum(rng):
    values, weights = rng.normal(size=(9, 4)), np.array([0.2, 0.5, 1.0, 0.5, 0.2])
    assert_allclose(sums_around(values, weights), convolve1d(values, weights, axis=0, mode="constant"))
