"""Fixtures of the documentation's tests."""

import pytest

from tests.handbook.stage import furnish, shorten


@pytest.fixture(scope="session")
def stage(tmp_path_factory):
    """What pages take for granted; to be copied."""
    return furnish(tmp_path_factory.mktemp("stage"))


@pytest.fixture
def scheduler(request):
    """Gives the address of a real Dask scheduler, which is started when first asked for."""
    return lambda: request.getfixturevalue("cluster").scheduler.address


@pytest.fixture
def here(tmp_path, monkeypatch):
    """The folder one is in."""
    monkeypatch.chdir(tmp_path)
    shorten(monkeypatch)
    return tmp_path
