"""Fixtures of the tracker's tests."""

import pytest

from tests.tracker.clips import Clip, make_clip


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Clip:
    """Ten frames of a rendered walk; not to be written to."""
    return make_clip(tmp_path_factory.mktemp("clip"))
