"""A folder with a film in it, and its desk."""

import shutil

import pytest

from tests.tracker.annotate.clients import serving
from tests.tracker.clips import write_video
from tests.tracker.outline.films import a_walk
from tracker.desk.desk_page import Desk, Server

FIRST = 5  # the film begins within a stride


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """A film of who walks to the right; not to be written to."""
    path = tmp_path_factory.mktemp("film") / "walk.mp4"
    write_video(path, a_walk().images[FIRST:])
    return path


@pytest.fixture
def folder(walk, tmp_path):
    """A folder with that film in it and something else."""
    place = tmp_path / "films"
    place.mkdir()
    shutil.copy(walk, place)
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
