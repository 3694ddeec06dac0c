"""A server of the page, and a client that asks it."""

import threading

import pytest

from tests.tracker.annotate.clients import Client
from tracker.annotate.marks import Table
from tracker.annotate.server import Server
from tracker.annotate.session import Session


@pytest.fixture
def table(tmp_path):
    """A table to be written, in a folder of its own."""
    table = tmp_path / "out" / "k.csv"
    table.parent.mkdir()
    return table


@pytest.fixture
def client(clip, table):
    """A client of a server that runs; its `thread` ends with the session."""
    with Server(Session(clip.video, Table(table), 0)) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        client = Client(server)
        client.thread = thread
        yield client
        server.shutdown()
