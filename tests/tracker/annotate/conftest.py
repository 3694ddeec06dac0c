"""The marking page of the rendered walk, a server with a client that asks it, and a run to be corrected."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from kinematics.sides import exchanged as sides
from tests.tracker.annotate.clients import serving
from tests.tracker.annotate.exchanged_run import TURN, T
from tests.tracker.annotate.pages import session_page
from tests.tracker.clips import QUIET, write_table, write_video
from tracker.annotate.marks import Table
from tracker.annotate.server import Server
from tracker.annotate.session import Session
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.report.results import write_run
from tracker.scene.film import render, truth_table
from tracker.tables.keypoints import read_keypoints


@pytest.fixture
def table(tmp_path):
    """A table to be written, in a folder of its own."""
    table = tmp_path / "out" / "k.csv"
    table.parent.mkdir()
    return table


@pytest.fixture
def client(clip, table):
    """A client of a server that runs; its `thread` ends with the session."""
    with serving(Server(Session(clip.video, Table(table), 0))) as client:
        yield client


@pytest.fixture
def page(browser, clip, table):
    """The page of a session on the rendered walk."""
    with session_page(browser, clip.video, table) as page:
        yield page


@pytest.fixture
def truth(clip):
    """The joints of frame 0, hundredths of pixels."""
    return {name: tuple(np.round(places[0], 2).tolist()) for name, places in clip.joints.items()}


@pytest.fixture(scope="session")
def scene():
    return render(11, frames=T, size=(480, 270), shrubs=False)


@pytest.fixture(scope="session")
def tracked(scene, tmp_path_factory):
    """The run of a film, its legs exchanged on purpose from TURN on; not to be written to."""
    folder = tmp_path_factory.mktemp("exchanged")
    write_video(folder / "walk.mp4", scene.images)
    write_table(folder / "walk.csv", [row for row in truth_table(scene) if row[0] == 0])
    finished = follow(Job(folder / "walk.mp4", read_keypoints(folder / "walk.csv")), QUIET)
    track, (twin, q) = finished.track, (sides(finished.track.figure.freedoms), finished.track.q.copy())
    q[TURN:] = q[TURN:, twin]
    (folder / "run").mkdir()
    write_run(replace(finished, track=replace(track, q=q)), folder / "run", QUIET, overlay=False)
    return folder / "run"


@pytest.fixture
def run(tracked, tmp_path):
    """A copy of the run."""
    return shutil.copytree(tracked, tmp_path / "run")
