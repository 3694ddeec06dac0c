"""Fixtures of the documentation's tests."""

import pytest

from tests.handbook.stage import furnish, shorten
from tracker.models.cluster import local_cluster


@pytest.fixture(scope="session")
def stage(tmp_path_factory):
    """What pages take for granted; to be copied."""
    return furnish(tmp_path_factory.mktemp("stage"))


@pytest.fixture(scope="module")
def scheduler(request):
    """Gives the address of a real Dask scheduler, which is started when first asked for."""
    running = []

    def address():
        if not running:
            cluster = local_cluster(1)
            running.append(cluster.__enter__())
            request.addfinalizer(lambda: cluster.__exit__(None, None, None))
        return running[0].scheduler.address

    return address


@pytest.fixture
def here(tmp_path, monkeypatch):
    """The folder one is in."""
    monkeypatch.chdir(tmp_path)
    shorten(monkeypatch)
    return tmp_path
