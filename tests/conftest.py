"""Fixtures shared by every room."""

import os
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of real captures and clips; its tests skip where it is not given."""
    folder = os.environ.get("FIGTRACK_DATA")
    if not folder:
        pytest.skip("FIGTRACK_DATA names no folder of captures and clips")
    return Path(folder)
