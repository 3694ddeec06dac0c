import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.ndimage import gaussian_filter1d

from tracker.outline.smooth import finer, smooth


@pytest.mark.parametrize("shape", [(30,), (30, 2), (3, 2), (1,)])
@pytest.mark.parametrize("spread", [1.0, 1.5, 10.0])
def test_frames_are_smoothed_as_scipy_does(shape, spread, rng):
    values = rng.normal(size=shape)
    assert_allclose(smooth(values, spread), gaussian_filter1d(values, spread, axis=0, mode="nearest"))


@pytest.mark.parametrize("every", [1, 2, 5])
@pytest.mark.parametrize("shape", [(8,), (8, 2, 3), (1, 2)])
def test_between_frames_values_are_interpolated_as_numpy_does(every, shape, rng):
    values = rng.normal(size=shape)
    at = np.arange(every * (len(values) - 1) + 1) / every
    wanted = [np.interp(at, np.arange(len(values)), each) for each in values.reshape(len(values), -1).T]
    assert_allclose(finer(values, every), np.stack(wanted, axis=1).reshape(-1, *shape[1:]), atol=1e-12)
    assert np.array_equal(finer(values, every)[::every], values)
