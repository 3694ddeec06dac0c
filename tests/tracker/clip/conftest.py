"""The painted walk, and its film."""

import pytest

from tests.tracker.clip.filmed import as_video
from tests.tracker.outline.films import a_walk


@pytest.fixture
def walk():
    return a_walk()


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    return as_video(a_walk().images, tmp_path_factory.mktemp("walk"))
