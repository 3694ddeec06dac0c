"""Films that several tests look at, painted once."""

import numpy as np
import pytest

from tests.tracker.outline.films import a_walk


@pytest.fixture(scope="session")
def walk():
    return a_walk()


@pytest.fixture(scope="session")
def stage(walk):
    return walk.stage(np.random.default_rng(21))
