"""A folder with a film in it, and its desk."""

import shutil

import pytest

from tests.tracker.annotate.clients import serving
from tracker.desk.desk_page import Desk, Server


@pytest.fixture
def folder(film, tmp_path):
    """A folder with that film in it and something else."""
    place = tmp_path / "films"
    place.mkdir()
    shutil.copy(film, place)
    (place / "notes.txt").write_text("not a film")
    return place


@pytest.fixture
def client(folder):
    """A client of the folder's desk, which runs."""
    desk = Desk(folder, browser=False)
    try:
        with serving(Server(desk)) as client:
            yield client
    finally:
        desk.stop()


@pytest.fixture
def browser(browser, client):
    """The browser, which leaves the desk's page before the desk ends: a page that outlives it complains."""
    yield browser
    browser.open("about:blank")
