"""Films that several tests look at, painted once."""

import numpy as np
import pytest

from tests.tracker.outline.films import a_walk


@pytest.fixture(scope="session")
def walk():
    return a_walk()


@pytest.fixture(params=["right", "left"])
def either_way(request, walk):
    """Who walks to the right, or to the left."""
    return walk if request.param == "right" else walk.mirrored()


@pytest.fixture
def two(walk):
    """Who walk apart, one behind the other."""
    return [walk.shifted(by).part(slice(8, 28)) for by in (-44, 44)]


@pytest.fixture(scope="session")
def stage(walk):
    return walk.stage(np.random.default_rng(21))
