"""The stock of good inputs, made once, and a copy of it for each test to spoil."""

import shutil
from contextlib import chdir

import pytest

from tests.spoiled.stock import fill


@pytest.fixture(scope="session")
def stock(clip, tmp_path_factory):
    """A folder in which every command succeeds; not to be written to."""
    folder = tmp_path_factory.mktemp("stock")
    with chdir(folder):
        fill(folder, clip)
    return folder


@pytest.fixture
def folder(stock, tmp_path, monkeypatch):
    """A copy of the stock that one is in."""
    place = tmp_path / "copy"
    shutil.copytree(stock, place)
    monkeypatch.chdir(place)
    return place
