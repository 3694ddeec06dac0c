"""Sums under silhouettes by Fourier transforms, against sums place by place."""

import numpy as np
import pytest

from tracker.outline.kernels import Kernels

HIP = (2, 4)  # row and column


def summed(values, silhouette):
    """The sums place by place, nothing beyond the map."""
    h, w = silhouette.shape
    wide = np.pad(values, [(HIP[0], h), (HIP[1], w)])
    rows, columns = map(range, values.shape)
    return np.array([[np.sum(wide[i : i + h, j : j + w] * silhouette) for j in columns] for i in rows])


@pytest.mark.parametrize("shape", [(9, 14), (17, 31), (3, 2)])
def test_a_map_is_summed_under_every_silhouette_with_its_hip_at_every_place(shape, rng):
    silhouettes = rng.normal(size=(3, 5, 7)).astype(np.float32)
    values = rng.normal(size=shape).astype(np.float32)
    found = Kernels.of(silhouettes, HIP, shape).sums(values)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, [summed(values, each) for each in silhouettes], atol=1e-4)
