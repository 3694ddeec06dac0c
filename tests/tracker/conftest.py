"""Fixtures of the tracker's tests."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from tests.tracker.clips import Clip, make_clip
from tracker.models.cluster import local_cluster

if TYPE_CHECKING:
    from distributed import Client


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Clip:
    """Ten frames of a rendered walk; not to be written to."""
    return make_clip(tmp_path_factory.mktemp("clip"))


@pytest.fixture(scope="module")
def cluster() -> Iterator["Client"]:
    """A real Dask cluster of two processes of this machine."""
    with local_cluster(2) as client:
        yield client
